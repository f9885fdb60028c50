"""Attributes under glTF's names and in the number types that glTF has; `geometry` reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Array
from gvpipe.io.gltf.glb import Filtered

EXACT = 1 << 24  # integers up to here are exact as float32


@dataclass(frozen=True, eq=False)
class GltfAttribute:
    """An attribute as a file holds it.

    Args:
        name: such as ``"TEXCOORD_0"``.
        values: ``(W, C)``.
        normalized: whether its integers stand for fractions.
        filtered: what a packed file holds in place of the values.
    """

    name: str
    values: Array
    normalized: bool = False
    filtered: Filtered | None = None

    def part(self, start: int, stop: int) -> GltfAttribute:
        """Its rows ``start`` to ``stop``."""
        filtered = self.filtered and Filtered(self.filtered.elements[start:stop], self.filtered.name)
        return replace(self, values=self.values[start:stop], filtered=filtered)


def name_attributes(attributes: Mapping[str, Attribute]) -> dict[str, str]:
    """glTF's name of each attribute that it can hold; sets are numbered without gaps, by their names here.

    Examples:
        >>> import numpy as np
        >>> uv = Attribute(np.zeros((1, 2)), "vertex", "uv")
        >>> name_attributes({"uv1": uv, "uv": uv, "heat": Attribute([0.5], "vertex", "scalar")})
        {'uv': 'TEXCOORD_0', 'uv1': 'TEXCOORD_1', 'heat': '_heat'}
    """
    held = {name: one for name, one in attributes.items() if one.domain in ("vertex", "corner") and one.shape[1] <= 4}
    result: dict[str, str] = {}
    for kind, base in (("uv", "TEXCOORD"), ("color", "COLOR")):
        sets = sorted((name for name, one in held.items() if one.kind == kind), key=lambda name: (len(name), name))
        result |= {name: f"{base}_{i}" for i, name in enumerate(sets)}
    for name, one in held.items():
        if one.kind == "normal" and name == "normal":
            result[name] = "NORMAL"
        elif one.kind == "tangent" and name == "tangent" and "normal" in held:
            result[name] = "TANGENT"
        elif one.kind not in ("uv", "color", "tangent") and one.values.dtype.itemsize <= 4:
            result[name] = f"_{name}"
    return result


def as_gltf(name: str, kind: str, values: Array) -> GltfAttribute | None:
    """An attribute's rows in a type that glTF allows; None if there is none that holds them.

    Args:
        name: glTF's.
        kind: as of `Attribute`.
        values: ``(W, C)``.
    """
    if kind == "uv":
        return GltfAttribute(name, np.stack([values[:, 0], 1 - values[:, 1]], axis=1).astype(np.float32))
    if name == "NORMAL":
        return GltfAttribute(name, _unit(values))
    if name == "TANGENT":
        return GltfAttribute(name, _with_side(values))
    if kind == "color":
        if values.dtype.kind == "f":
            return GltfAttribute(name, np.clip(values, 0, 1).astype(np.float32))
        if values.dtype not in (np.uint8, np.uint16):
            return None
        opaque = np.full((len(values), 4), np.iinfo(values.dtype).max, values.dtype)
        opaque[:, : values.shape[1]] = values
        return GltfAttribute(name, opaque, normalized=True)
    if values.dtype.kind == "f" or values.dtype.itemsize <= 2:
        return GltfAttribute(name, values)
    # glTF allows no attribute of 32-bit integers
    if values.min(initial=0) >= 0 and values.max(initial=0) < 65536:
        return GltfAttribute(name, values.astype(np.uint16))
    return GltfAttribute(name, values.astype(np.float32)) if np.abs(values.astype(np.int64)).max(initial=0) <= EXACT else None


def _unit(values: Array) -> Array:
    """Vectors of length 1, as viewers need them; tangents get their side, which is 1 or -1."""
    vectors = values[:, :3].astype(np.float32)
    length = np.linalg.norm(vectors, axis=1)
    vectors[length == 0] = (0, 0, 1)
    off = (length > 0) & (np.abs(length - 1) > 1e-6)  # what has length 1 stays as it is, to the bit
    vectors[off] /= length[off, None]
    return vectors


def _with_side(values: Array) -> Array:
    """Tangents ``(W, 4)`` of length 1 and their side, 1 or -1."""
    sides = np.where(values[:, 3:4] < 0, -1, 1) if values.shape[1] == 4 else np.ones((len(values), 1))
    return np.concatenate([_unit(values), sides.astype(np.float32)], axis=1)
