"""Materials of an FBX scene, by ufbx's physically based maps, as glTF's metallic-roughness model has them."""

from __future__ import annotations

from gvpipe.asset.material import Material, Texture
from gvpipe.io.fbx.answers import Map, Shown
from gvpipe.io.fbx.textures import Textures


def read_material(shown: Shown, textures: Textures, uv_names: dict[str, str]) -> Material:
    """Return a material; its pictures are added to ``textures``.

    Texture maps of metallic and roughness alone are left out, because the model wants both in one picture.
    """
    maps = shown.maps
    opacity = _number(maps["opacity"], 1.0)
    emissive = _color(maps["emission_color"], maps["emission_factor"], (0.0, 0.0, 0.0))
    color = _color(maps["base_color"], maps["base_factor"], (1.0, 1.0, 1.0))

    def texture(name: str) -> Texture | None:
        picture = maps[name].picture
        return None if picture is None else textures.read(picture, uv_names)

    base = texture("base_color")
    return Material(
        shown.name,
        # a picture takes the place of the colour, as in the programs that write FBX
        (*((1.0, 1.0, 1.0) if base else color), opacity),
        base,
        metallic=min(max(_number(maps["metalness"], 0.0), 0.0), 1.0),
        roughness=min(max(_number(maps["roughness"], 1.0), 0.0), 1.0),
        emissive=emissive,
        normal_texture=texture("normal_map"),
        occlusion_texture=texture("ambient_occlusion"),
        emissive_texture=texture("emission_color"),
        alpha_mode="blend" if opacity < 1 or texture("opacity") is not None else "opaque",
        double_sided=shown.is_double_sided,
    )


def _color(held: Map, factor: Map, default: tuple[float, float, float]) -> tuple[float, float, float]:
    if held.value is None:
        return default
    scale = _number(factor, 1.0)
    red, green, blue = (min(max(value * scale, 0.0), 1.0) for value in held.value[:3])
    return red, green, blue


def _number(held: Map, default: float) -> float:
    return default if held.value is None else held.value[0]
