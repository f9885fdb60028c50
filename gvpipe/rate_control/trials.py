"""Encodes of one sequence at several qualities, each measured: the size of its whole file and the errors of its frames.

The bitstream is decoded in memory, as by any reader. A memo (`gvpipe.coding.codec.Memo`) keeps what does not depend on quality.
With a bound, every trial gets the corrections that keep it (`gvpipe.coding.corrections.bound`).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gvpipe.coding.codec import Codec, Encoded, FrameReader, Memo
from gvpipe.coding.corrections.bound import SECTION, Bound, encode_corrections
from gvpipe.coding.registry import encode_sequence, open_reader
from gvpipe.coding.repeated_frames import RepeatedFramesReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import file_size
from gvpipe.foundation.arrays import Integers
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import Errors, measure_errors
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.purposes import own_settings
from gvpipe.rendering.poster import poster_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from gvpipe.asset_coding.encoder import AssetCoder


@dataclass(frozen=True)
class Trial:
    """One encode of a search, measured.

    Args:
        codec: settings, the quality that was tried among them.
        bytes: size of the whole file.
        bpvf: the same, bits per vertex and frame.
        errors: of the decoded frames.
        encoded: the bitstream.
        own_bytes: of the file without corrections and what lies beside positions.
    """

    codec: Codec
    bytes: int
    bpvf: float
    errors: Errors
    encoded: Encoded
    own_bytes: int = 0

    @property
    def bitstream(self) -> Bitstream:
        """As it is coded, without a poster."""
        return self.encoded.bitstream

    @property
    def corrections(self) -> int:
        """Bytes of the section of corrections, 0 without one."""
        return len(self.bitstream.sections.get(SECTION, b""))

    def to_json(self) -> dict[str, Any]:
        """Return settings and results as JSON values (``tried`` of `gvpipe.Report`)."""
        return {
            "codec": self.codec.id,
            "settings": own_settings(self.codec),
            "quality": self.codec.quality,
            "bytes": self.bytes,
            "bpvf": self.bpvf,
            "rmse_diag": self.errors.rmse_diag,
            "kg": self.errors.kg,
            "max_diag": self.errors.max_diag,
            "corrections": self.corrections,
        }


class Trials:
    """Tries a codec's settings at one quality after the other.

    Args:
        codec: its settings; their quality is ignored.
        sequence: to encode.
        bound: largest distance of a vertex from where it was, model units; None: whatever the quality gives.
        progress: called with the stages of every encode.
        asset: what is coded beside the positions; None: nothing.
        is_bare: whether files are of the bare layout, which has no poster.
    """

    def __init__(
        self,
        codec: Codec,
        sequence: MeshSequence,
        bound: float | None = None,
        progress: Progress | None = None,
        asset: AssetCoder | None = None,
        is_bare: bool = False,
    ) -> None:
        self.codec = codec
        self._sequence, self._bound, self._progress, self._asset = sequence, bound, progress, asset
        self._is_bare = is_bare
        self._memo = Memo()

    def __call__(self, quality: float) -> Trial:
        """Encode at a quality, 0..100, and measure; raises `InputError` as `Codec.encode` does."""
        memo, report = self._memo, self._progress or (lambda stage, done: None)
        codec = cast("Codec", dataclasses.replace(cast("DataclassInstance", self.codec), quality=quality))
        encoded = encode_sequence(codec, self._sequence, self._progress, memo)
        bitstream = encoded.bitstream
        report("measure", 0.0)
        reader = open_reader(bitstream)
        reference = self._sequence.reordered(encoded.permutation, reader.faces)
        if self._bound is None:
            errors = measure_errors(reference, reader.read)
        else:
            bound = Bound.of(self._bound, memo("coordinate", lambda: _largest_coordinate(self._sequence)))
            bitstream, errors = _correct(bitstream, reference, reader, bound)
        if self._asset is not None:
            report("asset", 0.0)
            bitstream = self._asset.add(dataclasses.replace(encoded, bitstream=bitstream), codec, is_final=False)
        size, own_size = file_size(self._as_written(bitstream)), file_size(self._as_written(encoded.bitstream))
        report("measure", 1.0)
        bpvf = 8 * size / (bitstream.n_vertices * bitstream.n_frames)
        return Trial(codec, size, bpvf, errors, Encoded(bitstream, encoded.permutation), own_size)

    def _as_written(self, bitstream: Bitstream) -> Bitstream:
        """What a file holds of an encode."""
        if self._is_bare:
            return dataclasses.replace(bitstream, is_bare=True)
        video = bitstream.video or self._memo("poster", lambda: poster_of(self._sequence))
        return dataclasses.replace(bitstream, video=video)

    def check(self, permutation: Integers, bitstream: Bitstream) -> None:
        """Decode a finished file's bitstream, if there is a bound, and measure every vertex.

        Args:
            permutation: ``(V,)`` that of its encode (`gvpipe.coding.codec.Encoded`).
            bitstream: as read from the file.

        Raises:
            InputError: a vertex is farther off than the bound.
        """
        if self._bound is None:
            return
        reader = open_reader(bitstream)
        largest = measure_errors(self._sequence.reordered(permutation, reader.faces), reader.read).max
        if not largest <= self._bound:
            raise InputError(
                f"a vertex of the finished file is {largest:g} off, {self._bound:g} were allowed; nothing was written; "
                "please report it, and allow more meanwhile"
            )


def _correct(bitstream: Bitstream, reference: MeshSequence, reader: FrameReader, bound: Bound) -> tuple[Bitstream, Errors]:
    """Add the corrections that the bound needs; return the bitstream, and the errors that are left."""
    if not isinstance(reader, RepeatedFramesReader):
        section, errors = encode_corrections(reference, reader, bound)
        return _with(bitstream, section), errors
    section, _ = encode_corrections(reader.repeated.distinct(reference), reader.distinct, bound)  # repeated frames: once
    bitstream = _with(bitstream, section)
    return bitstream, measure_errors(reference, open_reader(bitstream).read)


def _with(bitstream: Bitstream, section: bytes) -> Bitstream:
    return dataclasses.replace(bitstream, sections={**bitstream.sections, SECTION: section}) if section else bitstream


def _largest_coordinate(sequence: MeshSequence) -> float:
    return max(float(np.abs(block).max()) for _, block in sequence.chunks())
