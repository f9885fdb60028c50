"""Materials and images into a GLB file; `materials` reads them.

Images keep their bytes, unless neither glTF nor an extension has their kind: those become PNG.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

from gvpipe.asset.material import Image, Material, Texture
from gvpipe.io.gltf.glb import Glb
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.looks import DEFAULTS, LAYERS, STRENGTH, UNLIT, field_name
from gvpipe.io.gltf.materials import NEAREST, WRAPS

CORE = ("image/png", "image/jpeg")
EXTENSIONS = {"image/webp": "EXT_texture_webp", "image/ktx2": "KHR_texture_basisu"}
LINEAR, NEAREST_MIPMAP, LINEAR_MIPMAP = 9729, 9984, 9987
WRAP_NUMBERS = {name: number for number, name in WRAPS.items()}


def write_materials(
    glb: Glb, materials: tuple[Material, ...], images: tuple[Image, ...], uv_sets: Mapping[str, int]
) -> list[int]:
    """Add materials and the images that they show, but those that an earlier call added; return the materials' numbers.

    Args:
        glb: the file.
        materials, images: of the sequence.
        uv_sets: number of each attribute of texture coordinates; textures without one are left out.
    """
    known = dict(glb.images)
    held = [known[image] if image in known else _write_image(glb, image) for image in images]
    glb.images |= dict(zip(images, held, strict=True))
    before = list(glb.tree.get("materials", []))
    numbers = []
    for material in materials:
        made = _material(glb, material, held, uv_sets)
        numbers.append(before.index(made) if made in before else glb.append("materials", made))
    return numbers


def _write_image(glb: Glb, image: Image) -> tuple[int, str]:
    """Add an image and return its number and its media type."""
    data, kind = image.data, image.media_type
    if kind not in CORE and kind not in EXTENSIONS:
        data, kind = _as_png(image), "image/png"
    return glb.append("images", {"name": image.name, "mimeType": kind, "bufferView": glb.view(data)}), kind


def _as_png(image: Image) -> bytes:
    from PIL import Image as Pillow

    with Pillow.open(io.BytesIO(image.data)) as opened:
        file = io.BytesIO()
        opened.save(file, "PNG")
        return file.getvalue()


def _material(glb: Glb, material: Material, images: list[tuple[int, str]], uv_sets: Mapping[str, int]) -> Json:
    def info(texture: Texture | None, scale: str = "") -> Json:
        if texture is None or texture.uv not in uv_sets:
            return {}
        return _texture_info(glb, texture, images[texture.image], uv_sets[texture.uv]) | (
            {scale: texture.scale} if scale and texture.scale != 1 else {}
        )

    strength, glow = material.emissive_strength, max(material.emissive)
    if strength <= 0 or glow > strength * (1 + 1e-9):
        strength = max(1.0, glow)
    item: Json = {
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": list(material.base_color),
            "baseColorTexture": info(material.base_color_texture),
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
            "metallicRoughnessTexture": info(material.metallic_roughness_texture),
        },
        "normalTexture": info(material.normal_texture, "scale"),
        "occlusionTexture": info(material.occlusion_texture, "strength"),
        "emissiveTexture": info(material.emissive_texture),
        "emissiveFactor": [min(1.0, value / strength) for value in material.emissive] if any(material.emissive) else None,
        "alphaMode": material.alpha_mode.upper() if material.alpha_mode != "opaque" else None,
        "alphaCutoff": material.alpha_cutoff if material.alpha_mode == "mask" else None,
        "doubleSided": material.double_sided or None,
        "extensions": {},
    }
    surface = item["pbrMetallicRoughness"]
    item["pbrMetallicRoughness"] = {key: value for key, value in surface.items() if value != {}}
    layers = _layers(material, info)
    layers |= {UNLIT: {}} if material.unlit else {}
    layers |= {STRENGTH: {"emissiveStrength": strength}} if strength != 1 else {}
    for name, members in layers.items():
        glb.use(name)
        item["extensions"][name] = members
    return {key: value for key, value in item.items() if value not in (None, {}, "")}


def _layers(material: Material, info: Callable[[Texture | None, str], Json]) -> Json:
    """The extensions that a material needs, with the members that have no default."""
    found: Json = {}
    for name, members in LAYERS.items():
        given: Json = {}
        for member in members:
            field = field_name(member)
            value = getattr(material, field)
            if value == DEFAULTS[field]:
                continue
            made = info(value, "scale" if field.endswith("normal_texture") else "") if isinstance(value, Texture) else value
            given |= {member: list(made) if isinstance(made, tuple) else made} if made != {} else {}
        found |= {name: given} if given else {}
    return found


def _texture_info(glb: Glb, texture: Texture, image: tuple[int, str], uv_set: int) -> Json:
    number, kind = image
    is_nearest = texture.filter == "nearest"
    sampler = {
        "magFilter": NEAREST if is_nearest else LINEAR,
        "minFilter": NEAREST_MIPMAP if is_nearest else LINEAR_MIPMAP,
        "wrapS": WRAP_NUMBERS[texture.wrap[0]],
        "wrapT": WRAP_NUMBERS[texture.wrap[1]],
    }
    extension = EXTENSIONS.get(kind)
    item: Json = {"sampler": _once(glb, "samplers", sampler)}
    if extension:
        glb.use(extension, is_required=True)
        item["extensions"] = {extension: {"source": number}}
    else:
        item["source"] = number
    info: Json = {"index": _once(glb, "textures", item)}
    info |= {"texCoord": uv_set} if uv_set else {}
    place: Json = {}
    place |= {"offset": list(texture.offset)} if texture.offset != (0, 0) else {}
    place |= {"rotation": texture.rotation} if texture.rotation else {}
    place |= {"scale": list(texture.tiling)} if texture.tiling != (1, 1) else {}
    if place:
        glb.use("KHR_texture_transform")
        info["extensions"] = {"KHR_texture_transform": place}
    return info


def _once(glb: Glb, kind: str, item: Json) -> int:
    """The number of an object, added unless an equal one is there."""
    items: list[Any] = glb.tree.get(kind, [])
    return items.index(item) if item in items else glb.append(kind, item)
