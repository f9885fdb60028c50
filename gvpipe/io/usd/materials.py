"""UsdPreviewSurface materials as gvpipe's, and the textures that they show.

Source: Pixar, UsdPreviewSurface specification, version 2.6. Its specular workflow and displacement have no place in glTF's
metallic-roughness model; they are named as what is not carried.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from gvpipe.asset.material import Image, Material, Texture
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.usd.names import name_of
from gvpipe.io.usd.textures import CHANNELS, Textures

TEXTURE = "UsdUVTexture"
WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp", "useMetadata": "repeat"}


class Materials:
    """The materials that meshes and subsets of a stage bind, each once.

    A material that both single-sided and double-sided meshes bind becomes two.

    Args:
        path: of the stage.
        time: at which pictures, colours and numbers that change are taken; None: their value for all times, or the earliest.
    """

    def __init__(self, path: Path, time: float | None = None) -> None:
        self._time = time
        self.textures = Textures(path)
        self.times: Sequence[float] = ()  # time codes of the frames, for textures that move
        self.materials: list[Material] = []
        self.plain: list[str] = []  # materials without UsdPreviewSurface
        self.left = LeftBehind()
        self._numbers: dict[tuple[str, bool], int] = {}
        self._uv_names: dict[int, dict[str, str]] = {}

    def of(self, prim: Any) -> int | None:
        """The number of the material that a mesh or a subset binds, or None."""
        from pxr import UsdGeom, UsdShade

        bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        if not bound:
            return None
        mesh = prim if prim.IsA(UsdGeom.Gprim) else prim.GetParent()
        two_sided = bool(UsdGeom.Gprim(mesh).GetDoubleSidedAttr().Get()) if mesh.IsA(UsdGeom.Gprim) else False
        key = (str(bound.GetPath()), two_sided)
        if key not in self._numbers:
            self._numbers[key] = len(self.materials)
            self.materials.append(replace(self._read(bound), double_sided=two_sided))
        return self._numbers[key]

    def name_uv(self, numbers: tuple[int | None, ...], named: dict[str, str]) -> None:
        """Give the textures of materials the attributes of a mesh whose primvars have those names; the first mesh decides."""
        for number in numbers:
            if number is None or number in self._uv_names:
                continue
            self._uv_names[number] = named
            material = self.materials[number]
            changes = {role: replace(each, uv=named.get(each.uv, "uv")) for role, each in material.textures.items()}
            self.materials[number] = replace(material, **changes)  # type: ignore[arg-type]

    def drawn(self) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
        """The materials, and the images that they show; those that were put into one are left out."""
        used = sorted({texture.image for material in self.materials for texture in material.textures.values()})
        place = {image: number for number, image in enumerate(used)}
        result = []
        for material in self.materials:
            changes = {role: replace(each, image=place[each.image]) for role, each in material.textures.items()}
            result.append(replace(material, **changes))  # type: ignore[arg-type]
        return tuple(result), tuple(self.textures.images[image] for image in used)

    def notes(self) -> tuple[str, ...]:
        """What could not be read of materials and textures."""
        plain = tuple(dict.fromkeys(self.plain))
        said = (f"materials without a UsdPreviewSurface have their names alone: {', '.join(plain[:5])}",) if plain else ()
        return (*said, *self.textures.notes)

    def _read(self, bound: Any) -> Material:
        name = name_of(bound.GetPrim())
        surface = bound.ComputeSurfaceSource()[0]
        if not surface or surface.GetIdAttr().Get() != "UsdPreviewSurface":
            self.plain.append(name)
            return Material(name, roughness=0.5)
        base, base_texture = self._color(surface, "diffuseColor", (0.18, 0.18, 0.18))
        emissive, emissive_texture = self._color(surface, "emissiveColor", (0.0, 0.0, 0.0))
        opacity, opacity_texture = self._number(surface, "opacity", 1.0)
        threshold, _ = self._number(surface, "opacityThreshold", 0.0)
        metallic, metallic_texture = self._number(surface, "metallic", 0.0)
        roughness, roughness_texture = self._number(surface, "roughness", 0.5)
        coat, coat_texture = self._number(surface, "clearcoat", 0.0)
        coat_roughness, coat_roughness_texture = self._number(surface, "clearcoatRoughness", 0.01 if coat else 0.0)
        self._note_losses(name, surface, base_texture, opacity_texture)
        combined = self.textures.combine(metallic_texture, roughness_texture)
        seen = opacity < 1 or opacity_texture is not None
        return Material(
            name,
            (*base, opacity),
            base_texture.texture if base_texture else None,
            metallic,
            roughness,
            combined,
            self._texture(surface, "normal"),
            self._texture(surface, "occlusion"),
            emissive,
            emissive_texture.texture if emissive_texture else None,
            "mask" if threshold > 0 else "blend" if seen else "opaque",
            threshold if threshold > 0 else 0.5,
            clearcoat=coat,
            clearcoat_texture=coat_texture.texture if coat_texture else None,
            clearcoat_roughness=coat_roughness,
            clearcoat_roughness_texture=coat_roughness_texture.texture if coat_roughness_texture else None,
            ior=self._number(surface, "ior", Material.ior)[0],
        )

    def _note_losses(self, name: str, surface: Any, base: Any, opacity: Any) -> None:
        """Say what of a surface has no place in glTF's metallic-roughness model."""
        if opacity and not (base and base.texture.image == opacity.texture.image and opacity.output == "a"):
            self.textures.notes.append(
                f"material {name}: the texture of opacity is not the alpha of its colour; it was left out"
            )
        if _value(surface, "useSpecularWorkflow"):
            self.left.add("specular colour of a material")
        if _value(surface, "displacement") or _connected(surface, "displacement")[0] is not None:
            self.left.add("displacement of a material")
        for given in surface.GetInputs():
            shader, _ = _connected(surface, given.GetBaseName())
            kind = "" if shader is None else str(shader.GetIdAttr().Get())
            if kind == TEXTURE and given.GetBaseName() != "normal" and any(_value(shader, "bias") or ()):
                self.left.add(f"bias of the texture of {given.GetBaseName()}")
            elif kind and kind != TEXTURE and not _shows_colors(surface, given.GetBaseName()):
                self.left.add(f"{kind} of {given.GetBaseName()}")

    def _color(self, surface: Any, name: str, fallback: tuple[float, float, float]) -> tuple[tuple[float, float, float], Any]:
        """A colour, or the texture in its place and what that is multiplied with."""
        source = self._source(surface, name)
        if source is not None:
            return source.scale[:3], source
        if _shows_colors(surface, name):
            return (1.0, 1.0, 1.0), None  # the mesh's own colours
        value = _value(surface, name, self._time)
        made = tuple(float(x) for x in value)[:3] if value is not None else fallback
        return (made if len(made) == 3 and all(math.isfinite(x) for x in made) else fallback), None

    def _number(self, surface: Any, name: str, fallback: float) -> tuple[float, Any]:
        source = self._source(surface, name)
        if source is not None:
            return source.scale[CHANNELS.get(source.output, 0)], source
        value = _value(surface, name, self._time)
        made = float(value) if isinstance(value, int | float) else fallback
        return (made if math.isfinite(made) else fallback), None

    def _texture(self, surface: Any, name: str) -> Texture | None:
        source = self._source(surface, name)
        if source is None:
            return None
        is_scaled = name == "normal" and source.scale[0] != 1  # 2 and a bias of -1 turn 0..1 into -1..1
        return replace(source.texture, scale=source.scale[0] / 2) if is_scaled else source.texture  # type: ignore[no-any-return]

    def _source(self, surface: Any, name: str) -> Any:
        """The texture that an input is connected to, or None."""
        shader, output = _connected(surface, name)
        if shader is None or shader.GetIdAttr().Get() != TEXTURE:
            return None
        place = _place(shader)
        wrap = tuple(WRAPS.get(str(_value(shader, axis)), "repeat") for axis in ("wrapS", "wrapT"))
        scale = _value(shader, "scale")
        factors = tuple(float(x) for x in scale) if scale is not None else (1.0, 1.0, 1.0, 1.0)
        assets = _values(shader, "file", self.times, self._time)
        return self.textures.read(assets, output, replace(place, wrap=wrap), factors)  # type: ignore[arg-type]


