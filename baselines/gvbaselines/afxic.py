"""Interpolator compression of MPEG-4 AFX: key frames, and differences in time or to a reference vertex.

Jang et al., "Interpolator Data Compression for MPEG-4 Animation", IEEE Transactions on Circuits and Systems for Video
Technology 14(7), 2004, of coordinate interpolators. Frames that lie between two key frames within a bound are left out, and
interpolated linearly. Key frames are rounded to a lattice. Each coordinate of each vertex takes one of three differences for
all key frames: in time, to a reference vertex, or of both::

    segment = [3 x float64] origin, [float64] step, [varint] length, key flags [integers], [varint] length, modes [integers],
              residuals [integers] in contexts of key frame 0, else of mode and axis

Readings: the standard sends a reference vertex for each vertex; here it is the first neighbour decoded before, which costs
nothing. Key frames are chosen greedily, each as far from the one before as the bound allows. The standard's two arithmetic
coding modes are one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, pack_origin, quantise, read_origin, read_step
from gvbaselines.parallelogram import traversal_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int32, Int64

STEP_PER_ERROR = 2.0
BOUND = 1.0  # of the root mean square error of a frame that is left out, in that which rounding leaves


@dataclass(frozen=True)
class AfxIc(Baseline):
    """Settings of AFX interpolator compression."""

    id: ClassVar[str] = "afxic"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "interpolator compression of MPEG-4 AFX (Jang et al. 2004)"
    same_bits: ClassVar[bool] = True

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        from gvbaselines.afxic_kernels import difference

        head, origin = pack_origin(frames)
        step = STEP_PER_ERROR * error
        is_key = find_keys(frames, BOUND * error)
        points = quantise(frames[is_key == 1] - origin, step)
        order, references = _references(mesh)
        modes = _choose_modes(points, references)
        residuals = np.zeros_like(points)
        difference(points, residuals, order, references, modes, False)
        return b"".join(
            [
                head,
                STEP.pack(step),
                pack_block(encode_integers(is_key)),
                pack_block(encode_integers(modes)),
                encode_integers(residuals, _contexts(len(points), modes)),
            ]
        )

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        from gvbaselines.afxic_kernels import BOTH, difference

        origin, step = read_origin(cursor), read_step(cursor)
        is_key = decode_integers(cursor.block(), n_frames, name=cursor.name)
        if ((is_key < 0) | (is_key > 1)).any() or not is_key[0] or not is_key[-1]:
            raise cursor.corrupt("the first and the last frame are no key frames")
        modes = decode_integers(cursor.block(), 3 * mesh.n_points, name=cursor.name).reshape(-1, 3)
        if ((modes < 0) | (modes > BOTH)).any():
            raise cursor.corrupt("a mode does not exist")
        keys = np.flatnonzero(is_key)
        contexts = _contexts(len(keys), modes)
        residuals = decode_integers(cursor.rest(), contexts.size, contexts, cursor.name).reshape(contexts.shape)
        points = np.zeros_like(residuals)
        difference(points, residuals, *_references(mesh), modes, True)
        return interpolate(origin + step * points, keys, n_frames)


def find_keys(frames: Float64, bound: float) -> Int64:
    """Flags ``(n,)`` of key frames; all other ``frames (n, P, 3)`` are interpolated within a root mean square bound."""
    flags, start = np.zeros(len(frames), np.int64), 0
    flags[[0, -1]] = 1
    while start < len(frames) - 1:
        stop = start + 1
        while stop + 1 < len(frames) and _between(frames[start : stop + 2]) <= bound:
            stop += 1
        flags[stop], start = 1, stop
    return flags


def interpolate(keys: Float64, numbers: Int64, n_frames: int) -> Float64:
    """All frames ``(n_frames, P, 3)`` from key frames ``(k, P, 3)`` of these numbers, 0 and the last among them."""
    frames = np.arange(n_frames)
    after = np.clip(np.searchsorted(numbers, frames), 1, None) if len(numbers) > 1 else np.zeros(n_frames, np.int64)
    before = np.maximum(after - 1, 0)
    length = np.maximum(numbers[after] - numbers[before], 1)
    part = ((frames - numbers[before]) / length)[:, None, None]
    return np.asarray((1 - part) * keys[before] + part * keys[after])


def _between(run: Float64) -> float:
    """The largest root mean square error of the frames inside a run, interpolated between its ends."""
    guess = interpolate(run[[0, -1]], np.array([0, len(run) - 1]), len(run))
    return float(np.sqrt(np.square(run - guess).sum(axis=2).mean(axis=1)).max())


def _references(mesh: Topology) -> tuple[Int32, Int32]:
    """The order of points, and a point before each: its first neighbour in the traversal, or -1."""
    traversal = traversal_of(mesh)
    references = np.full(mesh.n_points, -1, np.int32)
    has = np.diff(traversal.starts) > 0
    references[traversal.order[has]] = traversal.neighbours[traversal.starts[:-1][has]]
    return traversal.order, references


def _choose_modes(points: Int64, references: Int32) -> Int64:
    """Modes ``(P, 3)`` whose differences of ``points (k, P, 3)`` take the fewest bits, about."""
    apart = points - points[:, np.maximum(references, 0)]
    kinds = [np.diff(points, axis=0, prepend=0), apart, np.diff(apart, axis=0, prepend=0)]
    bits = np.stack([np.log2(1.0 + np.abs(kind)).sum(axis=0) for kind in kinds])
    modes = bits.argmin(axis=0)
    modes[references < 0] = 0
    return np.asarray(modes, np.int64)


def _contexts(n_keys: int, modes: Int64) -> Int64:
    """Contexts ``(k, P, 3)``: 0 for the first key frame, else 1 + mode by axis."""
    contexts = np.tile(1 + 3 * modes + np.arange(3), (n_keys, 1, 1))
    contexts[0] = 0
    return contexts
