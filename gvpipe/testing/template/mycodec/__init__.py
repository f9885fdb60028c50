"""A codec to begin with: positions on a lattice, each frame as its difference from the one before, deflated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvpipe.codec import BaseCodec, Bitstream, Encoded, Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.foundation.errors import corrupt_section
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.sequence import MeshSequence

MAX_STEP = 1e30  # of the lattice, model units


@dataclass(frozen=True)
class MyCodec(BaseCodec):
    """Settings: each field is one, named on the command line by ``--set NAME=VALUE``; raises `SettingError`."""

    id: ClassVar[str] = "mycodec"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "differences of frames on a lattice, deflated"
    holds: ClassVar[bool] = True  # gvpipe codes repeated frames by run lengths, around the codec

    quality: float = 75.0  # 0..100, higher is better: names the target error, as it does for every codec
    reorder: bool = False  # true: vertices may come back in another order; this codec makes no use of it

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        error = error_of(self.quality) / 100 * measure_spread(sequence)  # root mean square of the distances
        step = min(2 * error, MAX_STEP)  # rounding leaves step / sqrt(12) along each of three axes
        frames = sequence.read(0, sequence.n_frames).astype(np.float64)  # (F, V, 3)
        low = frames[0].min(axis=0)
        places = np.rint((frames - low) / step).astype(np.int64)
        differences = np.diff(places, axis=0, prepend=0)
        header = {"step": step, "low": low.tolist()}
        sections = {"faces": deflated(sequence.faces.tobytes()), "places": deflated(differences.tobytes())}
        return Encoded(self._bitstream(sequence, header, sections), np.arange(sequence.n_vertices))

    @classmethod
    def reader(cls, bitstream: Bitstream) -> MyReader:
        """Open a file; raises `CorruptFile`."""
        return MyReader(bitstream)


class MyReader:
    """Frames of a file; what it reads may be damaged, or made to do harm. Raises `CorruptFile`."""

    def __init__(self, bitstream: Bitstream) -> None:
        self.n_frames = bitstream.n_frames
        shape = (bitstream.n_frames, bitstream.n_vertices, 3)
        bitstream.budget.keep("frames", 16 * int(np.prod(shape)), 1e-7 * bitstream.n_frames * bitstream.n_vertices)
        faces = inflated(bitstream.section("faces"), 12 * bitstream.n_triangles, "faces")
        self.faces: Int32 = np.frombuffer(faces, np.int32).reshape(-1, 3)
        if len(self.faces) and not 0 <= self.faces.min() <= self.faces.max() < bitstream.n_vertices:
            raise corrupt_section("faces", "a triangle has a vertex that is not there")
        differences = inflated(bitstream.section("places"), 8 * int(np.prod(shape)), "places")
        places = np.cumsum(np.frombuffer(differences, np.int64).reshape(shape), axis=0)
        step = bitstream.fields.number("step", 0, MAX_STEP)
        self._frames = (places * step + bitstream.fields.numbers("low", 3, -1e38, 1e38)).astype(np.float32)
        if not np.isfinite(self._frames).all():
            raise corrupt_section("places", "a position is beyond float32")

    def read(self, start: int, stop: int) -> Float32:
        """Frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units."""
        return self._frames[start:stop]
