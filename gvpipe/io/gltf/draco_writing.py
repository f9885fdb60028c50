"""Primitives in Draco's compression (KHR_draco_mesh_compression), encoded by DracoPy.

=======================  =====================================================================  ==================
attribute                as                                                                     off by
=======================  =====================================================================  ==================
positions                one lattice for the whole file, as fine as the file's error asks for   `Fineness`
normals                  10 bits of octahedral coordinates                                      a quarter degree
texture coordinates      16 bits, in 0..1; others as float32                                    1 / 131,070
others                   what they are; integers with a sign as float32                         nothing
=======================  =====================================================================  ==================

Edgebreaker gives vertices another order. Morph targets are not compressed and have the mesh's order. So meshes that have some
are coded in order (Draco's sequential method), which takes more bytes.

Source: Khronos, KHR_draco_mesh_compression; the bytes are those of Google's Draco library.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Int32
from gvpipe.io.gltf.attribute_writing import GltfAttribute
from gvpipe.io.gltf.glb import Glb
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.quantizing import quantized

DRACO = "KHR_draco_mesh_compression"
MORPHED = "Draco compresses meshes, not morph targets; these are as large as without it, and meshopt compresses them, too"
NOT_HELD = "Draco holds no mesh of this file as finely as its error asks for: none is compressed; meshopt compresses them"
LEVEL = 7  # of Draco's ten; ten gains half a percent, and is slower to decode
NORMAL_BITS = 10
MOST_BITS = 22  # of positions: Draco's time and memory grow with their range
POSITION, NORMAL = 0, 1  # Draco's types of attributes


class Fineness(NamedTuple):
    """The lattice of a file's positions: its least corner ``(3,)``, its side in model units, and bits of each coordinate."""

    origin: Float32
    side: float
    bits: int


def fineness(positions: Float32, step: float) -> Fineness | None:
    """A lattice over ``positions (W, 3)`` on which none moves by more than a step; None where Draco has none so fine."""
    low = positions.min(axis=0)
    side = float(np.ptp(positions.astype(np.float64), axis=0).max())
    if not (side > 0 and step > 0):
        return None
    bits = math.ceil(math.log2(side * math.sqrt(3) / (2 * step) + 1))
    return Fineness(low, side, max(bits, 1)) if bits <= MOST_BITS else None


def draco_notes(glb: Glb) -> tuple[str, ...]:
    """What a file of Draco has that is not compressed."""
    if DRACO not in glb.tree.get("extensionsUsed", []):
        return (NOT_HELD,)
    is_morphed = any("targets" in primitive for mesh in glb.tree["meshes"] for primitive in mesh["primitives"])
    return (MORPHED,) if is_morphed else ()


def add_primitive(
    glb: Glb,
    positions: Float32,
    attributes: tuple[GltfAttribute, ...],
    faces: Int32,
    fine: Fineness,
    in_order: bool,
) -> Json | None:
    """Add the triangles ``(T, 3)`` of a mesh in compressed form, and return the primitive; None where Draco does not hold them.

    Args:
        glb: the file.
        positions: ``(W, 3)`` of the mesh.
        attributes: of its vertices.
        faces: counted from the first of them.
        fine: the lattice of positions.
        in_order: all vertices of the mesh are kept, in their order; else those alone that the triangles have.
    """
    used, corners = np.arange(len(positions)), faces.reshape(-1)
    if not in_order:
        used, corners = np.unique(corners, return_inverse=True)
    given = positions[used]
    forms = {one.name: _form(one, used) for one in attributes}
    generic = {name: number for number, name in enumerate(name for name in forms if name != "NORMAL")}
    data = _encode(given, corners.reshape(-1, 3), forms, generic, fine, in_order)
    decoded = _decoded(data) if data else {}
    if not decoded or (in_order and not _is_in_order(decoded, given, corners, fine)):
        return None
    ids = {**generic, "POSITION": decoded[POSITION][0]}
    shown = decoded[POSITION][1]
    accessors = {"POSITION": glb.outside(shown, bounds=True)}
    if "NORMAL" in forms:
        ids["NORMAL"] = decoded[NORMAL][0]
    for name, form in forms.items():
        rows = np.broadcast_to(form.values[:1], (len(shown), form.values.shape[1]))
        accessors[name] = glb.outside(rows, normalized=form.normalized)
    n_corners = 3 * len(decoded["faces"][1])
    glb.use(DRACO, is_required=True)
    packed = {"bufferView": glb.view(data), "attributes": {name: ids[name] for name in accessors}}
    largest = np.uint16 if len(shown) < 65536 else np.uint32
    return {
        "attributes": accessors,
        "indices": glb.outside(np.broadcast_to(np.zeros((1, 1), largest), (n_corners, 1))),
        "extensions": {DRACO: packed},
    }


def _form(one: GltfAttribute, rows: Array) -> GltfAttribute:
    """An attribute's rows in a type that Draco is given."""
    own = GltfAttribute(one.name, one.values[rows], one.normalized)
    if one.name.startswith("TEXCOORD"):
        own = quantized(own)
    if own.values.dtype in (np.uint8, np.uint16, np.float32):
        return own
    return GltfAttribute(one.name, own.values.astype(np.float32))


def _encode(
    positions: Float32, faces: Array, forms: dict[str, GltfAttribute], generic: dict[str, int], fine: Fineness, in_order: bool
) -> bytes:
    """Draco's bytes; none where all triangles are lines or points, or Draco refuses them."""
    import DracoPy

    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    if not kept.any():
        return b""
    more: dict[str, Any] = {}
    if "NORMAL" in forms:
        more = {"normals": forms["NORMAL"].values.astype(np.float64), "normal_quantization_bits": NORMAL_BITS}
    if generic:
        more["generic_attributes"] = {number: np.ascontiguousarray(forms[name].values) for name, number in generic.items()}
    try:
        return bytes(
            DracoPy.encode(
                np.ascontiguousarray(positions),
                np.ascontiguousarray(faces, np.uint32),
                quantization_bits=fine.bits,
                quantization_range=fine.side,
                quantization_origin=fine.origin,
                compression_level=LEVEL,
                preserve_order=in_order,
                **more,
            )
        )
    except Exception:  # DracoPy's own and bare ones; each means: not this way
        return b""


def _decoded(data: bytes) -> dict[Any, tuple[int, Array]]:
    """The number and the values of each attribute by its type, and the triangles as ``"faces"``; nothing if none come back."""
    import DracoPy

    try:
        found = DracoPy.decode(data)
    except Exception:  # as above
        return {}
    faces = np.asarray(found.faces).reshape(-1, 3)
    own = {int(one["attribute_type"]): (int(one["unique_id"]), np.asarray(one["data"])) for one in found.attributes}
    return own | {"faces": (0, faces)} if len(faces) else {}


def _is_in_order(decoded: dict[Any, tuple[int, Array]], positions: Float32, corners: Array, fine: Fineness) -> bool:
    """Whether vertices and triangles came back where they were."""
    (_, found), (_, faces) = decoded[POSITION], decoded["faces"]
    if found.shape != positions.shape or not np.array_equal(faces.reshape(-1), corners):
        return False
    return bool(np.abs(found - positions).max() <= fine.side / ((1 << fine.bits) - 1))
