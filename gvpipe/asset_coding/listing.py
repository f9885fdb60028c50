"""What a file holds beside positions, as JSON values for `gvpipe.info`."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable
from typing import Any

from gvpipe.asset.field import VOLUME_DOMAINS
from gvpipe.asset.listing import Things, list_things
from gvpipe.asset.metadata import losses_of
from gvpipe.asset.part import Part
from gvpipe.asset_coding.directory import VERSION, Directory, Listed, file_notes, read_images
from gvpipe.asset_coding.sound_track import read_sound
from gvpipe.asset_coding.volume_list import SECTION as VOLUME
from gvpipe.asset_coding.volume_reader import read_volume_list
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.outline import Outline
from gvpipe.foundation.errors import corrupt


def list_asset(directory: Directory, outline: Outline, bitstream: Bitstream) -> dict[str, Any]:
    """Parts, attributes, fields, polygons, materials, images, metadata, volume and notes, with bytes where they have some.

    Args:
        directory, outline: of the bitstream.
        bitstream: whose images are read.

    Raises:
        CorruptFile: the outline counts other parts than the directory has, or an image is none.
    """
    is_read = directory.version <= VERSION  # else parts and polygons are not read either
    images = [image for image in read_images(directory, bitstream) if image is not None]
    parts = _parts(directory.parts, outline.part_triangles) if is_read else []
    polygons = outline.polygons if is_read else {}
    return {
        "not_carried": losses_of(directory.metadata),
        **list_things(Things(parts, polygons, directory.materials, images, directory.metadata)),
        "attributes": _listed(directory.attributes, bitstream),
        "fields": [
            {**values, "range": listed.range and list(listed.range)}
            for values, listed in zip(_listed(directory.fields, bitstream), directory.fields, strict=True)
        ],
        "volume": _volume(bitstream),
        "audio": _audio(bitstream),
        "notes": list(file_notes(directory, bitstream)),
    }


def _audio(bitstream: Bitstream) -> dict[str, Any] | None:
    sound, _ = read_sound(bitstream.companions)
    return None if sound is None else sound.to_json()


def _volume(bitstream: Bitstream) -> dict[str, Any] | None:
    listed = read_volume_list(bitstream)
    if listed is None:
        return None
    n_bytes = sum(size for name, size in bitstream.section_sizes.items() if name.startswith(VOLUME))
    names = {domain: [each.name for each in listed.numbers if each.domain == domain] for domain in VOLUME_DOMAINS}
    return {
        "cells": listed.cells,
        "points": listed.points,
        "bound": listed.bound,
        "point_fields": names["point"],
        "cell_fields": names["cell"],
        "bytes": n_bytes,
    }


def _parts(parts: tuple[Part, ...], counts: tuple[int, ...]) -> list[Part]:
    """The parts with their triangles, which follow each other."""
    if len(parts) != len(counts):
        raise corrupt(f"its outline counts the triangles of {len(counts)} parts, and it has {len(parts)}")
    bounds = itertools.accumulate(counts, initial=0)
    return [dataclasses.replace(part, triangles=span) for part, span in zip(parts, itertools.pairwise(bounds), strict=True)]


def _listed(things: Iterable[Listed], bitstream: Bitstream) -> list[dict[str, Any]]:
    return [
        {
            "name": each.name,
            "kind": each.kind,
            "domain": each.domain,
            "components": max(each.components, 1),
            "type": each.type,
            "unit": each.unit,
            "bound": each.bound,
            "bytes": bitstream.section_sizes.get(each.section, 0),
        }
        for each in things
    ]
