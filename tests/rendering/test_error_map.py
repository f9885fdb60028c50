"""Errors are measured in percent of the diagonal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.colours import error_colours
from gvpipe.rendering.error_map import ErrorMap


def test_error_map_measures_in_percent_of_the_diagonal() -> None:
    sequence = waving(8, 12)
    moved = np.array(sequence.positions[:])
    moved[5, 17] += [0.03, 0.0, 0.04]
    reference = np.asarray(sequence.positions[:1])[0]
    diagonal = float(np.linalg.norm(np.ptp(reference, axis=0)))
    errors = ErrorMap(sequence, replace(sequence, positions=moved), range(12))
    assert errors.largest == pytest.approx(100 * 0.05 / diagonal, rel=1e-5)
    assert np.flatnonzero(errors.values(5)).tolist() == [17] and errors.values(5)[17] == pytest.approx(1.0)
    assert not errors.values(4).any()
    assert ErrorMap(sequence, replace(sequence, positions=moved), range(12), largest=10.0).values(5)[17] < 1
    assert ErrorMap(sequence, sequence, range(12)).values(0).max() == 0
    legend = errors.legend((256, 200))
    assert len(legend) == 200 and 40 < legend.shape[1] < 128
    bar = legend[:, 14].astype(int)  # one column of the colour bar, top to bottom
    ends = np.rint(255 * error_colours(np.array([1.0, 0.0]))).astype(int)
    assert [np.abs(bar - end).sum(axis=1).min() for end in ends] == [0, 0]
    assert np.abs(bar - ends[0]).sum(axis=1).argmin() < np.abs(bar - ends[1]).sum(axis=1).argmin()


def test_reference_that_does_not_fit_is_named_with_both_numbers(sequence: MeshSequence, tmp_path: Path) -> None:
    for other, words in (
        (waving(8, 11), "has 64 vertices.*has 72"),
        (replace(waving(8, 9), name="short"), "has 9 frames.*has 11"),
    ):
        with pytest.raises(InputError, match=words):
            gvpipe.render(sequence, tmp_path / "a.png", error_of=other)
