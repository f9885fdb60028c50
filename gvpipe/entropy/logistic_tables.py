"""Tables of the logistic function for mixing probabilities in integers.

``squash`` maps a logit x (1 / 256 of a natural one) to a probability of 1 in 1 / 65536; ``stretch`` is its inverse. Both are
made of correctly rounded decimal arithmetic and integers, so that they are the same on every machine.
"""

from __future__ import annotations

import functools
from decimal import Context, Decimal

import numpy as np

from gvpipe.arrays import Int64

LIMIT = 2815  # largest logit, 1 / 256: a probability of 65535 / 65536
SPACING = 16  # logits between two exact values; between them squash is linear


@functools.cache
def squash_table() -> Int64:
    """Probabilities ``(2 LIMIT + 1,)`` of logits ``-LIMIT..LIMIT``, 1..65535.

    Examples:
        >>> squash_table()[[0, 2815, 5630]].tolist()
        [1, 32768, 65535]
    """
    context = Context(prec=30)
    knots = range(-LIMIT - 1, LIMIT + 2, SPACING)
    exact = []
    for knot in knots:
        power = context.exp(context.divide(Decimal(-knot), Decimal(256)))
        exact.append(int(context.divide(Decimal(1 << 24), 1 + power)))
    offset = np.arange(2 * LIMIT + 1) + 1
    below, part = offset // SPACING, offset % SPACING
    values = np.array(exact, np.int64)
    fine = values[below] * (SPACING - part) + values[np.minimum(below + 1, len(values) - 1)] * part
    return np.asarray(np.clip((fine // SPACING + 128) >> 8, 1, 65535), np.int64)


@functools.cache
def stretch_table() -> Int64:
    """Logits ``(4096,)`` of probabilities ``16 i + 8`` (of 65536), 1 / 256."""
    centres = 16 * np.arange(4096) + 8
    return np.asarray(np.searchsorted(squash_table(), centres) - LIMIT, np.int64)
