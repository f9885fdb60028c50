"""Integer logarithms: looked up, or worked out, they are exact."""

from __future__ import annotations

import numpy as np

from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.context_kernels import _log
from gvpipe.trajectory.contexts import PER_OCTAVE, ContextInputs, context_inputs


def test_logarithms_are_exact() -> None:
    """The largest n with 2 ** (n / 16), rounded down, <= 64 value + 1, above and below every border."""
    inputs = _no_inputs()
    borders = (inputs.roots[(inputs.roots > 1) & (inputs.roots < 1 << 58)] // 64)[:, None] + np.arange(-2, 3)
    rng = np.random.default_rng(0)
    values = [0, 1, (1 << 14) - 1, 1 << 14, (1 << 21) - 1, 1 << 21, *borders.ravel()]
    values += [int(2**x) for x in rng.uniform(0, 51, 2000)]
    for value in values:
        if value >= 0:
            n = _log(int(value), inputs) + 6 * PER_OCTAVE
            power = (64 * int(value) + 2) ** PER_OCTAVE  # in whole numbers: 2 ** (n / 16) < x + 1 <= 2 ** ((n + 1) / 16)
            assert 1 << n < power <= 1 << (n + 1)


def test_sums_that_overflow_are_looked_up_within_the_table() -> None:
    """Millions of the largest residuals in a block wrap around; the next block's contexts are contexts all the same."""
    inputs = _no_inputs()
    assert _log(-(1 << 42), inputs) == _log(0, inputs) < _log(1, inputs)


def _no_inputs() -> ContextInputs:
    """Those of no vectors, which have the tables of logarithms."""
    none = np.zeros(0, np.int32)
    causal = CausalOrder(none, np.zeros(1, np.int32), none, np.zeros(0), np.zeros(0), none, np.zeros(1, np.int32), True)
    return context_inputs(causal, 0, np.zeros(0, np.int64), 0)