def _shows_colors(surface: Any, name: str) -> bool:
    """Whether a base colour is the mesh's own, which is carried."""
    shader, _ = _connected(surface, name)
    kind = "" if shader is None else str(shader.GetIdAttr().Get())
    return name == "diffuseColor" and kind.startswith("UsdPrimvarReader") and _value(shader, "varname") == "displayColor"


def _place(shader: Any) -> Texture:
    """Which coordinates a texture has, and how they are moved; the image comes later."""
    uv, offset, rotation, tiling = "st", (0.0, 0.0), 0.0, (1.0, 1.0)
    reader, _ = _connected(shader, "st")
    if reader is not None and reader.GetIdAttr().Get() == "UsdTransform2d":
        degrees = float(_value(reader, "rotation") or 0.0)
        scale, shift = _value(reader, "scale"), _value(reader, "translation")
        tiling = (float(scale[0]), float(scale[1])) if scale is not None else tiling
        moved = (float(shift[0]), float(shift[1])) if shift is not None else (0.0, 0.0)
        offset, rotation = _from_upper_left(moved, math.radians(degrees), tiling)
        reader, _ = _connected(reader, "in")
    if reader is not None and str(reader.GetIdAttr().Get()).startswith("UsdPrimvarReader"):
        uv = str(_value(reader, "varname") or uv)
    return Texture(0, uv, offset=offset, rotation=rotation, tiling=tiling)


