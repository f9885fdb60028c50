"""What a file holds beside positions, as JSON values for `gvpipe.info`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from gvpipe.asset.material import image_size
from gvpipe.asset_coding.directory import Listed
from gvpipe.asset_coding.reader import AssetReader
from gvpipe.container.bitstream import Bitstream


def list_asset(asset: AssetReader, bitstream: Bitstream) -> dict[str, Any]:
    """Parts, attributes, fields, polygons, materials, images, metadata and notes, each with its bytes where it has some."""
    directory = asset.directory
    counts = {} if asset.polygons is None else dict(zip(*np.unique(asset.polygons, return_counts=True), strict=True))
    return {
        "parts": [
            {
                "name": part.name,
                "vertices": list(part.vertices),
                "triangles": list(part.triangles),
                "material": None if part.material is None else asset.materials[part.material].name,
                "parent": part.parent,
            }
            for part in asset.parts
        ],
        "attributes": _listed(directory.attributes, bitstream),
        "fields": [
            {**values, "range": listed.range and list(listed.range)}
            for values, listed in zip(_listed(directory.fields, bitstream), directory.fields, strict=True)
        ],
        "polygons": {str(corners): int(count) for corners, count in counts.items()},
        "materials": [material.name for material in asset.materials],
        "images": [
            {"name": image.name, "media_type": image.media_type, "size": _size(image.data), "bytes": len(image.data)}
            for image in asset.images
        ],
        "metadata": dataclasses.asdict(asset.metadata),
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
            "bytes": len(bitstream.sections.get(each.section, b"")),
        }
        for each in things
    ]


def _size(data: bytes) -> list[int] | None:
    found = image_size(data)
    return None if found is None else list(found)
