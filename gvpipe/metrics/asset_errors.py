"""How far attributes and fields of one sequence are from those of another.

Attributes of vertices and of corners are compared corner by corner, so that it does not matter how a format stores them.
Numbers are compared component by component, normals and tangents by the angle between them, in degrees. Colours of different
types are compared on the scale 0..1, colours of one type on its own scale.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array, Float64, Int64, Integers
from gvpipe.grids.volume import Volume
from gvpipe.metrics.correspondence import match_corners
from gvpipe.model.sequence import MeshSequence

ANGLES = ("normal", "tangent")
BLOCK_BYTES = 16 << 20

AssetErrors = dict[str, dict[str, float | None]]
"""By name, the largest and the mean error: ``{"uv": {"max": 0.0001, "mean": 0.00004}}``; null if one side lacks it."""


def compare_attributes(reference: MeshSequence, distorted: MeshSequence, pairing: Integers) -> AssetErrors:
    """Measure every static attribute that one of both has.

    Args:
        reference, distorted: two sequences of the same triangles.
        pairing: ``(V,)`` the reference's vertex of each vertex of ``distorted``.
    """
    if not (reference.attributes or distorted.attributes):
        return {}
    corners = match_corners(reference.faces, np.asarray(pairing)[distorted.faces])
    result: AssetErrors = {}
    for name in dict.fromkeys([*reference.attributes, *distorted.attributes]):
        ours, theirs = reference.attributes.get(name), distorted.attributes.get(name)
        result[name] = {"max": None, "mean": None}
        if ours is None or theirs is None or (ours.domain == "part") != (theirs.domain == "part"):
            continue
        a, b = _rows(ours, reference, corners), _rows(theirs, distorted, np.arange(len(corners)))
        if a.shape == b.shape:
            result[name] = _errors([_difference(ours.kind, a, b)])
    return result


def compare_fields(reference: MeshSequence, distorted: MeshSequence, pairing: Integers) -> AssetErrors:
    """The same for animated fields; values that are NaN on both sides agree."""
    result: AssetErrors = {}
    names = dict.fromkeys([*reference.fields, *distorted.fields])
    triangles: Int64 | None = None
    for name in names:
        ours, theirs = reference.fields.get(name), distorted.fields.get(name)
        result[name] = {"max": None, "mean": None}
        if ours is None or theirs is None or (ours.domain, ours.n_components) != (theirs.domain, theirs.n_components):
            continue
        if ours.domain == "triangle" and triangles is None:
            triangles = match_corners(reference.faces, np.asarray(pairing)[distorted.faces])[::3] // 3
        rows = np.asarray(pairing) if ours.domain == "vertex" else triangles
        assert rows is not None
        result[name] = _errors(_field_differences(ours, theirs, rows))
    return result


def compare_volumes(reference: MeshSequence, distorted: MeshSequence) -> AssetErrors:
    """The same for what lies inside: ``(points)``, whose errors are lengths, and numbers of points and of cells.

    Points and cells of both are in one order; where they are others, or one side has none, errors are null.
    """
    ours, theirs = reference.volume, distorted.volume
    if ours is None and theirs is None:
        return {}
    result: AssetErrors = {"(points)": {"max": None, "mean": None}}
    if ours is None or theirs is None or ours.points.shape != theirs.points.shape or not _same_cells(ours, theirs):
        return result
    apart = distorted.origin - reference.origin
    lengths = []
    for k in range(reference.n_frames):
        difference = np.asarray(theirs.points[k : k + 1], np.float64) + apart - ours.points[k : k + 1]
        lengths.append(np.linalg.norm(difference, axis=2))
    result["(points)"] = _errors(lengths)
    for mine, others in ((ours.point_fields, theirs.point_fields), (ours.cell_fields, theirs.cell_fields)):
        for name in dict.fromkeys([*mine, *others]):
            result[name] = {"max": None, "mean": None}
            a, b = mine.get(name), others.get(name)
            if a is not None and b is not None and (*a.shape[:2], a.n_components) == (*b.shape[:2], b.n_components):
                result[name] = _errors(_field_differences(a, b, np.arange(a.shape[1])))
    return result


def _same_cells(ours: Volume, theirs: Volume) -> bool:
    """Whether the cells of two grids have the same points, by the grids' own numbers."""
    same_types = np.array_equal(ours.cells.types, theirs.cells.types)
    mine, others = (each.cells.nodes if each.order is None else each.order[each.cells.nodes] for each in (ours, theirs))
    return same_types and np.array_equal(mine, others)


def _field_differences(ours: Field, theirs: Field, rows: Integers) -> list[Float64]:
    step = max(1, BLOCK_BYTES // (8 * ours.shape[1] * ours.n_components))
    result = []
    for first in range(0, len(ours), step):
        stop = min(first + step, len(ours))
        result.append(_difference(ours.kind, ours.read(first, stop)[:, rows], theirs.read(first, stop)))
    return result


def _rows(attribute: Attribute, sequence: MeshSequence, corners: Int64) -> Array:
    """Its values, one row per corner in the order of ``corners``, per part for those of parts."""
    values = np.asarray(attribute)
    if attribute.domain == "part":
        return values
    if attribute.domain == "vertex":
        return values[sequence.faces.reshape(-1)[corners]]
    return values[corners // 3 if attribute.domain == "triangle" else corners]


def _difference(kind: str, a: Array, b: Array) -> Float64:
    """Errors of all numbers, or of all angles in degrees."""
    if kind == "color" and a.dtype != b.dtype:
        a, b = _as_parts_of_one(a), _as_parts_of_one(b)
    a, b = a.astype(np.float64), b.astype(np.float64)
    if kind in ANGLES:
        return angles(a[..., :3], b[..., :3])
    return np.asarray(np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b)))


def _as_parts_of_one(colors: Array) -> Array:
    """Colours on the scale 0..1: integers are parts of the largest of their type."""
    return colors / np.float64(np.iinfo(colors.dtype).max) if colors.dtype.kind in "iu" else colors


def angles(a: Any, b: Any) -> Float64:
    """Angles between vectors ``(..., 3)``, degrees; 0 between two vectors of length 0, 180 if one of them is."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    long_a, long_b = np.linalg.norm(a, axis=-1, keepdims=True), np.linalg.norm(b, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = a / long_a, b / long_b
        result = np.degrees(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))
    empty = (long_a[..., 0] == 0).astype(int) + (long_b[..., 0] == 0)
    return np.asarray(np.where(empty == 0, result, np.where(empty == 2, 0.0, 180.0)))


def _errors(parts: list[Float64]) -> dict[str, float | None]:
    count = sum(part.size for part in parts)
    if not count:
        return {"max": 0.0, "mean": 0.0}
    largest = max(float(part.max()) for part in parts if part.size)
    return {"max": largest, "mean": float(sum(part.sum() for part in parts)) / count}
