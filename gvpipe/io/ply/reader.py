"""PLY frames, read: text or binary, from the file's own columns (`gvpipe.io.ply.elements`). Vertex order is the file's.

| property | becomes |
| --- | --- |
| ``x y z`` of a vertex | positions |
| ``nx ny nz``; ``red green blue [alpha]`` of a vertex | ``normal``; ``color``: fields where they change from frame to frame |
| ``s t``, ``u v`` or ``texture_u texture_v`` of a vertex, ``texcoord`` of a face | ``uv`` of the first frame |
| ``red green blue [alpha]`` of a face | ``color`` per triangle |
| any other number of a vertex or a face | an attribute, or a field, of its name; ``a_0 a_1 a_2`` are one vector ``a`` |
| strips of triangles (element ``tristrips``), where there are no faces | faces |
| ``comment TextureFile picture.png`` | a material that shows the picture |
| other comments, ``obj_info`` | texts of the metadata |

A face's number is that of all triangles that the face is cut into.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.attribute import MAX_COMPONENTS, Attribute
from gvpipe.asset.material import Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.mesh import FrameValues, Mesh, as_color, as_faces, as_normals, as_polygons, fan, indexed
from gvpipe.io.pictures import Pictures
from gvpipe.io.ply.elements import Columns, Lists, read_comments, read_elements
from gvpipe.io.sharing import shared_by_vertex

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
NORMAL_NAMES = ("nx", "ny", "nz")
INDEX_NAMES = ("vertex_indices", "vertex_index")
COLOR_NAMES = ("red", "green", "blue", "alpha")
TEXTURE_FILE = "TextureFile"
LONGEST_TEXT = 1000  # characters of comments
COMPONENT = re.compile(r"(.+)_(\d+)")

Animated = dict[str, Callable[[], FrameValues]]


class PlyLoader:
    """Loads the frames of one sequence; after the first, without what is static."""

    def __init__(self) -> None:
        self._is_first = True

    def __call__(self, path: Path) -> Mesh:
        """Load one file.

        Raises:
            OSError, ValueError: the file cannot be read; the caller names it.
        """
        data = path.read_bytes()
        elements = read_elements(data)
        if not elements.get("vertex"):
            raise ValueError("it has no element 'vertex'")
        vertex, face, taken = elements["vertex"], elements.get("face", {}), {"vertex", "face"}
        if not face and elements.get("tristrips"):
            face, taken = _from_strips(elements["tristrips"]), {"vertex", "tristrips"}
        if not face:
            raise ValueError("it has no element 'face': points alone are no mesh")
        positions = _stack(vertex, tuple("xyz"))
        if positions is None:
            raise ValueError("its vertices lack x, y or z")
        list_name, polygons = _polygons(face)
        triangles = fan(polygons.lengths)
        faces = as_faces(polygons.values[triangles], len(positions))
        animated = _animated(vertex, face, polygons.lengths)
        if not self._is_first:
            return Mesh(positions, faces, animated=animated)
        self._is_first = False
        pictures = Pictures(path.parent)
        material = _material(read_comments(data), pictures)
        lists = [name for name, one in (*vertex.items(), *face.items()) if isinstance(one, Lists)]
        uv, unread = _uv(vertex, face, polygons.lengths, faces, len(positions))
        lost = [f"list {name!r}" for name in lists if name not in (list_name, "texcoord")]
        return Mesh(
            positions,
            faces,
            uv,
            tuple(pictures.notes),
            as_polygons(polygons.lengths),
            (Part("", (0, len(positions)), (0, len(faces)), 0),) if material else (),
            material,
            tuple(pictures.images),
            animated=animated,
            metadata=Metadata(texts=_texts(data)),
            not_carried=(*_left_behind(elements, taken), *lost, *unread),
        )


def _from_strips(strips: Columns) -> Columns:
    """Triangle strips as faces: -1 ends a strip, and every second triangle is turned round."""
    corners = _polygons(strips)[1]
    values, lengths = corners.values.astype(np.int64), corners.lengths
    ends = np.zeros(len(values), bool)
    ends[np.cumsum(lengths)[lengths > 0] - 1] = True  # a list ends its last strip, too
    is_break = values < 0
    # a triangle begins where neither it nor the two after it are a break, or lie in another list
    n = max(0, len(values) - 2)
    whole = ~(is_break[:n] | is_break[1 : n + 1] | is_break[2 : n + 2] | ends[:n] | ends[1 : n + 1])
    at = np.flatnonzero(whole)
    starts = np.concatenate([[0], np.flatnonzero(is_break | ends) + 1])
    odd = (at - starts[np.searchsorted(starts, at, side="right") - 1]) % 2
    triangles = np.stack([values[at], values[at + 1 + odd], values[at + 2 - odd]], axis=1)
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)  # strips are joined by triangles without area
    kept = triangles[distinct]
    return {INDEX_NAMES[0]: Lists(kept.reshape(-1), np.full(len(kept), 3, np.int64))}


def _left_behind(elements: dict[str, Columns], taken: set[str]) -> tuple[str, ...]:
    """Elements that are not read."""
    left = LeftBehind()
    for name, columns in elements.items():
        if name not in taken:
            column = next(iter(columns.values()), np.zeros(0))
            left.add(f"element {name!r}", len(column.lengths if isinstance(column, Lists) else column))
    return left.names


def _texts(data: bytes) -> dict[str, str]:
    """What the header says in words, the name of the picture aside."""
    lines = {keyword: read_comments(data, keyword) for keyword in ("comment", "obj_info")}
    kept = {keyword: [line for line in found if line and not line.startswith(TEXTURE_FILE)] for keyword, found in lines.items()}
    return {keyword: "; ".join(found)[:LONGEST_TEXT] for keyword, found in kept.items() if found}


def _polygons(face: Columns) -> tuple[str, Lists]:
    """The vertex indices of each face: the list with a usual name, or the only list that there is."""
    lists = {name: column for name, column in face.items() if isinstance(column, Lists)}
    usual = [name for name in INDEX_NAMES if name in lists]
    if not usual and len(lists) != 1:
        raise ValueError(f"its faces have no list {' or '.join(INDEX_NAMES)}")
    name = usual[0] if usual else next(iter(lists))
    return name, lists[name]


def _uv(vertex: Columns, face: Columns, counts: Int64, faces: Int32, n_vertices: int) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Texture coordinates: a list (u, v, u, v ...) of each face, or of the vertices; and what is said of other sets.

    A face whose list is empty has zeros.
    """
    pairs = {", ".join(pair): uv for pair in UV_NAMES if (uv := _stack(vertex, pair)) is not None}
    corners = face.get("texcoord")
    if isinstance(corners, Lists) and len(corners.values) and np.isin(corners.lengths, (0, *np.unique(2 * counts))).all():
        has_some = corners.lengths > 0
        if np.array_equal(corners.lengths[has_some], 2 * counts[has_some]):
            given = np.zeros((counts.sum(), 2), np.float32)
            given[np.repeat(has_some, counts)] = corners.values.reshape(-1, 2)
            values, indices = shared_by_vertex(given[fan(counts).reshape(-1)], faces)
            return {"uv": indexed(values, indices.astype(np.int64), faces, n_vertices, "uv")}, tuple(pairs)
    lost = ("list 'texcoord'",) if isinstance(corners, Lists) and len(corners.values) else ()
    first = next(iter(pairs), "")
    made = {"uv": Attribute(pairs[first], "vertex", "uv", name="uv")} if first else {}
    return made, (*lost, *(name for name in pairs if name != first))


