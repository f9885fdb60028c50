"""Animations by principal components: frames as sums of a few base shapes, after affine motion is taken out.

Alexa and Mueller, "Representing Animations by Principal Components", Computer Graphics Forum 19(3), 2000. Steps:

1. Each frame is brought to the first one by the affine map that fits best in the least squares sense.
2. A principal component analysis of the frames gives the base shapes.
3. A frame is its coefficients, and the affine map back.

    segment = basis (`eigenframes`), affine maps [columns], [float64] their step, coefficients [columns]

Readings: the paper transmits maps and coefficients as numbers; here they are rounded and range coded, each column on its own,
without prediction in time (that is `kglpc`). A map is fitted to the decoded shapes' frame, from the first frame to each: this
direction needs no inverse, which a flat mesh would not have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.eigenframes import code_basis, fit_frames, read_basis, rebuild
from gvbaselines.numbers import STEP, decode_columns, encode_columns, multiples, quantise, read_step
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Float64

MAP_FINENESS = 0.1  # of the error that rounding a map's numbers may add at a point one spread from the centre
RIDGE = 1e-9  # of the fit: a flat mesh spans no space


@dataclass(frozen=True)
class PcaAnim(Baseline):
    """Settings of principal component animation."""

    id: ClassVar[str] = "pcaanim"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "principal components of frames after affine motion (Alexa and Mueller 2000)"

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        maps, size = _fit_maps(frames)
        map_step = MAP_FINENESS * error / size
        numbers = quantise(maps.reshape(len(maps), 12), map_step)
        maps = multiples(numbers, map_step).reshape(-1, 4, 3)
        aligned = _apply_inverse(frames, maps, size)
        coded = code_basis(aligned, mesh, error)
        coefficients = quantise(fit_frames(aligned, coded.basis), coded.step)
        return b"".join(
            [
                STEP.pack(map_step),
                STEP.pack(size),
                encode_columns(numbers),
                coded.data,
                encode_columns(coefficients),
            ]
        )

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        map_step, size = read_step(cursor), read_step(cursor)
        maps = multiples(decode_columns(cursor, n_frames, 12), map_step).reshape(-1, 4, 3)
        basis, step = read_basis(cursor, mesh, n_frames)
        coefficients = multiples(decode_columns(cursor, n_frames, basis.vectors.shape[1]), step)
        cursor.end()
        return _apply(rebuild(coefficients, basis), maps, size)


def _fit_maps(frames: Float64) -> tuple[Float64, float]:
    """The affine maps ``(n, 4, 3)`` from frame 0 to each frame, rows x y z 1, and the spread of frame 0, model units.

    The last row, the shift, is in parts of the spread, so that all numbers of a map count alike.
    """
    first = frames[0]
    size = float(np.sqrt(np.square(first - first.mean(axis=0)).sum(axis=1).mean())) or 1.0
    sources = np.column_stack([first, np.full(len(first), size)])  # (P, 4)
    gram = sources.T @ sources
    rest = RIDGE * np.trace(gram) * np.eye(4)
    identity = np.concatenate([np.eye(3), np.zeros((1, 3))])
    maps = [np.linalg.solve(gram + rest, sources.T @ frame + rest @ identity) for frame in frames]  # the rest: as frame 0 is
    return np.stack(maps), size


def _apply(frames: Float64, maps: Float64, size: float) -> Float64:
    return np.asarray(frames @ maps[:, :3] + size * maps[:, 3:])


def _apply_inverse(frames: Float64, maps: Float64, size: float) -> Float64:
    """Frames brought to where frame 0 is; a map that nearly flattens has a pseudoinverse."""
    return np.asarray((frames - size * maps[:, 3:]) @ np.linalg.pinv(maps[:, :3], rcond=1e-3))
