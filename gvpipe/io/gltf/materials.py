"""Materials, textures, samplers and images of a file.

Images keep their bytes. A texture with an image as WebP and another shows the WebP; KTX2 is read where nothing else is.

Source: Khronos, glTF 2.0 specification, section 3.9; KHR_texture_transform, KHR_texture_basisu, EXT_texture_webp, and the
extensions of `gvpipe.io.gltf.looks`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from gvpipe.asset.material import Image, Material, Texture
from gvpipe.io.gltf.document import Document, MissingFile
from gvpipe.io.gltf.json_fields import Json, child, extension, flag, index, integer, number, numbers, text
from gvpipe.io.gltf.looks import DEFAULTS, LAYERS, STRENGTH, UNLIT, field_name

WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
NEAREST = 9728
TYPES = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp", b"\xabKTX": "image/ktx2"}
SOURCES = ("EXT_texture_webp", "", "KHR_texture_basisu")  # where a texture names its image; "": in the texture itself


class Looks(NamedTuple):
    """Materials, the images that they show, and a note of each missing image."""

    materials: tuple[Material, ...]
    images: tuple[Image, ...]
    notes: tuple[str, ...]


def read_materials(document: Document) -> Looks:
    """The materials and the images that they show, both in the file's order.

    Raises:
        ValueError: a field that cannot be.
        InputError: an image that is no picture.
    """
    used: list[int] = []
    materials = tuple(_read_material(document, one, f"material {i}", used) for i, one in enumerate(document.items("materials")))
    images: dict[int, Image] = {}
    missing: list[str] = []
    for shown in sorted(set(used)):
        try:
            images[shown] = _read_image(document, shown)
        except MissingFile as exc:
            missing.append(f"{exc}; its textures were left out")
    return Looks(tuple(_renumbered(material, list(images)) for material in materials), tuple(images.values()), tuple(missing))


def _read_material(document: Document, material: Json, where: str, used: list[int]) -> Material:
    surface = child(material, "pbrMetallicRoughness", where)

    def texture(owner: Json, key: str, scale: str = "") -> Texture | None:
        info = child(owner, key, where)
        made = _read_texture(document, info, f"{where}, {key}", scale) if info else None
        used.extend([made.image] if made else [])
        return made

    strength = number(extension(material, STRENGTH, where), "emissiveStrength", where, 1.0)
    emissive = numbers(material, "emissiveFactor", where, [0.0] * 3) * strength
    mode = text(material, "alphaMode", "OPAQUE").lower()
    red, green, blue, alpha = numbers(surface, "baseColorFactor", where, [1.0] * 4).tolist()
    return Material(
        text(material, "name"),
        (red, green, blue, alpha),
        texture(surface, "baseColorTexture"),
        number(surface, "metallicFactor", where, 1.0),
        number(surface, "roughnessFactor", where, 1.0),
        texture(surface, "metallicRoughnessTexture"),
        texture(material, "normalTexture", "scale"),
        texture(material, "occlusionTexture", "strength"),
        (float(emissive[0]), float(emissive[1]), float(emissive[2])),
        texture(material, "emissiveTexture"),
        mode if mode in ("opaque", "mask", "blend") else "opaque",
        number(material, "alphaCutoff", where, 0.5),
        flag(material, "doubleSided"),
        UNLIT in child(material, "extensions", where),
        1.0 if strength == max(1.0, *emissive.tolist()) else strength,  # what follows from the colour is not kept
        **_read_layers(material, where, texture),
    )


def _read_layers(material: Json, where: str, texture: Callable[[Json, str, str], Texture | None]) -> dict[str, Any]:
    """Fields of the material's extensions."""
    found: dict[str, Any] = {}
    for name, members in LAYERS.items():
        given = extension(material, name, where)
        for member in members if given else ():
            field = field_name(member)
            default = DEFAULTS[field]
            if default is None:
                found[field] = texture(given, member, "scale" if field.endswith("normal_texture") else "")
            elif isinstance(default, tuple):
                red, green, blue = numbers(given, member, where, list(default)).tolist()
                found[field] = red, green, blue
            else:
                found[field] = number(given, member, where, default)
    return found


def _read_texture(document: Document, info: Json, where: str, scale: str) -> Texture | None:
    """A texture; None if it names no image."""
    texture, name = document.item("textures", integer(info, "index", where))
    n_images = len(document.items("images"))
    owners = (extension(texture, key, name) if key else texture for key in SOURCES)
    image = next((found for owner in owners if (found := index(owner, "source", name, n_images)) is not None), None)
    if image is None:
        return None
    place = extension(info, "KHR_texture_transform", where)
    uv = integer(place, "texCoord", where, integer(info, "texCoord", where, 0))
    sampler: Json = document.item("samplers", integer(texture, "sampler", name))[0] if "sampler" in texture else {}
    offset, tiling = numbers(place, "offset", where, [0.0, 0.0]), numbers(place, "scale", where, [1.0, 1.0])
    return Texture(
        image,
        f"uv{uv}" if uv else "uv",
        number(info, scale, where, 1.0) if scale else 1.0,
        (_wrap(sampler, "wrapS"), _wrap(sampler, "wrapT")),
        "nearest" if sampler.get("magFilter") == NEAREST else "linear",
        (float(offset[0]), float(offset[1])),
        number(place, "rotation", where, 0.0),
        (float(tiling[0]), float(tiling[1])),
    )


def _wrap(sampler: Json, key: str) -> str:
    value: Any = sampler.get(key)
    return WRAPS.get(value, "repeat") if isinstance(value, int) else "repeat"


def _read_image(document: Document, number: int) -> Image:
    image, where = document.item("images", number)
    uri = text(image, "uri")
    if "bufferView" in image:
        data = bytes(document.view(integer(image, "bufferView", where)))
    elif uri:
        data = document.resource(uri, where)
    else:
        raise ValueError(f"{where} has neither a uri nor a bufferView")
    file_name = "" if uri.startswith("data:") else uri.rpartition("/")[2].rpartition(".")[0]
    known = next((kind for start, kind in TYPES.items() if data.startswith(start)), "")
    declared = text(image, "mimeType") or (uri[5:].partition(";")[0] if uri.startswith("data:") else "")
    return Image(text(image, "name") or file_name or where, known or declared or "application/octet-stream", data)


def _renumbered(material: Material, order: list[int]) -> Material:
    """A material whose textures count in the images that are kept; others are left out."""
    changes: Any = {
        name: replace(one, image=order.index(one.image)) if one.image in order else None
        for name, one in material.textures.items()
    }
    return replace(material, **changes) if changes else material
