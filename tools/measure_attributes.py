"""Bytes of static attributes beside Draco's, for glTF and OBJ files.

Draco's bytes are those of its file with the attribute less those without, at compression level 10. Both code the same mesh:
vertices of one position are one, corners have values. Steps are Draco's of 12 bits for texture coordinates, range / (2^12 - 1),
and of 8 bits for normals, the octahedral lattice of 2^8 - 1 points a side. Colours are exact.
"""

from __future__ import annotations

import argparse
import json
import struct
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gvpipe.attributes import storage
from gvpipe.attributes.attribute_coding import encode_stored, encode_welded
from gvpipe.attributes.corner_sharing import encode_sharing, entries_of
from gvpipe.attributes.entry_layout import EntryLayout, may_weld
from gvpipe.attributes.surface import Surface
from gvpipe.mesh.topology import weld

Array = NDArray[Any]
BITS_UV, BITS_NORMAL, BITS_POSITION = 12, 8, 14
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Mesh(NamedTuple):
    """Positions ``(V, 3)``, triangles ``(T, 3)``, attributes by vertex ``(V, C)`` by kind."""

    name: str
    positions: Array
    faces: Array
    attributes: dict[str, Array]


def read_gltf(path: Path) -> Iterator[Mesh]:
    """The triangle meshes of a glTF file with the attributes that are measured."""
    data = path.read_bytes()
    if path.suffix == ".glb":
        length = struct.unpack_from("<I", data, 12)[0]
        document, buffers = json.loads(data[20 : 20 + length]), [data[28 + length :]]
    else:
        document = json.loads(data)
        uris = [buffer["uri"] for buffer in document["buffers"]]
        buffers = [b64decode(uri.split(",")[1]) if "," in uri else (path.parent / uri).read_bytes() for uri in uris]

    def accessor(number: int) -> Array:
        view = document["bufferViews"][document["accessors"][number]["bufferView"]]
        own = document["accessors"][number]
        dtype, width = np.dtype(TYPES[own["componentType"]]), WIDTHS[own["type"]]
        begin = view.get("byteOffset", 0) + own.get("byteOffset", 0)
        stride = view.get("byteStride", width * dtype.itemsize)
        binary = buffers[view.get("buffer", 0)]
        rows = np.ndarray((own["count"], width), dtype, binary, begin, (stride, dtype.itemsize)).copy()
        return rows.astype(np.float32) / np.iinfo(dtype).max if own.get("normalized") and dtype.itemsize > 1 else rows

    for mesh in document["meshes"]:
        for number, primitive in enumerate(mesh["primitives"]):
            if primitive.get("mode", 4) != 4 or "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
                continue
            found = primitive["attributes"]
            positions = accessor(found["POSITION"])
            faces = accessor(primitive["indices"]) if "indices" in primitive else np.arange(len(positions))
            names = {"uv": "TEXCOORD_0", "normal": "NORMAL", "color": "COLOR_0", "tangent": "TANGENT"}
            attributes = {kind: accessor(found[name]) for kind, name in names.items() if name in found}
            yield Mesh(
                f"{path.stem} {mesh.get('name', '')} {number}", positions, faces.reshape(-1, 3).astype(np.int64), attributes
            )


def read_obj(path: Path) -> Iterator[Mesh]:
    """An OBJ file's triangles, one vertex for each distinct triple of indices."""
    values: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    corners = []
    for line in path.read_text().splitlines():
        head, *fields = line.split() or [""]
        if head in values:
            values[head].append([float(x) for x in fields])
        elif head == "f":
            fan = [tuple(int(x) - 1 if x else 0 for x in [*field.split("/"), "", ""][:3]) for field in fields]
            corners += [triple for i in range(1, len(fan) - 1) for triple in (fan[0], fan[i], fan[i + 1])]
    triples, faces = np.unique(np.array(corners), axis=0, return_inverse=True)
    found = {kind: np.array(values[key], np.float32) for kind, key in (("uv", "vt"), ("normal", "vn")) if values[key]}
    attributes = {kind: found[kind][triples[:, 1 if kind == "uv" else 2]] for kind in found}
    yield Mesh(path.stem, np.array(values["v"], np.float32)[triples[:, 0]][:, :3], faces.reshape(-1, 3), attributes)


