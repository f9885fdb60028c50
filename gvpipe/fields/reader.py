"""A field's frames from its section, any of them; the segment used last is kept."""

from __future__ import annotations

import numpy as np

from gvpipe.container.segments import segments_between
from gvpipe.fields.derived import Positions, Span, motion_of
from gvpipe.fields.graph import FieldGraph
from gvpipe.fields.head import read_head
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.segment import Place, decode_segment, read_mode
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError


class FieldReader:
    """Frames of a field. Nothing but the head is decoded until frames are read, and then their segments alone.

    Args:
        data: the section.
        n_frames: F.
        mesh: the field's rows, as when it was encoded.
        name: of the section, for messages.
        positions: as for the encoder: needed if it had them.
        budget: of the file.

    Raises:
        CorruptFile: here or later: the section is not what `gvpipe.fields.encoder.encode_field` writes.
    """

    def __init__(
        self,
        data: bytes,
        n_frames: int,
        mesh: FieldMesh | FieldGraph,
        name: str,
        positions: Positions | None = None,
        *,
        budget: Budget = UNLIMITED,
    ) -> None:
        self._head, self._segments = read_head(data, n_frames, mesh.n_rows, name)
        self._bounds = self._head.bounds(n_frames)
        self._budget = budget
        self._mesh, self._name, self._n_frames = mesh, name, n_frames
        self._motion = None if positions is None else motion_of(positions, n_frames, mesh)
        self._last: tuple[int, Array] | None = None

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Type of the values: float32, or integers of 8 to 32 bits."""
        return self._head.dtype

    @property
    def n_components(self) -> int:
        """C."""
        return self._head.components

    @property
    def shape(self) -> tuple[int, int, int]:
        """F, R, C."""
        return self._n_frames, self._mesh.n_rows, self._head.components

    @property
    def modes(self) -> list[str]:
        """How each segment is coded: names of `gvpipe.fields.segment.MODES`. Raises `CorruptFile`."""
        return [read_mode(segment, self._name) for segment in self._segments]

    def read(self, start: int, stop: int) -> Array:
        """Return frames ``start`` to ``stop``: ``(stop - start, R, C)``, in the field's unit; NaN where there are holes.

        Raises:
            CorruptFile: a segment does not decode.
            InputError: there are no such frames, or they follow from positions and the reader has none.
        """
        if not 0 <= start <= stop <= self._n_frames:
            raise InputError(f"field {self._name!r}: frames {start} to {stop}: there are 0 to {self._n_frames}")
        result = np.empty((stop - start, *self.shape[1:]), self.dtype)
        for s, first, last in segments_between(start, stop, self._bounds):
            begin = self._bounds[s]
            result[first - start : last - start] = self._decode(s)[first - begin : last - begin]
        return result

    def _decode(self, s: int) -> Array:
        last = self._last  # once: other threads may read too
        if last is None or last[0] != s:
            span = None if self._motion is None else Span(self._motion, self._bounds[s], self._bounds[s + 1])
            place = Place(self._mesh.causal, self._name, span, self._budget)
            shape = (self._bounds[s + 1] - self._bounds[s], *self.shape[1:])
            last = self._last = s, decode_segment(self._segments[s], shape, self.dtype, place)
        return last[1]
