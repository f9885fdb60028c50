"""What an asset has, as JSON values: parts, polygons, materials, images and metadata."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gvpipe.arrays import Int32
from gvpipe.asset.material import Image, Material, image_size
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part


class Things(NamedTuple):
    """What is listed; all as in `gvpipe.MeshSequence`."""

    parts: Sequence[Part]
    polygons: Int32 | None
    materials: Sequence[Material]
    images: Sequence[Image]
    metadata: Metadata


def list_things(things: Things) -> dict[str, Any]:
    """Keys ``parts``, ``polygons``, ``materials``, ``images`` and ``metadata`` of `gvpipe.Info`."""
    polygons = things.polygons
    counts = {} if polygons is None else dict(zip(*np.unique(polygons, return_counts=True), strict=True))
    return {
        "parts": [
            {
                "name": part.name,
                "vertices": list(part.vertices),
                "triangles": list(part.triangles),
                "material": None if part.material is None else things.materials[part.material].name,
                "parent": part.parent,
            }
            for part in things.parts
        ],
        "polygons": {str(corners): int(count) for corners, count in counts.items()},
        "materials": [material.name for material in things.materials],
        "images": [
            {"name": image.name, "media_type": image.media_type, "size": _size(image.data), "bytes": len(image.data)}
            for image in things.images
        ],
        "metadata": dataclasses.asdict(things.metadata),
    }


def _size(data: bytes) -> list[int] | None:
    found = image_size(data)
    return None if found is None else list(found)
