"""The materials and images that some parts show, where a file has those of others, too."""

from __future__ import annotations

from dataclasses import replace

from gvpipe.asset.material import Image, Material
from gvpipe.asset.part import Part


def used_looks(
    parts: tuple[Part, ...], materials: tuple[Material, ...], images: tuple[Image, ...]
) -> tuple[tuple[Part, ...], tuple[Material, ...], tuple[Image, ...]]:
    """Return the parts with the materials that they show, and the images of those, numbered anew."""
    numbers = sorted({part.material for part in parts if part.material is not None})
    kept = [materials[number] for number in numbers]
    shown = sorted({texture.image for material in kept for texture in material.textures.values()})
    place = {number: new for new, number in enumerate(numbers)}
    image_place = {number: new for new, number in enumerate(shown)}
    renumbered = []
    for material in kept:
        changes = {role: replace(texture, image=image_place[texture.image]) for role, texture in material.textures.items()}
        renumbered.append(replace(material, **changes))  # type: ignore[arg-type]
    own = tuple(part if part.material is None else replace(part, material=place[part.material]) for part in parts)
    return own, tuple(renumbered), tuple(images[number] for number in shown)
