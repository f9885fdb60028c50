"""Materials as UsdPreviewSurface, textures as files that a stage refers to."""

from __future__ import annotations

import math
from typing import Any

from gvpipe.asset.material import Material, Texture
from gvpipe.io.usd.names import identifier, name_prim
from gvpipe.model.sequence import MeshSequence

WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}


def frame_name(name: str, frame: int) -> str:
    """The file name of a frame of an image that moves, of the image's name."""
    stem, dot, ending = name.rpartition(".")
    return f"{stem}_{frame:04d}{dot}{ending}"


class MaterialWriter:
    """The materials of a sequence below one prim, each written when it is bound first.

    Args:
        stage: to write to.
        sequence: with materials and images.
        scope: path of the prim that holds them.
        folder: of the images, relative to the stage.
        names: of the images' files; of an image that moves, each frame has its own (`frame_name`).
        start: time code of the first frame.
    """

    def __init__(
        self, stage: Any, sequence: MeshSequence, scope: str, folder: str, names: list[str], start: float = 0.0
    ) -> None:
        self._stage, self._sequence, self._scope, self._start = stage, sequence, scope, start
        self._files = [f"./{folder}/{name}" for name in names]
        self._written: dict[int, Any] = {}
        self._taken: set[str] = set()

    def bind(self, prim: Any, number: int | None) -> None:
        """Bind a material to a mesh or a subset; None binds nothing."""
        from pxr import UsdShade

        if number is None:
            return
        if number not in self._written:
            self._written[number] = self._write(self._sequence.materials[number])
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(self._written[number])

    def _write(self, material: Material) -> Any:
        from pxr import Gf, Sdf, UsdGeom, UsdShade

        if not self._written:
            UsdGeom.Scope.Define(self._stage, self._scope)
        name, number = identifier(material.name) if material.name else "material", 1
        plain = name
        while name in self._taken:
            name, number = f"{plain}_{number}", number + 1
        self._taken.add(name)
        path = f"{self._scope}/{name}"
        made = UsdShade.Material.Define(self._stage, path)
        name_prim(made.GetPrim(), material.name)
        surface = UsdShade.Shader.Define(self._stage, f"{path}/surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        made.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
        types = Sdf.ValueTypeNames
        base, alpha = material.base_color[:3], material.base_color[3]
        self._input(surface, "diffuseColor", types.Color3f, Gf.Vec3f(*base), material.base_color_texture, "rgb", (*base, alpha))
        seen = material.alpha_mode != "opaque"
        texture = material.base_color_texture if seen else None
        self._input(surface, "opacity", types.Float, alpha if seen else 1.0, texture, "a", (*base, alpha))
        if material.alpha_mode == "mask":
            surface.CreateInput("opacityThreshold", types.Float).Set(material.alpha_cutoff)
        both = material.metallic_roughness_texture
        metal, rough = material.metallic, material.roughness
        self._input(surface, "metallic", types.Float, metal, both, "b", (1.0, rough, metal, 1.0))
        self._input(surface, "roughness", types.Float, rough, both, "g", (1.0, rough, metal, 1.0))
        glow = material.emissive
        self._input(surface, "emissiveColor", types.Color3f, Gf.Vec3f(*glow), material.emissive_texture, "rgb", (*glow, 1.0))
        coat, coat_roughness = material.clearcoat, material.clearcoat_roughness
        if coat:
            one = (coat, 1.0, 1.0, 1.0)
            self._input(surface, "clearcoat", types.Float, coat, material.clearcoat_texture, "r", one)
            rough_texture, other = material.clearcoat_roughness_texture, (1.0, coat_roughness, 1.0, 1.0)
            self._input(surface, "clearcoatRoughness", types.Float, coat_roughness, rough_texture, "g", other)
        if material.ior != Material.ior:
            surface.CreateInput("ior", types.Float).Set(material.ior)
        if material.normal_texture:
            self._input(surface, "normal", types.Normal3f, None, material.normal_texture, "rgb", None)
        if material.occlusion_texture:
            self._input(surface, "occlusion", types.Float, 1.0, material.occlusion_texture, "r", None)
        return made

    def _input(
        self, surface: Any, name: str, kind: Any, value: Any, texture: Texture | None, output: str,
        factors: tuple[float, ...] | None,
    ) -> None:  # fmt: skip
        """One input: a value, or the output of a texture, shared by the inputs that show it with the same factors."""
        from pxr import Sdf

        given = surface.CreateInput(name, kind)
        if texture is None:
            given.Set(value)
            return
        shader = self._texture(surface, name, texture, factors)
        shader.CreateOutput(output, Sdf.ValueTypeNames.Float3 if output == "rgb" else Sdf.ValueTypeNames.Float)
        given.ConnectToSource(shader.ConnectableAPI(), output)

    def _texture(self, surface: Any, name: str, texture: Texture, factors: tuple[float, ...] | None) -> Any:
        from pxr import Gf, Sdf, UsdShade

        types = Sdf.ValueTypeNames
        shared = {"opacity": "diffuseColor", "metallic": "roughness"}.get(name, name)
        path = f"{surface.GetPath().GetParentPath()}/{shared}_texture"
        shader = UsdShade.Shader.Define(self._stage, path)
        if shader.GetIdAttr().Get():
            return shader
        shader.CreateIdAttr("UsdUVTexture")
        file, given = self._files[texture.image], shader.CreateInput("file", types.Asset)
        pictures = self._sequence.images[texture.image].pictures
        given.Set(Sdf.AssetPath(file if pictures is None else frame_name(file, 0)))
        for frame in range(0 if pictures is None else len(pictures)):
            given.Set(Sdf.AssetPath(frame_name(file, frame)), self._start + frame)
        shader.CreateInput("sourceColorSpace", types.Token).Set("sRGB" if "Color" in shared else "raw")
        for axis, wrap in zip(("wrapS", "wrapT"), texture.wrap, strict=True):
            shader.CreateInput(axis, types.Token).Set(WRAPS[wrap])
        if factors is not None and any(factor != 1 for factor in factors):
            shader.CreateInput("scale", types.Float4).Set(Gf.Vec4f(*factors))
        if name == "normal":
            scale = texture.scale
            shader.CreateInput("scale", types.Float4).Set(Gf.Vec4f(2 * scale, 2 * scale, 2, 1))
            shader.CreateInput("bias", types.Float4).Set(Gf.Vec4f(-scale, -scale, -1, 0))
        coordinates = self._coordinates(path, texture)
        shader.CreateInput("st", types.Float2).ConnectToSource(coordinates.ConnectableAPI(), "result")
        return shader

    def _coordinates(self, path: str, texture: Texture) -> Any:
        """The shader that reads texture coordinates, and moves them where the texture says so."""
        from pxr import Gf, Sdf, UsdShade

        types = Sdf.ValueTypeNames
        name = f"st{texture.uv[2:]}" if texture.uv.startswith("uv") else texture.uv
        reader = UsdShade.Shader.Define(self._stage, f"{path}_st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", types.String).Set(name)
        reader.CreateOutput("result", types.Float2)
        if (texture.offset, texture.rotation, texture.tiling) == ((0.0, 0.0), 0.0, (1.0, 1.0)):
            return reader
        moved = UsdShade.Shader.Define(self._stage, f"{path}_transform")
        moved.CreateIdAttr("UsdTransform2d")
        moved.CreateInput("in", types.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        c, s = math.cos(texture.rotation), math.sin(texture.rotation)
        shift = (texture.offset[0] + s * texture.tiling[1], 1 - texture.offset[1] - c * texture.tiling[1])
        moved.CreateInput("rotation", types.Float).Set(math.degrees(texture.rotation))
        moved.CreateInput("scale", types.Float2).Set(Gf.Vec2f(*texture.tiling))
        moved.CreateInput("translation", types.Float2).Set(Gf.Vec2f(*shift))
        moved.CreateOutput("result", types.Float2)
        return moved
