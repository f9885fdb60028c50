"""What a file holds beside positions, as JSON values for `gvpipe.info`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gvpipe.asset.listing import Things, list_things
from gvpipe.asset_coding.directory import Listed
from gvpipe.asset_coding.reader import AssetReader
from gvpipe.container.bitstream import Bitstream


def list_asset(asset: AssetReader, bitstream: Bitstream) -> dict[str, Any]:
    """Parts, attributes, fields, polygons, materials, images, metadata and notes, each with its bytes where it has some."""
    directory = asset.directory
    things = list_things(Things(asset.parts, asset.polygons, asset.materials, asset.images, asset.metadata))
    return {
        **things,
        "attributes": _listed(directory.attributes, bitstream),
        "fields": [
            {**values, "range": listed.range and list(listed.range)}
            for values, listed in zip(_listed(directory.fields, bitstream), directory.fields, strict=True)
        ],
        "notes": list(asset.notes),
    }


def _listed(things: Iterable[Listed], bitstream: Bitstream) -> list[dict[str, Any]]:
    return [
        {
            "name": each.name,
            "kind": each.kind,
            "domain": each.domain,
            "components": max(each.components, 1),
            "type": each.dtype,
            "unit": each.unit,
            "bound": each.bound,
            "bytes": bitstream.section_sizes.get(each.section, 0),
        }
        for each in things
    ]
