"""A range-coded stream as kernels take it: words, and the edges of every context's frequency table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.foundation.arrays import Int64

if TYPE_CHECKING:
    from gvpipe.entropy.block_kernels import BlockStream


def open_stream(cursor: Cursor, tables: Sequence[Int64]) -> BlockStream:
    """Return the stream that is the rest of a section.

    Args:
        cursor: at its first word.
        tables: frequencies of each context, none for those that are empty.

    Raises:
        CorruptFile: the rest is no whole number of words.
    """
    from gvpipe.entropy import range_decoder
    from gvpipe.entropy.block_kernels import BlockStream

    edges, sizes = range_decoder.edges_of_all(tables)
    if cursor.left % 4:
        raise cursor.corrupt("its words are not whole")
    words = cursor.array("<u4", cursor.left // 4).astype(np.uint32)
    return BlockStream(range_decoder.start(words), words, edges, sizes)
