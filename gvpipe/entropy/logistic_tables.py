"""Tables of the logistic function for mixing probabilities in integers.

``squash`` maps a logit x (1 / 256 of a natural one) to a probability of 1 in 1 / 65536; ``stretch`` is its inverse. Both are
made of correctly rounded decimal arithmetic and integers, so that they are the same on every machine.
"""

from __future__ import annotations

import functools
from decimal import Context, Decimal

import numpy as np

from gvpipe.foundation.arrays import Int64

LIMIT = 2815  # largest logit, 1 / 256: a probability of 65535 / 65536
SPACING = 16  # logits between two exact values; between them squash is linear


def _knots() -> tuple[int, ...]:
    context = Context(prec=30)
    powers = [context.exp(context.divide(Decimal(-logit), Decimal(256))) for logit in range(-LIMIT - 1, 1, SPACING)]
    return tuple(int(context.divide(Decimal(1 << 24), 1 + power)) for power in powers)


KNOTS = _knots()  # 2**24 times the probability, rounded down, of every 16th logit, -LIMIT - 1 to 0


@functools.cache
def squash_table() -> Int64:
    """Probabilities ``(2 LIMIT + 1,)`` of logits ``-LIMIT..LIMIT``, 1..65535.

    Examples:
        >>> squash_table()[[0, 2815, 5630]].tolist()
        [1, 32768, 65535]
    """
    exact = np.array([*KNOTS, 0], np.int64)
    place, part = np.divmod(np.arange(LIMIT + 1) + 1, SPACING)  # of logits -LIMIT to 0
    below = (exact[place] * (SPACING - part) + exact[place + 1] * part) // SPACING
    lower = np.maximum(1, (below + 128) >> 8)
    return np.concatenate([lower, 65536 - lower[-2::-1]])


@functools.cache
def stretch_table() -> Int64:
    """Logits ``(4096,)`` of probabilities ``16 i + 8`` (of 65536), 1 / 256."""
    centres = 16 * np.arange(4096) + 8
    return np.asarray(np.searchsorted(squash_table(), centres) - LIMIT, np.int64)