def _from_upper_left(
    shift: tuple[float, float], angle: float, tiling: tuple[float, float]
) -> tuple[tuple[float, float], float]:
    """UsdTransform2d's translation and rotation, of (u, v) from the lower left, as KHR_texture_transform's.

    USD: uv' = R(angle) S uv + shift, counter-clockwise. With w = (u, 1 - v), c = cos(angle), s = sin(angle) and S = (a, b):

    - w'_u = c a w_u + s b w_v + (shift_u - s b)
    - w'_v = -s a w_u + c b w_v + (1 - shift_v - c b)
    """
    c, s = math.cos(angle), math.sin(angle)
    u = shift[0] - s * tiling[1]
    v = 1.0 - shift[1] - c * tiling[1]
    return (u, v), angle


def _connected(shader: Any, name: str) -> tuple[Any, str]:
    """The shader that an input is connected to, through node graphs, and the name of its output."""
    from pxr import UsdShade

    given = shader.GetInput(name)
    if not given:
        return None, ""
    for attribute in UsdShade.Utils.GetValueProducingAttributes(given):
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            return UsdShade.Shader(attribute.GetPrim()), UsdShade.Utils.GetBaseNameAndType(attribute.GetName())[0]
    return None, ""


def _values(shader: Any, name: str, times: Sequence[float], time: float | None) -> list[Any]:
    """The values of an input at some times; one where they are the same, there is none, or one time is asked for."""
    from pxr import UsdShade

    given = shader.GetInput(name)
    for attribute in UsdShade.Utils.GetValueProducingAttributes(given) if given and time is None else ():
        is_input = UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Input
        if is_input and attribute.ValueMightBeTimeVarying() and len(times) > 1:
            return [attribute.Get(float(each)) for each in times]
    return [_value(shader, name, time)]


def _value(shader: Any, name: str, time: float | None = None) -> Any:
    """The value of an input, through the interface of its material, or None; at a time, if that is given."""
    from pxr import Usd, UsdShade

    given = shader.GetInput(name)
    if not given:
        return None
    for attribute in UsdShade.Utils.GetValueProducingAttributes(given):
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Input:
            value = attribute.Get() if time is None else attribute.Get(time)
            return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value
    return None
