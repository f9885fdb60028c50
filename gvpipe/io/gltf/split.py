"""The vertices that a glTF file needs: split where the corners of a vertex differ, and cut into the blocks of its parts.

glTF has attributes per vertex alone. A vertex whose corners have several values becomes several vertices. They are next to each
other, so that the order of vertices stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.mesh.drawing_order import first_uses, order_triangles
from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True, eq=False)
class Shape:
    """A mesh of the file: parts of one name that share their vertices.

    Args:
        name, parent: of the parts.
        start, stop: its vertices among the split ones.
        primitives: triangles ``(T, 3)``, counted from ``start``, and the material of each part.
    """

    name: str
    parent: str
    start: int
    stop: int
    primitives: tuple[tuple[Int32, int | None], ...]


@dataclass(frozen=True, eq=False)
class Split:
    """A sequence's vertices, split.

    Args:
        sources: ``(W,)`` the sequence's vertex of each; rising, but in the order of drawing.
        corners: ``(W,)`` a triangle corner that each is at, -1 for none; None where no corner attribute splits vertices.
        attributes: arrays ``(W, C)`` by name, of those per vertex and per corner.
        shapes: the meshes.
    """

    sources: Int64
    corners: Int64 | None
    attributes: dict[str, Array]
    shapes: tuple[Shape, ...]


def split_vertices(sequence: MeshSequence) -> Split:
    """Split a sequence's vertices along the seams of its corner attributes."""
    corner = {name: one for name, one in sequence.attributes.items() if one.domain == "corner"}
    vertices = sequence.faces.reshape(-1).astype(np.int64)
    sources, index, first = np.arange(sequence.n_vertices), vertices, None
    if corner:
        keys = vertices
        for one in corner.values():
            rows = _value_rows(one)
            keys = np.unique(keys * (int(rows.max(initial=0)) + 1) + rows, return_inverse=True)[1].reshape(-1)
        # vertices without a corner stay, after their neighbours by number
        _, first, index = np.unique(keys, return_index=True, return_inverse=True)
        unused = np.setdiff1d(sources, vertices)
        all_sources = np.concatenate([vertices[first], unused])
        order = np.argsort(all_sources, kind="stable")
        ranks = np.empty(len(order), np.int64)
        ranks[order] = np.arange(len(order))
        sources, index = all_sources[order], ranks[index.reshape(-1)]
        first = np.concatenate([first, np.full(len(unused), -1)])[order]
    arrays: dict[str, Array] = {}
    for name, one in sequence.attributes.items():
        if one.domain == "vertex":
            arrays[name] = np.asarray(one)[sources]
        elif one.domain == "corner" and first is not None:
            values = np.asarray(one)[np.maximum(first, 0)]
            values[first < 0] = 0
            arrays[name] = values
    return Split(sources, first, arrays, _shapes(sequence, sources, index.reshape(-1, 3)))


def in_drawing_order(split: Split) -> Split:
    """The same, with each mesh's triangles and vertices in the order of `gvpipe.mesh.drawing_order`.

    Vertices of meshes that share some of theirs keep their order.
    """
    order = np.arange(len(split.sources))
    places = order.copy()
    spans = sorted({(shape.start, shape.stop) for shape in split.shapes})
    is_apart = all(one[1] <= two[0] for one, two in pairwise(spans))
    known: set[int] = set()
    shapes = []
    for shape in split.shapes:
        span = slice(shape.start, shape.stop)
        primitives = [(faces[order_triangles(faces)], material) for faces, material in shape.primitives]
        if is_apart and shape.start not in known:
            known.add(shape.start)
            uses = first_uses(np.concatenate([faces for faces, _ in primitives]), shape.stop - shape.start)
            order[span] = shape.start + uses
            places[order[span]] = np.arange(shape.start, shape.stop)
        own = (places[span] - shape.start).astype(np.int32)
        shapes.append(replace(shape, primitives=tuple((own[faces], material) for faces, material in primitives)))
    return Split(
        split.sources[order],
        None if split.corners is None else split.corners[order],
        {name: values[order] for name, values in split.attributes.items()},
        tuple(shapes),
    )


def _value_rows(one: Attribute) -> Int64:
    """A number for each corner, equal where values are."""
    if one.indices is not None:
        return one.indices.astype(np.int64)
    return np.unique(one.values, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)


def _shapes(sequence: MeshSequence, sources: Int64, faces: Int64) -> tuple[Shape, ...]:
    whole = Part("", (0, sequence.n_vertices), (0, len(faces)))
    groups: list[list[Part]] = []
    for part in sequence.parts or (whole,):
        if part.triangles[0] == part.triangles[1]:
            continue  # glTF has no mesh without triangles
        last = groups[-1][0] if groups else None
        if last and part.name and (part.name, part.parent, part.vertices) == (last.name, last.parent, last.vertices):
            groups[-1].append(part)
        else:
            groups.append([part])
    shapes = []
    for group in groups:
        start, stop = (int(at) for at in np.searchsorted(sources, group[0].vertices))
        primitives = tuple(
            ((faces[part.triangles[0] : part.triangles[1]] - start).astype(np.int32), part.material) for part in group
        )
        shapes.append(Shape(group[0].name, group[0].parent, start, stop, primitives))
    return tuple(shapes)
