"""Dynapack: points on a lattice, predicted from neighbours in this frame and the one before.

Ibarria and Rossignac, "Dynapack: Space-Time Compression of the 3D Animations of Triangle Meshes with Fixed Connectivity", 2003.
With the neighbours a, b and the corner c opposite of a parallelogram, primes for the frame before:

- ``elp``: v = a + b - c + v' - (a' + b' - c'), exact for translations;
- ``replica``: v keeps its coordinates in the triangle's frame (two sides and a normal whose length is that of the sides), exact
  for rigid motion and uniform scale;
- ``space`` and ``time``, the paper's reference: a + b - c, and v'. ``space`` stands for Touma and Gotsman frame by frame.

Frame 0 is predicted in space. Residuals are range coded, with one table for frame 0 and one for all others::

    segment = [3 x float64] origin, [float64] step, residuals [integers]: frame by frame, point by point, x y z

Readings: points with fewer than three neighbours, which the paper leaves open, take the middle of two neighbours, or one, in
place of the parallelogram. A degenerate triangle makes ``replica`` fall back to ``elp``. Points are rounded to the lattice
before prediction, as in the paper, so that nothing accumulates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, check_lattice, frame_contexts, pack_origin, quantise, read_origin, read_step
from gvbaselines.parallelogram import traversal_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.mesh.traversal import Traversal

PREDICTORS = ("elp", "replica", "space", "time")
STEP_PER_ERROR = 2.0  # rounding leaves step / sqrt(12) on each of three axes


@dataclass(frozen=True)
class Dynapack(Baseline):
    """Settings of Dynapack."""

    id: ClassVar[str] = "dynapack"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "Dynapack (Ibarria and Rossignac 2003): space-time prediction on a lattice"
    same_bits: ClassVar[bool] = True

    predictor: str = "elp"  # elp, replica, space, time
    bits: int = 0  # of the lattice over the animation's bounding box, 1..24, whatever the quality; 0: as quality asks

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_choice("predictor", PREDICTORS)
        self.check_range(0, 24, "bits")

    @property
    def rounds(self) -> int:
        """Bits fix the error."""
        return 1 if self.bits else super().rounds

    def header(self) -> dict[str, Any]:
        """The predictor."""
        return {"predictor": self.predictor}

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        head, origin = pack_origin(frames)
        step = STEP_PER_ERROR * error
        if self.bits:
            step = float(np.ptp(frames.reshape(-1, 3), axis=0).max()) / (2**self.bits - 1) or 1.0
        points = quantise(frames - origin, step)
        residuals = np.zeros_like(points)
        _predict(points, residuals, traversal_of(mesh), self.predictor, decodes=False)
        return head + STEP.pack(step) + encode_integers(residuals, frame_contexts(points.shape))

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        predictor = settings.choice("predictor", PREDICTORS)
        origin, step = read_origin(cursor), read_step(cursor)
        shape = (n_frames, mesh.n_points, 3)
        count = 3 * n_frames * mesh.n_points
        residuals = decode_integers(cursor.rest(), count, frame_contexts(shape), cursor.name).reshape(shape)
        points = np.zeros(shape, np.int64)
        _predict(points, residuals, traversal_of(mesh), predictor, decodes=True)
        check_lattice(cursor, points)
        return origin + step * points


def _predict(points: Int64, residuals: Int64, traversal: Traversal, predictor: str, decodes: bool) -> None:
    """Fill in ``residuals (n, P, 3)`` from ``points (n, P, 3)``, or the other way."""
    from gvbaselines import parallelogram_kernels as kernels

    kinds = {"elp": kernels.ELP, "replica": kernels.REPLICA, "space": kernels.SPACE, "time": kernels.TIME}
    for f in range(len(points)):
        kind = kinds[predictor] if f else kernels.SPACE
        kernels.predict_frame(points[f], points[max(f - 1, 0)], residuals[f], traversal, kind, decodes)
