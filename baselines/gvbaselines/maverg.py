"""Angle-preserving prediction along the surface, averaged: "maverg+angle".

Stefanoski and Ostermann, "Connectivity-Guided Predictive Compression of Dynamic 3D Meshes", ICIP 2006. Points lie on a lattice,
and follow each other along the surface. A point is predicted from the frame before and the coded part of this one:

- ``angle``: from each coded triangle across an edge of the point's own: the point keeps its place in the rigid frame of the
  edge and the triangle's plane, and with it the angle between both triangles. Exact for rigid motion.
- ``motion``: it moves like the mean of the coded points that share a triangle with it. Exact for translations.

``predictor=angle`` takes the mean of all angle-preserving predictions, and ``motion`` where there is none. Frame 0 is predicted
by the parallelogram::

    segment = [3 x float64] origin, [float64] step, residuals [integers]: frame by frame, point by point, x y z

Readings: the paper is not at hand; what it does is from its abstract and from Amjoun and Strasser 2008, who compare with
it. Points are rounded to the lattice before prediction, so that nothing accumulates. Residuals are coded as in `dynapack`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, check_lattice, frame_contexts, pack_origin, quantise, read_origin, read_step
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.mesh.topology import opposite_corners

PREDICTORS = ("angle", "motion")
STEP_PER_ERROR = 2.0  # rounding leaves step / sqrt(12) on each of three axes


@dataclass(frozen=True)
class Maverg(Baseline):
    """Settings of angle-preserving prediction."""

    id: ClassVar[str] = "maverg"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "maverg+angle: angle-preserving prediction (Stefanoski and Ostermann 2006)"
    same_bits: ClassVar[bool] = True

    predictor: str = "angle"  # angle, motion

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_choice("predictor", PREDICTORS)

    def header(self) -> dict[str, Any]:
        """The predictor."""
        return {"predictor": self.predictor}

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        from gvbaselines.angle_kernels import predict

        head, origin = pack_origin(frames)
        step = STEP_PER_ERROR * error
        points = quantise(frames - origin, step)
        residuals = np.zeros_like(points)
        residuals[0] = residuals_of(points[0], traversal_of(mesh))
        predict(points, residuals, causal_of(mesh, self.predictor), False)
        return head + STEP.pack(step) + encode_integers(residuals, frame_contexts(points.shape))

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        from gvbaselines.angle_kernels import predict

        predictor = settings.choice("predictor", PREDICTORS)
        origin, step = read_origin(cursor), read_step(cursor)
        shape = (n_frames, mesh.n_points, 3)
        residuals = decode_integers(cursor.rest(), int(np.prod(shape)), frame_contexts(shape), cursor.name).reshape(shape)
        points = np.zeros(shape, np.int64)
        points[0] = values_of(residuals[0], traversal_of(mesh))
        predict(points, residuals, causal_of(mesh, predictor), True)
        check_lattice(cursor, points)
        return origin + step * points


def causal_of(mesh: Topology, predictor: str) -> tuple[Int32, Int64, Int64, Int64, Int64]:
    """The order of points, and what each is predicted from.

    Returns:
        ``(P,)`` points in order; bounds ``(P + 1,)`` and rows ``(n, 3)`` of edges a b and corners c opposite, all coded before;
        bounds ``(P + 1,)`` and ``(m,)`` coded points around. Bounds are by point.
    """
    order = traversal_of(mesh).order
    rank = np.empty(mesh.n_points, np.int64)
    rank[order] = np.arange(mesh.n_points)
    faces = mesh.point_faces.astype(np.int64)
    corners = faces.ravel()
    first, second = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, -2, axis=1).ravel()
    across = opposite_corners(faces)
    opposite = np.where(across >= 0, corners[across], corners)  # a corner is not before itself
    before = np.stack([rank[one] < rank[corners] for one in (first, second, opposite)])
    is_edge = before.all(axis=0) & (predictor == "angle")
    edges, edge_starts = _by_point(corners[is_edge], np.stack([first, second, opposite], axis=1)[is_edge], mesh.n_points)
    pairs = np.concatenate(
        [np.stack([corners, one], axis=1)[is_before] for one, is_before in ((first, before[0]), (second, before[1]))]
    )
    pairs = np.unique(pairs, axis=0)
    around, starts = _by_point(pairs[:, 0], pairs[:, 1], mesh.n_points)
    return order, edge_starts, edges, starts, around


def _by_point(points: Int64, rows: Int64, n_points: int) -> tuple[Int64, Int64]:
    """Rows sorted by their points, and the bounds ``(P + 1,)`` of each point's."""
    sorting = np.argsort(points, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(points, minlength=n_points))])
    return np.ascontiguousarray(rows[sorting]), np.asarray(starts, np.int64)
