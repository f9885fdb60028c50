"""Material files of OBJ, written so that `gvpipe.io.obj.mtl` gives the same materials back.

Numbers have all their digits. What MTL has no statement for is named in a note: occlusion textures, cut-outs by a threshold,
double sides, materials without light, mirrored and unfiltered textures, rotations, further texture coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

from gvpipe.asset.material import Material, Texture

MAPS = {
    "base_color_texture": ("map_Kd",),
    "metallic_roughness_texture": ("map_Pr -imfchan g", "map_Pm -imfchan b"),
    "emissive_texture": ("map_Ke",),
    "normal_texture": ("norm",),
}


def write_mtl(materials: Sequence[Material], names: Sequence[str], pictures: Sequence[str]) -> tuple[str, list[str]]:
    """The text of a material file, and the names of what it has no place for.

    Args:
        materials: to be written.
        names: of theirs, all different, without line ends.
        pictures: file name of each image.
    """
    blocks, lost = [], set()
    for material, name in zip(materials, names, strict=True):
        blocks.append("\n".join([f"newmtl {name}", *_statements(material, pictures)]) + "\n")
        lost |= _lost(material)
    return "\n".join(blocks), sorted(lost)


def _statements(material: Material, pictures: Sequence[str]) -> list[str]:
    *color, alpha = material.base_color
    lines = [
        f"Kd {_numbers(color)}",
        f"Ke {_numbers(material.emissive)}",
        f"Ns {1000 * (1 - min(max(material.roughness, 0), 1)) ** 2:.6g}",
        f"Pr {material.roughness!r}",
        f"Pm {material.metallic!r}",
        f"d {1.0 if material.alpha_mode == 'opaque' else alpha!r}",
        "illum 2",
        *([f"Ni {material.ior!r}"] if material.ior > 1 and material.ior != Material.ior else []),
        *([f"Pc {material.clearcoat!r}", f"Pcr {material.clearcoat_roughness!r}"] if material.clearcoat else []),
    ]
    for role, keywords in MAPS.items():
        texture = material.textures.get(role)
        if texture:
            lines += [f"{keyword} {_options(texture, role)}{pictures[texture.image]}" for keyword in keywords]
    base = material.base_color_texture
    if base and material.alpha_mode != "opaque" and alpha == 1:
        lines.append(f"map_d {_options(base, '')}{pictures[base.image]}")
    return lines


def _options(texture: Texture, role: str) -> str:
    (u, v), (su, sv) = texture.offset, texture.tiling
    from_below = round(1 - v - sv, 12) + 0.0
    options = f"-o {u!r} {from_below!r} 0 " if (u, from_below) != (0, 0) else ""
    options += f"-s {su!r} {sv!r} 1 " if (su, sv) != (1, 1) else ""
    options += "-clamp on " if texture.wrap == ("clamp", "clamp") else ""
    return options + (f"-bm {texture.scale!r} " if role == "normal_texture" and texture.scale != 1 else "")


def _has_layers(material: Material) -> bool:
    """Whether a material has what neither glTF's own model nor a clear coat is."""
    names = [each.name for each in fields(Material)]
    plain = {*names[: names.index("emissive_strength") + 1], "clearcoat", "clearcoat_roughness", "ior"}
    return any(getattr(material, each.name) != each.default for each in fields(Material) if each.name not in plain)


def _lost(material: Material) -> set[str]:
    """What MTL has no statement for, in words."""
    lost = set()
    if material.occlusion_texture:
        lost.add("occlusion textures")
    if _has_layers(material):
        lost.add("transmission, sheen and other layers of materials")
    if material.alpha_mode == "mask":
        lost.add("alpha thresholds")
    if material.double_sided or material.unlit:
        lost.add("double-sided or unlit materials")
    for texture in material.textures.values():
        plain = replace(texture, filter="linear", rotation=0.0)
        if plain != texture or texture.wrap not in (("repeat", "repeat"), ("clamp", "clamp")):
            lost.add("rotations, filters and mirroring of textures")
        if texture.uv != "uv":
            lost.add(f"textures by {texture.uv!r}")
    return lost


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
