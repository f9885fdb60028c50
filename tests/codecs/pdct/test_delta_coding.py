"""Deltas as bytes, their errors within a clip."""

from __future__ import annotations

import numpy as np
import pytest
from clips import decode
from sequences import waving

from gvcodecs.pdct import Pdct
from gvcodecs.pdct.delta_coding import DeltaDecoder, DeltaEncoder, Layout
from gvpipe.container.cursor import Cursor


@pytest.mark.parametrize("scale", [0.3, 3.0, 1e3, 1e9])
def test_deltas_come_back(scale: float) -> None:
    rng = np.random.default_rng(8)
    layout = Layout(np.repeat([0, 1], [8, 90]), np.arange(98) % 16)
    frames = np.rint(rng.laplace(0, scale, (6, 3, 98))).astype(np.int64)
    coder = DeltaEncoder(layout)
    for values in frames:
        contexts = np.stack([coder.contexts.of(axis, values) for axis in range(3)])
        for axis in range(3):
            coder.add_axis(contexts[axis], values[axis])
        coder.contexts.learn(contexts, values)
    decoder = DeltaDecoder(Cursor(coder.finish(), "x"), layout)
    for values in frames:
        found, contexts = np.zeros_like(values), np.zeros_like(values)
        for axis in range(3):
            contexts[axis] = decoder.contexts.of(axis, found)
            found[axis] = decoder.take_axis(contexts[axis])
        decoder.contexts.learn(contexts, found)
        assert np.array_equal(found, values)
    decoder.finish()


def test_errors_do_not_grow_within_a_clip() -> None:
    sequence = waving(14, 120)
    decoded = decode(Pdct(segment=120).encode(sequence).bitstream)
    per_frame = np.sqrt(((sequence.read(0, 120) - decoded) ** 2).sum(axis=2).mean(axis=1))
    assert per_frame[80:].max() < 1.5 * per_frame[:40].max()