def draco_bytes(mesh: Mesh, kind: str) -> int:
    """Bytes of Draco's file with an attribute less those without."""
    import DracoPy

    options: dict[str, Any] = {"quantization_bits": BITS_POSITION, "compression_level": 10}
    points, faces = mesh.positions.astype(np.float32), mesh.faces.astype(np.uint32)
    values = mesh.attributes[kind].astype(np.uint8 if kind == "color" else np.float64)
    every: dict[str, dict[str, Any]] = {
        "uv": {"tex_coord": values, "tex_coord_quantization_bits": BITS_UV},
        "normal": {"normals": values, "normal_quantization_bits": BITS_NORMAL},
        "color": {"colors": values},
    }
    return len(DracoPy.encode(points, faces, **options, **every[kind])) - len(DracoPy.encode(points, faces, **options))


def store(values: Array, kind: str) -> tuple[storage.Storage, Array]:
    """Values with Draco's step."""
    if kind == "uv":
        step = max(float(np.ptp(values, axis=0).max()), 1e-6) / ((1 << BITS_UV) - 1)
        return storage.Storage(storage.STEPS, values.dtype, 2, step=step), np.rint(values / step).astype(np.int64)
    if kind == "normal":
        return storage.store_directions(values, 0.0, (1 << (BITS_NORMAL - 1)) - 1)
    return storage.store_integers(values)


def own_bytes(mesh: Mesh, kind: str) -> tuple[int, int, int]:
    """Bytes of the partition of corners and of the values, by corner; and of the values by vertex, as the file has them."""
    low, extent = mesh.positions.min(axis=0), float(np.ptp(mesh.positions, axis=0).max())
    lattice = np.rint((mesh.positions - low) / extent * ((1 << BITS_POSITION) - 1))
    points = (lattice * (extent / ((1 << BITS_POSITION) - 1)) + low).astype(np.float32)
    first, welded = weld(mesh.positions)
    values, rows = np.unique(mesh.attributes[kind], axis=0, return_inverse=True)
    surface = Surface(welded[mesh.faces].astype(np.int32), len(first), points[first])
    entries = entries_of(rows.ravel()[mesh.faces.ravel()], surface)
    own = np.empty((int(entries.max()) + 1, values.shape[1]), values.dtype)
    own[entries] = values[rows.ravel()[mesh.faces.ravel()]]
    sharing = len(encode_sharing(entries, surface))
    by_corner = len(encode_stored(*store(own, kind), EntryLayout("corner", surface, entries)))
    split = Surface(mesh.faces.astype(np.int32), len(points), points)
    stored = store(mesh.attributes[kind], kind)
    by_vertex = len(encode_stored(*stored, EntryLayout("vertex", split)))
    if may_weld(split):
        by_vertex = min(by_vertex, len(encode_welded(*stored, split)))
    return sharing, by_corner - sharing, by_vertex


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, help=".glb, .gltf or .obj files")
    parser.add_argument("--least", type=int, default=200, help="meshes with fewer triangles are left out (200)")
    arguments = parser.parse_args()
    print("| mesh | triangles | attribute | Draco | here | sharing | values | by vertex |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    total = np.zeros(2, np.int64)
    for path in arguments.files:
        for mesh in (read_obj if path.suffix == ".obj" else read_gltf)(path):
            if len(mesh.faces) < arguments.least:
                continue
            for kind in mesh.attributes:
                if kind == "tangent" or (kind == "color" and mesh.attributes[kind].dtype != np.uint8):
                    continue  # Draco has neither
                sharing, values, by_vertex = own_bytes(mesh, kind)
                theirs = draco_bytes(mesh, kind)
                total += [theirs, sharing + values]
                row = (mesh.name, len(mesh.faces), kind, theirs, sharing + values, sharing, values, by_vertex)
                print("| " + " | ".join(map(str, row)) + " |")
    print(f"all: {total[0]} and {total[1]} bytes")


if __name__ == "__main__":
    main()