def _animated(vertex: Columns, face: Columns, counts: Int64) -> Animated:
    """Everything else: normals, colours, and numbers of other names, of vertices and faces."""
    animated: Animated = {}
    for columns, domain, reserved in ((vertex, "vertex", ("x", "y", "z")), (face, "triangle", ())):
        numbers = {name: one for name, one in columns.items() if isinstance(one, np.ndarray) and name not in reserved}
        repeats = counts - 2 if domain == "triangle" and (counts > 3).any() else None
        for pair in UV_NAMES if domain == "vertex" else ():
            if all(name in numbers for name in pair):
                numbers = {name: one for name, one in numbers.items() if name not in pair}
        groups: dict[str, Sequence[str]] = {}
        if domain == "vertex" and all(name in numbers for name in NORMAL_NAMES):
            groups["normal"] = NORMAL_NAMES
        for width in (4, 3):
            if all(name in numbers for name in COLOR_NAMES[:width]):
                groups.setdefault("color", COLOR_NAMES[:width])
        groups |= _vectors([name for name in numbers if not any(name in names for names in groups.values())])
        for name, names in groups.items():
            key = f"face_{name}" if name in animated else name
            animated[key] = partial(_values, [numbers[one] for one in names], name, domain, repeats)
    return animated


def _vectors(names: list[str]) -> dict[str, Sequence[str]]:
    """Names of single numbers by themselves, and ``a_0``, ``a_1``, ... as one vector."""
    groups: dict[str, list[str]] = {}
    for name in names:
        found = COMPONENT.fullmatch(name)
        head = found[1] if found else ""
        members = groups.get(head, [])
        if found and found[2] == str(len(members)) and head not in names and len(members) < MAX_COMPONENTS:
            groups.setdefault(head, []).append(name)
        else:
            groups[name] = [name]
    lone = {head: members for head, members in groups.items() if len(members) == 1}
    return {(members[0] if head in lone else head): members for head, members in groups.items()}


def _values(columns: list[Array], name: str, domain: str, repeats: Int64 | None) -> FrameValues:
    """The numbers of one attribute or field."""
    kind = name if name in ("normal", "color") and len(columns) >= 3 else ""
    values = columns[0] if len(columns) == 1 else np.stack(columns, axis=1)
    if kind == "color":
        values = _color(values)
    if kind == "normal":
        values = as_normals(values)
    return FrameValues(values if repeats is None else np.repeat(values, repeats, axis=0), domain, kind)


def _color(values: Array) -> Array:
    """Colours in their own type, with alpha; floats above 1 are meant as 0..255."""
    if values.dtype.kind not in "fu" or values.dtype.itemsize > 4 or values.dtype == np.uint32:
        return as_color(values)
    if values.dtype == np.uint8 or (values.dtype.kind == "f" and (values > 1).any()):
        return as_color(values)
    full = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1
    rgba = np.full((len(values), 4), full, np.float32 if values.dtype.kind == "f" else np.uint16)
    rgba[:, : values.shape[1]] = values
    return rgba


def _material(comments: list[str], pictures: Pictures) -> tuple[Material, ...]:
    """A material that shows the picture of a ``TextureFile`` comment."""
    named = [comment.removeprefix(TEXTURE_FILE).strip() for comment in comments if comment.startswith(TEXTURE_FILE)]
    if len(named) > 1:
        pictures.notes.append(f"{len(named)} texture files are named, and the faces of each are not known; left out")
    number = pictures.find(named[0], TEXTURE_FILE) if len(named) == 1 else None
    return () if number is None else (Material(base_color_texture=Texture(number)),)


def _stack(columns: Columns, names: Sequence[str]) -> Array | None:
    """Number properties side by side, ``(N, len(names))``; None unless all are there."""
    found = [columns.get(name) for name in names]
    numbers = [column for column in found if isinstance(column, np.ndarray)]
    return np.stack(numbers, axis=1) if len(numbers) == len(names) else None
