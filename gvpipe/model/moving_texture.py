"""A moving image given to a sequence: the base colour of its materials."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gvpipe.asset.image_choice import without_unused
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


def with_pictures(sequence: MeshSequence, pictures: Any, name: str = "texture") -> MeshSequence:
    """Return the sequence with a picture per frame as the base colour of its materials.

    Materials whose base colour is a texture show it in place of that; where there are none, all show it. A part without a
    material gets one, if there is no such texture.

    Args:
        sequence: with texture coordinates ``uv``.
        pictures: ``(F, height, width, 3) uint8``, or `gvpipe.asset.moving.Pictures`.
        name: of the image.

    Raises:
        InputError: there are no texture coordinates, or another number of pictures than of frames.
    """
    uv = sequence.attributes.get("uv")
    if uv is None or uv.domain not in ("vertex", "corner"):
        raise InputError(
            f"{sequence.name} has no texture coordinates for {name!r}; export the mesh with uv, or leave the texture out"
        )
    image = Image(name, pictures=pictures)
    number = len(sequence.images)
    given, parts = sequence.materials, sequence.parts or (Part("", (0, sequence.n_vertices), (0, len(sequence.faces))),)
    if any(material.base_color_texture for material in given):
        shown = [_replaced(material, number) for material in given]
    else:
        if any(part.material is None for part in parts):
            given = (*given, Material(name=name, double_sided=True))
            parts = tuple(replace(part, material=len(given) - 1) if part.material is None else part for part in parts)
        white = (1.0, 1.0, 1.0)
        shown = [replace(each, base_color_texture=Texture(number), base_color=(*white, each.base_color[3])) for each in given]
    materials, images = without_unused(shown, [*sequence.images, image])
    return sequence.with_looks(materials, images, parts)


def _replaced(material: Material, number: int) -> Material:
    """A material whose base colour shows another image, if it shows any."""
    before = material.base_color_texture
    return material if before is None else replace(material, base_color_texture=replace(before, image=number))
