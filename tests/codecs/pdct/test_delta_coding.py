"""Deltas as bytes, their errors within a clip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from clips import decode
from sequences import waving

from gvcodecs.pdct import Pdct
from gvcodecs.pdct.delta_coding import DeltaDecoder, DeltaEncoder
from gvcodecs.pdct.delta_kernels import UNIT, Layout
from gvpipe.container.cursor import Cursor


@pytest.mark.parametrize("scale", [0.3, 3.0, 1e3, 1e9])
def test_deltas_come_back(scale: float) -> None:
    rng = np.random.default_rng(8)
    layout = Layout(np.repeat([0, 1], [8, 90]), np.arange(98) % 16, np.array([0, 4, 8, 60, 98]))
    frames = np.rint(rng.laplace(0, scale, (6, 3, 98))).astype(np.int64)
    coder, sums = DeltaEncoder(layout), list[np.ndarray[Any, Any]]()
    for values in frames:
        contexts = np.zeros_like(values)
        for axis in range(3):
            coder.find_contexts(axis, values, contexts)
        delta = coder.predict() + UNIT * values
        coder.add_frame(contexts, values)
        assert np.array_equal(coder.sums, delta + (sums[-1] if sums else 0))
        sums.append(coder.sums.copy())
    decoder = DeltaDecoder(Cursor(coder.finish(), "x"), layout)
    assert np.array_equal(np.concatenate([decoder.take_frames(4), decoder.take_frames(2)]), sums)
    decoder.finish()


def test_errors_do_not_grow_within_a_clip() -> None:
    sequence = waving(14, 120)
    decoded = decode(Pdct(segment=120).encode(sequence).bitstream)
    per_frame = np.sqrt(((sequence.read(0, 120) - decoded) ** 2).sum(axis=2).mean(axis=1))
    assert per_frame[80:].max() < 1.5 * per_frame[:40].max()
