"""Coddyac: trajectories in the space of principal ones, predicted by the parallelogram along the surface.

Vasa and Skala, "CODDYAC: Connectivity Driven Dynamic Mesh Compression", 3DTV-CON 2007, with the basis coding of their "COBRA"
(2009), as Vasa and Skala 2010 start from. A point's coefficients are rounded, predicted from three points around, and range
coded::

    segment = [float64] step, [varint] length, basis (`gvpipe.trajectory.basis`), residuals [columns]

Readings: the paper's number of components is a setting; here as many as pay, unless ``components`` says how many. The basis'
coding is gvpipe's, which predicts along time as COBRA does, from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, decode_columns, encode_columns, quantise, read_step
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Float64
from gvpipe.trajectory.basis import decode_basis, reduce_trajectories

MAX_COMPONENTS = 4096


@dataclass(frozen=True)
class Coddyac(Baseline):
    """Settings of Coddyac."""

    id: ClassVar[str] = "coddyac"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "trajectory PCA with parallelogram prediction (Vasa and Skala 2007)"

    components: int = 0  # principal trajectories, 1..4096; 0: as many as pay

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_range(0, MAX_COMPONENTS, "components")

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        trajectories = np.ascontiguousarray(frames.swapaxes(0, 1)).reshape(mesh.n_points, -1)  # (P, 3n)
        squared = error * error * len(frames) * mesh.n_points
        reduced = reduce_trajectories(trajectories, squared, self.components, most=MAX_COMPONENTS)
        values = quantise(reduced.coefficients, reduced.step)
        residuals = residuals_of(values, traversal_of(mesh))
        return STEP.pack(reduced.step) + pack_block(reduced.basis) + encode_columns(residuals)

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        step = read_step(cursor)
        block = cursor.block()
        Cursor(block, cursor.name).varint(min(mesh.n_points, 3 * n_frames), "the number of components")
        basis = decode_basis(block, n_frames, mesh.n_points, step, cursor.name)
        residuals = decode_columns(cursor, mesh.n_points, basis.vectors.shape[1])
        cursor.end()
        trajectories = basis.mean + values_of(residuals, traversal_of(mesh)) * step @ basis.vectors.T
        return np.ascontiguousarray(trajectories.reshape(mesh.n_points, n_frames, 3).swapaxes(0, 1))
