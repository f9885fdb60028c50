"""What an asset looks like: its materials, textures and colours in the arrays that kernels read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import WRAPS, Image, Material, Texture
from gvpipe.asset.moving import Pictures
from gvpipe.asset.part import Part
from gvpipe.asset.placement import from_upper_left
from gvpipe.foundation.arrays import Array, Bool, Float32, Float64, Int32, Int64
from gvpipe.rasterizer.alpha_ranges import reach_alpha
from gvpipe.rasterizer.colours import to_linear
from gvpipe.rasterizer.scene import BLENDED, CLAY, CULLED, NO_LOOK, ROLES, TESTED, UNLIT, Look
from gvpipe.rasterizer.textures import MovingTexels, decode_image, largest_side, pack

SRGB_ROLES = ("base_color_texture", "emissive_texture")  # the others hold numbers
INVISIBLE = 1 / 512  # alpha of what is see-through but left out
OPAQUE = 1 - 1 / 512
MAX_EMISSION = 1e4
FARTHEST_UV = 1e6  # times the image's side; float32 has no part of a texel left there
BARE = Material(double_sided=True)  # of triangles without one


class Asset(Protocol):
    """What is painted: a `gvpipe.MeshSequence`, or what has as much of it."""

    @property
    def name(self) -> str: ...

    @property
    def faces(self) -> Int32: ...

    @property
    def attributes(self) -> Mapping[str, Any]: ...

    @property
    def parts(self) -> Sequence[Part]: ...

    @property
    def materials(self) -> Sequence[Material]: ...

    @property
    def images(self) -> Sequence[Image]: ...

    def read(self, start: int, stop: int) -> Float32: ...


def look_of(asset: Asset) -> tuple[Look, tuple[str, ...], MovingTexels]:
    """Return an asset's look (that of none without materials and colours), notes on images left out, and what moves.

    Raises:
        InputError: a texture's uv attribute is missing, or is none of vertices or corners.
    """
    colours = _corner_colours(asset)
    if not asset.materials and not len(colours):
        return NO_LOOK, (), MovingTexels(NO_LOOK.texels, {}, 1)
    materials = [*asset.materials, BARE]
    of_triangles = np.full(len(asset.faces), len(materials) - 1, np.int32)
    for part in asset.parts:
        if part.material is not None:
            of_triangles[slice(*part.triangles)] = part.material
    used = np.zeros(len(materials), bool)
    used[of_triangles] = True
    textures = _Textures(asset, of_triangles)
    slots = np.full((len(materials), len(ROLES)), -1, np.int32)
    for m in np.flatnonzero(used).tolist():
        slots[m] = textures.add(m, materials[m])
    flags = [_flags(material) for material in materials]
    flags[-1] |= 0 if len(colours) else CLAY
    twins: list[int] = []
    for m in [m for m in np.flatnonzero(used).tolist() if flags[m] & TESTED]:
        for kept, which in _without_holes(m, materials[m], textures, colours):
            of_triangles[which] = len(materials)  # the same material, but for its flags
            materials.append(materials[m])
            flags.append(flags[m] & ~(TESTED | BLENDED) | kept)
            twins.append(m)
    slots = np.concatenate([slots, slots[twins]])
    base = np.clip([material.base_color for material in materials], 0, 1)
    texels = pack(textures.pixels, textures.is_srgb)
    look = Look(
        of_triangles=of_triangles,
        flags=np.array(flags, np.int32),
        cutoffs=np.array([each.alpha_cutoff if each.alpha_mode == "mask" else INVISIBLE for each in materials], float),
        base=np.ascontiguousarray(base, np.float64),
        emissive=np.clip([material.emissive for material in materials], 0, MAX_EMISSION).astype(float),
        metallic=np.clip([material.metallic for material in materials], 0, 1).astype(float),
        roughness=np.clip([material.roughness for material in materials], 0, 1).astype(float),
        slots=slots,
        roles=np.any(slots >= 0, axis=0, keepdims=True)[0],
        textures=np.array(textures.rows, np.int32).reshape(-1, 5),
        scales=np.array(textures.scales, float),
        uv=textures.coordinates(),
        colours=colours,
        texels=texels,
    )
    return look, tuple(textures.notes), MovingTexels(texels, textures.moving, textures.side)


def see_through(look: Look) -> tuple[Int32, Int32]:
    """Which triangles are opaque or cut out, and which are see-through."""
    if not len(look.of_triangles):
        raise ValueError("no materials")
    is_blended = look.flags[look.of_triangles] & BLENDED != 0
    return np.flatnonzero(~is_blended).astype(np.int32), np.flatnonzero(is_blended).astype(np.int32)


def _without_holes(number: int, material: Material, textures: _Textures, colours: Float32) -> list[tuple[int, Int64]]:
    """Triangles of a cut-out or see-through material that need no test, by the flags that they keep."""
    chosen = textures.triangles_of(number)
    factor = min(max(material.base_color[3], 0.0), 1.0) * (float(colours[chosen, :, 3].min()) if len(colours) else 1.0)
    if material.alpha_mode == "mask":
        return [(0, chosen[textures.reach(material, chosen, material.alpha_cutoff, factor)])]
    opaque = textures.reach(material, chosen, OPAQUE, factor)
    visible = textures.reach(material, chosen, INVISIBLE, factor) & ~opaque
    return [(0, chosen[opaque]), (BLENDED, chosen[visible])]


class _Textures:
    """The textures of all materials: rows of tables that grow material by material."""

    def __init__(self, asset: Asset, of_triangles: Int32) -> None:
        self._asset, self._count = asset, len(of_triangles)
        self.side = largest_side(asset.images)
        self._images: dict[tuple[int, bool], int | None] = {}
        self._decoded: dict[int, Array | None] = {}
        self._uv: list[Float32] = []
        self._corners: dict[str, Float32] = {}
        self._order = np.argsort(of_triangles, kind="stable")
        self._ends = np.cumsum(np.bincount(of_triangles, minlength=len(asset.materials) + 1))
        self.rows: list[tuple[int, int, int, int, int]] = []
        self.scales: list[float] = []
        self.pixels: list[Array] = []
        self.is_srgb: list[bool] = []
        self.moving: dict[int, tuple[Pictures, bool]] = {}
        self.notes: list[str] = []

    def add(self, number: int, material: Material) -> list[int]:
        """Return the row of each role's texture of a material, -1 for none."""
        sets: dict[tuple[Any, ...], int] = {}  # coordinates that this material's textures share
        result = []
        for role in ROLES:
            texture = self._placed(material, role)
            image = None if texture is None else self._image(texture.image, role in SRGB_ROLES)
            if texture is None or image is None:
                result.append(-1)
                continue
            key = (texture.uv, texture.offset, texture.rotation, texture.tiling)
            if key not in sets:
                sets[key] = len(sets)
                self._place(sets[key], texture, number)
            u, v = (WRAPS.index(wrap) for wrap in texture.wrap)
            result.append(len(self.rows))
            # kernels number repeat 0, mirror 1, clamp 2, as WRAPS does
            self.rows.append((image, sets[key], u, v, int(texture.filter == "nearest")))
            self.scales.append(float(np.clip(texture.scale, -1e3, 1e3)))
        return result

    def _placed(self, material: Material, role: str) -> Texture | None:
        """The texture of a role; None for one whose coordinates are missing."""
        texture = material.textures.get(role)
        if texture is None:
            return None
        held = self._asset.attributes.get(texture.uv)
        if held is not None and held.domain in ("vertex", "corner") and held.shape[1] >= 2:
            return texture
        note = f"attribute {texture.uv!r} has no texture coordinates of vertices or corners; its textures are not drawn"
        if note not in self.notes:
            self.notes.append(note)
        return None

    def triangles_of(self, number: int) -> Int64:
        """The triangles that had this material at first, in order."""
        end = int(self._ends[number])
        return np.asarray(self._order[int(self._ends[number - 1]) if number else 0 : end])

    def reach(self, material: Material, triangles: Int64, limit: float, factor: float) -> Bool:
        """Which triangles of a material have an alpha of ``limit`` or more all over, given the factor of their texture's."""
        texture = material.base_color_texture
        pixels = None if texture is None else self._decoded.get(texture.image)
        if pixels is None or limit > factor:
            return np.full(len(triangles), factor >= limit)
        return reach_alpha(pixels[:, :, 3], self._uv[0][triangles], limit / factor if factor > 0 else 0.0)

    def coordinates(self) -> Float32:
        """``(S, T, 3, 2)``."""
        return np.stack(self._uv) if self._uv else NO_LOOK.uv

    def _image(self, number: int, is_srgb: bool) -> int | None:
        """The packed image, None for one that Pillow cannot open."""
        key = (number, is_srgb)
        if key not in self._images:
            if number not in self._decoded:
                self._decoded[number] = self._decode(number)
            pixels = self._decoded[number]
            self._images[key] = None if pixels is None else len(self.pixels)
            if pixels is not None:
                self.pixels.append(pixels)
                self.is_srgb.append(is_srgb)
                pictures = self._asset.images[number].pictures
                if pictures is not None:
                    self.moving[len(self.pixels) - 1] = pictures, is_srgb
        return self._images[key]

    def _decode(self, number: int) -> Array | None:
        image = self._asset.images[number]
        decoded = decode_image(image, self.side)
        if isinstance(decoded, str):
            self.notes.append(f"image {image.name!r} {decoded}; its materials are drawn without it")
            return None
        return decoded

    def _place(self, row: int, texture: Texture, material: int) -> None:
        """Fill a row of coordinates for the triangles of a material, from the upper left, transformed."""
        if texture.uv not in self._corners:
            self._corners[texture.uv] = _corners(self._asset, texture.uv)
        if row == len(self._uv):
            self._uv.append(np.zeros((self._count, 3, 2), np.float32))
        chosen = self.triangles_of(material)
        moved = from_upper_left(texture, self._corners[texture.uv][chosen])
        self._uv[row][chosen] = np.clip(np.nan_to_num(moved), -FARTHEST_UV, FARTHEST_UV)


