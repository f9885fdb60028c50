"""Examples in docstrings print what they say."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest

MODULES = [
    "gvpipe.coding.codec",
    "gvpipe.container.cursor",
    "gvpipe.entropy.block_coder",
    "gvpipe.entropy.grouping",
    "gvpipe.entropy.integers",
    "gvpipe.entropy.parametric_tables",
    "gvpipe.entropy.series",
    "gvpipe.foundation.errors",
    "gvpipe.mesh.lattice",
    "gvpipe.mesh.unique_rows",
    "gvpipe.metrics.comparison",
    "gvpipe.coding.quality_scale",
    "gvpipe.rate_control.step_search",
    "gvpipe.coding.repeated_frames",
    "gvpipe.model.sequence",
    "gvpipe.trajectory.still_vertices",
    "gvpipe.trajectory.temporal_neighbours",
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_print_what_they_say(name: str) -> None:
    result = doctest.testmod(import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.attempted and not result.failed
