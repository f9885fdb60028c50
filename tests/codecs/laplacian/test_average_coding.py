"""The average as bytes."""

from __future__ import annotations

import dataclasses

import numpy as np
from tubes import CODING, surface_of, tube

from gvcodecs.laplacian.average_coding import decode_average, encode_average
from gvcodecs.laplacian.mesh_scale import edge_lengths


def test_the_average_comes_back_to_its_precision() -> None:
    points, surface = surface_of(tube(12, 40))
    unit = edge_lengths(points, surface.edges).mean()
    sizes = []
    for step in (1 / 4, 1 / 64):
        coding = dataclasses.replace(CODING, average_step=step)
        data, theirs = encode_average(5 + points, surface, coding)
        assert np.array_equal(decode_average(data, surface, coding), theirs)
        wanted = (points - points.mean(axis=0)) / unit
        lengths, expected = (edge_lengths(p, surface.edges) for p in (theirs, wanted))
        assert np.abs(lengths - expected).mean() < step
        sizes.append(len(data))
    assert sizes[0] < 0.7 * sizes[1]