def _flags(material: Material) -> int:
    flags = 0 if material.double_sided else CULLED
    flags |= UNLIT if material.unlit else 0
    if material.alpha_mode == "blend":
        flags |= BLENDED
    return flags | (TESTED if material.alpha_mode != "opaque" else 0)


def _corners(asset: Asset, name: str) -> Float32:
    """``(T, 3, C)`` values of an attribute of vertices or corners, at corners."""
    attribute: Attribute = asset.attributes[name]
    if attribute.domain == "vertex":
        return np.asarray(np.asarray(attribute)[asset.faces], np.float32)
    return np.asarray(attribute, np.float32).reshape(len(asset.faces), 3, -1)


def _corner_colours(asset: Asset) -> Float32:
    """``(T, 3, 4)`` linear RGBA of corners from attribute ``color``; T = 0 without one."""
    attribute = asset.attributes.get("color")
    if attribute is None or attribute.kind != "color" or attribute.domain == "part":
        return NO_LOOK.colours
    rows: Float64 = np.asarray(attribute, np.float64)
    if attribute.dtype.kind in "iu":
        rows = rows / float(np.iinfo(attribute.dtype).max)
        if not asset.materials:  # integers beside materials are linear, as in glTF; alone they are sRGB, as in PLY
            rows[:, :3] = to_linear(rows[:, :3])
    rgba = np.ones((len(rows), 4), np.float32)
    rgba[:, : rows.shape[1]] = np.clip(rows, 0, 1)
    if attribute.domain == "vertex":
        return rgba[asset.faces]
    return rgba.reshape(-1, 3, 4) if attribute.domain == "corner" else np.repeat(rgba[:, None], 3, axis=1)
