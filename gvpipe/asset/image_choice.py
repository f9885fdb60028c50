"""Materials and images without some of the images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gvpipe.asset.material import Image, Material, Texture


def without_images(
    materials: Sequence[Material], images: Sequence[Image | None]
) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
    """Materials and images without those images that are None: textures that show these are none, others are numbered anew."""
    place = np.cumsum([each is not None for each in images]) - 1

    def moved(texture: Texture) -> Texture | None:
        return None if images[texture.image] is None else replace(texture, image=int(place[texture.image]))

    kept = tuple(each for each in images if each is not None)
    if len(kept) == len(images):
        return tuple(materials), kept
    changed = []
    for material in materials:
        roles: dict[str, Any] = {role: moved(texture) for role, texture in material.textures.items()}
        changed.append(replace(material, **roles))
    return tuple(changed), kept


def without_unused(materials: Sequence[Material], images: Sequence[Image]) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
    """Materials and images without those images that no texture shows."""
    shown = {texture.image for material in materials for texture in material.textures.values()}
    return without_images(materials, [image if number in shown else None for number, image in enumerate(images)])
