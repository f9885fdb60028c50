"""Integers of trellis coded residuals (`gvpipe.trajectory.trellis`) as range-coded words; tables learn, so none are sent."""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.block_coder import check_end, check_status
from gvpipe.foundation.arrays import Int64
from gvpipe.trajectory.contexts import ContextInputs, Residuals, first_means
from gvpipe.trajectory.trellis import first_tables


def encode_numbers(numbers: Int64, inputs: ContextInputs) -> bytes:
    """Return the words of the integers ``numbers (m, R)``, by rank, of all blocks of ``inputs``."""
    from gvpipe.entropy import range_encoder
    from gvpipe.entropy.learning_kernels import LearningStream
    from gvpipe.trajectory.trellis_kernels import code_residuals

    m, n_components = numbers.shape
    residuals = Residuals(numbers, np.zeros((n_components, m), np.int64), first_means(inputs))
    state, words, tables = range_encoder.start(), np.zeros(0, np.uint32), first_tables(len(inputs.powers) > 0)
    for b in range(len(inputs.blocks) - 1):
        room = range_encoder.MOST_WORDS * n_components * int(inputs.blocks[b + 1] - inputs.blocks[b]) + 1
        words = np.concatenate([words[: int(state[2])], np.zeros(room, np.uint32)])
        code_residuals(residuals, inputs, LearningStream(state, words, tables), b, b + 1, True)
    return range_encoder.finish(state, words).astype("<u4").tobytes()


class TrellisDecoder:
    """Mirror of `encode_numbers`.

    Args:
        data: the words.
        follows_trends: how contexts are found.
        name: of the section, for messages.

    Raises:
        CorruptFile: these are no whole words.
    """

    def __init__(self, data: bytes, follows_trends: bool, name: str) -> None:
        from gvpipe.entropy import range_decoder
        from gvpipe.entropy.learning_kernels import LearningStream

        self._cursor = Cursor(data, name)
        if len(data) % 4:
            raise self._cursor.corrupt("its words are not whole")
        words = np.frombuffer(data, "<u4").astype(np.uint32)
        self._stream = LearningStream(range_decoder.start(words), words, first_tables(follows_trends))

    def take(self, residuals: Residuals, inputs: ContextInputs, first_block: int, end_block: int) -> None:
        """Decode residuals of blocks, those before ``first_block`` being done; raises `CorruptFile` if they do not decode."""
        from gvpipe.trajectory.trellis_kernels import code_residuals

        if residuals.ranked.size and not len(self._stream.words):
            raise self._cursor.corrupt("it has no words")
        check_status(self._cursor, code_residuals(residuals, inputs, self._stream, first_block, end_block, False))

    def end(self) -> None:
        """Check that no word is left."""
        check_end(self._cursor, self._stream.state, self._stream.words)
