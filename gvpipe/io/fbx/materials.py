"""Materials of an FBX scene, by ufbx's physically based maps, as glTF's metallic-roughness model has them."""

from __future__ import annotations

from typing import Any

from gvpipe.asset.material import Material, Texture
from gvpipe.io.fbx.library import hold
from gvpipe.io.fbx.textures import Textures


def read_material(material: Any, textures: Textures, uv_names: dict[str, str]) -> Material:
    """Return a material; its pictures are added to ``textures``.

    Texture maps of metallic and roughness alone are left out, because the model wants both in one picture.
    """
    maps = hold(material.pbr)
    color = _color(maps.base_color, maps.base_factor, (1.0, 1.0, 1.0))
    opacity = _number(maps.opacity, 1.0)
    emissive = _color(maps.emission_color, maps.emission_factor, (0.0, 0.0, 0.0))
    show = {
        "base_color_texture": _texture(maps.base_color, textures, uv_names),
        "normal_texture": _texture(maps.normal_map, textures, uv_names),
        "occlusion_texture": _texture(maps.ambient_occlusion, textures, uv_names),
        "emissive_texture": _texture(maps.emission_color, textures, uv_names),
    }
    is_cut = _texture(maps.opacity, textures, uv_names) is not None
    return Material(
        str(material.name),
        # a picture takes the place of the colour, as in the programs that write FBX
        (*((1.0, 1.0, 1.0) if show["base_color_texture"] else color), opacity),
        metallic=min(max(_number(maps.metalness, 0.0), 0.0), 1.0),
        roughness=min(max(_number(maps.roughness, 1.0), 0.0), 1.0),
        emissive=emissive,
        alpha_mode="blend" if opacity < 1 or is_cut else "opaque",
        double_sided=bool(hold(hold(material.features).double_sided).enabled),
        **show,  # type: ignore[arg-type]  # textures or None
    )


def _color(found: Any, factor: Any, default: tuple[float, float, float]) -> tuple[float, float, float]:
    held = hold(found)
    if not held.has_value:
        return default
    value, scale = hold(held.value_vec4), _number(factor, 1.0)
    red, green, blue = (min(max(float(getattr(value, axis)) * scale, 0.0), 1.0) for axis in "xyz")
    return red, green, blue


def _number(found: Any, default: float) -> float:
    held = hold(found)
    return float(hold(held.value_vec4).x) if held.has_value else default


def _texture(found: Any, textures: Textures, uv_names: dict[str, str]) -> Texture | None:
    held = hold(found)
    texture = hold(held.texture)
    return textures.read(texture, uv_names) if texture is not None and held.texture_enabled else None
