"""STL frames, welded: STL stores three corners per triangle and no vertices.

Corners at exactly equal positions in the first frame become one vertex, numbered by first appearance. The same map joins the
corners of all other frames. Where corners that were one vertex part later, connectivity is not constant and the frame is
refused. Reading is trimesh's; writing is one structured array.

A binary file has a header of 80 bytes, the number of triangles, and 50 bytes for each. A file whose size fits that number is
binary, though its header may begin as text does.
"""

from __future__ import annotations

import io
import struct
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io.losses import lost_notes
from gvpipe.io.mesh import FrameEncoder, Mesh, as_faces
from gvpipe.model.origin import choose_origin, narrow
from gvpipe.model.sequence import MeshSequence, check_finite

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
HEADER_BYTES = 80
START = HEADER_BYTES + 4  # of the triangles of a binary file


class StlLoader:
    """Loads the frames of one sequence, remembering how the first was welded."""

    def __init__(self) -> None:
        self._first: Path | None = None
        self._origin: Float64 = np.zeros(3)  # corners are compared as the float32 that they become
        self._faces: Int32 = np.zeros((0, 3), np.int32)
        self._corner_of: Int64 = np.zeros(0, np.int64)  # (V,), the first corner at each vertex

    def __call__(self, path: Path) -> Mesh:
        """Load one file.

        Raises:
            TopologyChange: there are other triangles than in the first file, or corners that were one vertex there are apart.
            Exception: the file cannot be read; trimesh raises many kinds, and the caller names the file.
        """
        exact, solids, lost = _load_corners(path)
        if self._first is None:
            self._origin = choose_origin(exact[None])
        corners = narrow(exact[None], self._origin)[0]
        if self._first is None:
            self._corner_of, corner_vertices = _weld(corners)
            self._faces = as_faces(corner_vertices.reshape(-1, 3), len(self._corner_of))
            self._first = path
        if len(corners) != self._faces.size:
            found, expected = len(corners) // 3, len(self._faces)
            raise TopologyChange(f"{path.name} has {found} triangles, {self._first.name} has {expected}", 0)
        positions = corners[self._corner_of]
        apart = np.flatnonzero((positions[self._faces.reshape(-1)] != corners).any(axis=1))
        if len(apart):
            check_finite(corners[None], str(path))  # a NaN differs from itself
            corner = int(apart[0])
            raise TopologyChange(
                f"corner {corner % 3} of triangle {corner // 3} shares a vertex with another in {self._first.name} "
                f"but not in {path.name}, since STL has no vertices of its own (OBJ, PLY and GLB have)",
                0,
            )
        return Mesh(exact[self._corner_of], self._faces, parts=_make_parts(solids, self._faces), not_carried=lost)


def _load_corners(path: Path) -> tuple[Float64, list[tuple[str, int]], tuple[str, ...]]:
    """All corners, ``(3 T, 3)``, the solids' names and triangles, and what is not read; binary files have one solid."""
    import trimesh

    data = path.read_bytes()
    _check_whole(data)
    scene: Any = trimesh.load_scene(io.BytesIO(data), file_type="stl", process=False)
    solids = [np.asarray(solid.vertices, np.float64)[solid.faces.reshape(-1)] for solid in scene.geometry.values()]
    if not any(map(len, solids)):
        raise ValueError("it has no triangles")
    sizes = [(name, len(solid) // 3) for name, solid in zip(scene.geometry, solids, strict=True)]
    return np.concatenate(solids), sizes, _lost_colors(data)


def _lost_colors(data: bytes) -> tuple[str, ...]:
    """Colours of a binary file, which some programs write into its header or behind each triangle."""
    n_triangles = struct.unpack_from("<I", data, HEADER_BYTES)[0] if len(data) >= START else -1
    if len(data) != START + n_triangles * RECORD.itemsize:
        return ()
    has_colors = b"COLOR=" in data[:HEADER_BYTES] or np.frombuffer(data, RECORD, offset=START)["attribute"].any()
    return ("colours of triangles",) if has_colors else ()


def _check_whole(data: bytes) -> None:
    """Raise `ValueError` for what trimesh would refuse without a cause, or read in part."""
    n_triangles = struct.unpack_from("<I", data, HEADER_BYTES)[0] if len(data) >= START else -1
    needed = START + n_triangles * RECORD.itemsize
    if len(data) == needed:
        return
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = ""
    if not text.lstrip().lower().startswith("solid"):
        said = f"its header says {n_triangles} triangles, {needed} bytes, but " if n_triangles >= 0 else ""
        raise ValueError(f"{said}it has {len(data)} bytes, and is no text; it is another format or cut short")
    lines = [line.split()[0].lower() for line in text.splitlines() if line.strip()]
    counts = Counter(lines)
    if counts["endsolid"] < counts["solid"]:
        raise ValueError("a solid has no 'endsolid'; the file is cut short")
    if counts["vertex"] != 3 * counts["facet"]:
        raise ValueError(f"its {counts['facet']} facets have {counts['vertex']} vertices; three for each are needed")


def _make_parts(solids: list[tuple[str, int]], faces: Int32) -> tuple[Part, ...]:
    """A part for each solid of a text file, if there are several."""
    stops = np.cumsum([n_triangles for _, n_triangles in solids]).tolist()
    ranges = [(stop - n_triangles, stop) for stop, (_, n_triangles) in zip(stops, solids, strict=True)]
    if len(solids) < 2 or any(start == stop for start, stop in ranges):
        return ()
    return tuple(
        Part(name, (int(faces[start:stop].min()), int(faces[start:stop].max()) + 1), (start, stop))
        for (name, _), (start, stop) in zip(solids, ranges, strict=True)
    )


def _weld(corners: Float32) -> tuple[Int64, Int64]:
    """For ``(3 T, 3)`` corners: the first corner of each vertex ``(V,)`` and each corner's vertex ``(3 T,)``."""
    rows = np.ascontiguousarray(corners + np.float32(0))  # makes -0 and 0 the same bytes
    _, first, inverse = np.unique(rows.view("V12").reshape(-1), return_index=True, return_inverse=True)
    by_appearance = np.argsort(first)
    rank = np.empty_like(by_appearance)
    rank[by_appearance] = np.arange(len(first))
    return first[by_appearance], rank[inverse]


def encode_stl(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames; STL holds nothing but triangles.

    Raises:
        InputError: there is an origin.
    """
    faces, origin = sequence.faces, sequence.origin
    if origin.any():
        place = ", ".join(f"{x:.17g}" for x in origin)
        raise InputError(
            f"STL holds float32, too few digits for this mesh at ({place}); write .obj, .ply, .off, .glb or .npz, or "
            "positions relative to there (decode --local)"
        )
    records = np.zeros(len(faces), RECORD)
    header = b"gvpipe".ljust(HEADER_BYTES) + struct.pack("<I", len(faces))

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        corners = positions[faces]  # (T, 3, 3)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        records["normal"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        records["corners"] = corners
        return header + bytes(records.tobytes())

    return FrameEncoder(encode, notes=lost_notes(sequence, "STL", {}))
