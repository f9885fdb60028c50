"""Values that follow from decoded positions: displacement, velocity, elevation, the magnitude of a displacement.

A value's part that follows is a sum of signals of its row, with a matrix of coefficients that all rows and frames share::

    0 linear     p(t) - p(r) and p(t + 1) - p(t - 1), three axes each: S = 6 signals
    1 magnitude  the length of p(t) - p(r): S = 1 signal

    derivation = [8 bits] kind, [varint] reference frame r, C x S x [float32] coefficients

p(t) is the decoded position of the row's vertex, or the mean of its triangle's (of a polygon the mean of its triangles'
means), in frame t of the sequence; before its start
and behind its end t stops. What does not follow is coded by `gvpipe.fields.prediction`. A row's own constant is among that,
so that the reference need not be frame 0.

All is plain float64 in a fixed order. Another machine's positions may differ in their last bits; the encoder keeps room for
that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gvpipe.container.cursor import Cursor, varint
from gvpipe.fields.graph import FieldGraph
from gvpipe.fields.mesh import FieldMesh
from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError

LINEAR, MAGNITUDE = range(2)
SIGNALS = (6, 1)  # of each kind
RIDGE = 1e-12  # of the fit, in the signals' mean square
CHUNK = 1 << 19  # rows of all frames that are read at a time, about
NEGLIGIBLE = 1e-4  # part of the largest contribution
LAST_BITS = 4  # units in the last place of a position that another machine's may differ by

Positions = Callable[[int, int], Array]


@dataclass(frozen=True, eq=False)
class Motion:
    """The decoded positions of a field's mesh, read a span of frames at a time.

    Args:
        positions: ``positions(start, stop)`` returns frames ``(stop - start, V, 3)``, as the decoder will have them.
        n_frames: F of the sequence.
        mesh: the field's rows.
    """

    positions: Positions
    n_frames: int
    mesh: FieldMesh

    def rows(self, start: int, stop: int) -> Float64:
        """Positions of the rows in frames ``start`` to ``stop``: ``(stop - start, R, 3)``.

        Raises:
            InputError: positions of another shape than the mesh has.
        """
        points = np.asarray(self.positions(start, stop))
        if points.shape != (stop - start, self.mesh.n_vertices, 3):
            needed = (stop - start, self.mesh.n_vertices, 3)
            raise InputError(f"positions of frames {start} to {stop - 1} have shape {points.shape}; {needed} is needed")
        return self.mesh.middles(points.astype(np.float64))


def motion_of(positions: Positions, n_frames: int, mesh: FieldMesh | FieldGraph) -> Motion:
    """The motion of a surface's rows.

    Raises:
        TypeError: the rows lie inside of a volume; nothing there follows from positions of the surface.
    """
    if not isinstance(mesh, FieldMesh):
        raise TypeError(f"fields per {mesh.domain} do not follow from positions; leave them out")
    return Motion(positions, n_frames, mesh)


@dataclass(frozen=True, eq=False)
class Span:
    """A segment's frames of a motion.

    Args:
        motion: of the sequence.
        start, stop: of all frames.
        references: frames of the sequence that an encoder tries as reference.
    """

    motion: Motion
    start: int
    stop: int
    references: tuple[int, ...] = (0,)

    def chunks(self, kind: int, reference: int) -> Iterator[tuple[slice, Float64]]:
        """Signals ``(m, R, S)`` of m frames at a time, and which of the segment's these are."""
        motion = self.motion
        still = motion.rows(reference, reference + 1)[0]
        several = max(2, CHUNK // max(1, len(still)))
        for start in range(self.start, self.stop, several):
            stop = min(start + several, self.stop)
            low, high = max(0, start - 1), min(motion.n_frames, stop + 1)
            points = motion.rows(low, high)
            at = np.arange(start, stop) - low
            moved = points[at] - still
            if kind == MAGNITUDE:
                x, y, z = np.moveaxis(moved, 2, 0)
                signals = np.sqrt(x * x + y * y + z * z)[:, :, None]
            else:
                change = points[np.minimum(at + 1, high - low - 1)] - points[np.maximum(at - 1, 0)]
                signals = np.concatenate([moved, change], axis=2)
            yield slice(start - self.start, stop - self.start), signals


@dataclass(frozen=True, eq=False)
class Derivation:
    """How values follow: ``coefficients (C, S) float32`` of the signals of a kind, from a reference frame."""

    kind: int
    reference: int
    coefficients: Float32

    def pack(self) -> bytes:
        """Return its bytes."""
        return bytes([self.kind]) + varint(self.reference) + self.coefficients.astype("<f4").tobytes()

    @classmethod
    def take(cls, cursor: Cursor, n_components: int, n_frames: int) -> Derivation:
        """Mirror of `pack`, for a sequence of ``n_frames`` frames; raises `CorruptFile`."""
        kind = cursor.take(1)[0]
        if kind >= len(SIGNALS):
            raise cursor.corrupt(f"a derivation's kind is {kind}")
        reference = cursor.varint(n_frames - 1, "a reference frame")
        coefficients = cursor.array("<f4", n_components * SIGNALS[kind]).reshape(n_components, -1)
        if not np.isfinite(coefficients).all():
            raise cursor.corrupt("a coefficient of its derivation is not finite")
        return cls(kind, reference, coefficients)

    def values(self, span: Span) -> Float64:
        """What follows in the frames of ``span``: ``(n, R, C)``."""
        result = np.zeros((span.stop - span.start, span.motion.mesh.n_rows, len(self.coefficients)))
        for frames, signals in span.chunks(self.kind, self.reference):
            for c, own in enumerate(self.coefficients.astype(np.float64)):
                for s in np.flatnonzero(own):
                    result[frames, :, c] += own[s] * signals[:, :, s]
        return result

    def rounding(self, span: Span) -> float:
        """By how much values may differ on another machine, since its positions' last bits do."""
        points = span.motion.positions(span.start, span.stop)
        largest = float(np.abs(points).max(initial=0))
        gain = float(np.abs(self.coefficients.astype(np.float64)).sum(axis=1).max(initial=0))
        return LAST_BITS * gain * float(np.spacing(np.float32(largest)))


def fit_derivation(values: Array, span: Span, kind: int, reference: int) -> Derivation:
    """Fit the coefficients to the changes of ``values (n, R, C)`` from frame to frame, so that rows' constants do not count.

    Coefficients that contribute next to nothing are 0.
    """
    gram, right = np.zeros((SIGNALS[kind], SIGNALS[kind])), np.zeros((SIGNALS[kind], values.shape[2]))
    for frames, signals in span.chunks(kind, reference):
        change = np.diff(values[frames].astype(np.float64), axis=0).reshape(-1, values.shape[2])
        known = np.diff(signals, axis=0).reshape(-1, signals.shape[2])
        gram += known.T @ known
        right += known.T @ change
    gram[np.diag_indices_from(gram)] += RIDGE * np.trace(gram) + np.finfo(np.float64).tiny
    fitted = np.linalg.solve(gram, right).T  # (C, S)
    size = np.abs(fitted) * np.sqrt(np.diag(gram))
    fitted[size < NEGLIGIBLE * size.max(initial=0)] = 0
    return Derivation(kind, reference, fitted.astype(np.float32))
