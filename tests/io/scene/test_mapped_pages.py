"""Pages of mapped files go back to the system; what they hold stays."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from gvpipe.io.scene.mapped_pages import forget_pages


def resident(path: Path) -> int:
    """Kilobytes of a mapped file that are in memory."""
    lines = Path("/proc/self/smaps").read_text().split("\n")
    at = next(number for number, line in enumerate(lines) if line.endswith(str(path)))
    return int(next(line for line in lines[at:] if line.startswith("Rss:")).split()[1])


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have no /proc")
def test_pages_are_given_back(tmp_path: Path) -> None:
    path = tmp_path / "numbers"
    values = np.arange(1 << 20, dtype=np.float32)
    values.tofile(path)
    mapped = np.memmap(path, np.float32, "r")
    assert float(mapped.sum()) > 0 and resident(path) > 1000
    assert forget_pages([str(path)]) >= values.nbytes
    assert resident(path) < 1000 and np.array_equal(mapped, values)
    assert forget_pages([str(tmp_path / "another"), ""]) == 0
    changed = np.memmap(path, np.float32, "c")  # pages that may hold changes are left alone
    changed[0] = 7
    del mapped
    forget_pages([str(path)])
    assert changed[0] == 7
