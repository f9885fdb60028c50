"""What an asset has, as JSON values: parts, polygons, materials, images and metadata."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Int32


class Things(NamedTuple):
    """What is listed, all but ``polygons`` as in `gvpipe.MeshSequence`.

    Args:
        polygons: how many faces have each number of corners (`count_polygons`).
    """

    parts: Sequence[Part]
    polygons: Mapping[int, int]
    materials: Sequence[Material]
    images: Sequence[Image]
    metadata: Metadata


def count_polygons(polygons: Int32 | None) -> dict[int, int]:
    """How many of the polygons ``(P,)`` have each number of corners, least first; none if all are triangles."""
    if polygons is None:
        return {}
    corners, counts = np.unique(polygons, return_counts=True)
    return dict(zip(corners.tolist(), counts.tolist(), strict=True))


def list_things(things: Things) -> dict[str, Any]:
    """Keys ``parts``, ``polygons``, ``materials``, ``images`` and ``metadata`` of `gvpipe.Info`."""
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
        "polygons": {str(corners): count for corners, count in things.polygons.items()},
        "materials": [material.name for material in things.materials],
        "images": [_image(image) for image in things.images],
        "metadata": {**dataclasses.asdict(things.metadata), "times": list(things.metadata.times)},
    }


def _image(image: Image) -> dict[str, Any]:
    values = {
        "name": image.name,
        "media_type": image.media_type,
        "size": None if image.size is None else list(image.size),
        "bytes": len(image.data),
    }
    if image.pictures is None:
        return values
    coded = {"codec": getattr(image.pictures, "codec", ""), "bytes": getattr(image.pictures, "n_bytes", 0)}
    return {**values, **coded, "frames": len(image.pictures)}
