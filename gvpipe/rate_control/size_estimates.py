"""Sizes of files by a part of the work of encoding them, beside a file that there is.

A codec may estimate its own (`Codec.estimate_bytes`). Else it encodes the first frames, as does the codec of the file that
there is: sizes of two codecs have nearly the same quotient there as of all frames. Two encodes compare as if at equal error::

    bytes * (error / other error)^ELASTICITY
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, cast

from gvpipe.coding.codec import Codec, Memo
from gvpipe.coding.registry import estimate_sequence
from gvpipe.foundation.elementary import power
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.trials import Trial, Trials
from gvpipe.runtime.forks import kept

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

SAMPLE = 50  # frames: laplacian by pca differs by at most 9 % from the same of all frames (ten sequences)
ELASTICITY = 0.45  # bytes are about proportional to the error to minus this power


def at_error(n_bytes: float, error: float, wanted: float) -> float:
    """Bytes as if an encode left the error that is wanted, any unit."""
    return n_bytes * power(error / wanted, ELASTICITY) if error > 0 and wanted > 0 else float(n_bytes)


class SizeEstimates:
    """Estimates bytes of codecs, without corrections and what lies beside positions.

    Args:
        sequence: to be encoded.
        reference: a file of it.
        progress: called with the stages of every encode.
        is_bare: whether the file will be of the bare layout.
    """

    def __init__(self, sequence: MeshSequence, reference: Trial, progress: Progress | None, is_bare: bool) -> None:
        self._sequence, self._reference, self._progress, self._is_bare = sequence, reference, progress, is_bare
        self._quality = reference.codec.quality
        self._memos: dict[str, Memo] = {}

    def of(self, codec: Codec, most: float) -> float:
        """Bytes of the codec's file with the reference's error; any number above ``most`` where they are clearly more.

        Infinite where the codec cannot encode it.
        """
        wanted = cast("Codec", dataclasses.replace(cast("DataclassInstance", codec), quality=self._quality))
        try:
            own = estimate_sequence(wanted, self._sequence, most, self._progress, self._memos.setdefault(codec.id, Memo()))
            return self._by_sample(wanted) if own is None else own
        except InputError:
            return math.inf

    def _by_sample(self, codec: Codec) -> float:
        trial, sample = self._encode_sample(codec), self._sample
        expected = at_error(trial.own_bytes, trial.errors.rmse, sample.errors.rmse)
        return expected * self._reference.own_bytes / sample.own_bytes

    @kept
    def _sample(self) -> Trial:
        """The reference's first frames."""
        return self._encode_sample(self._reference.codec)

    def _encode_sample(self, codec: Codec) -> Trial:
        part = self._sequence.part(0, min(SAMPLE, self._sequence.n_frames)).bare()
        return Trials(codec, part, None, self._progress, None, self._is_bare)(codec.quality)
