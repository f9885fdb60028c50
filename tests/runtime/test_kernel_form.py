"""Where private parts of numba are missing or do something else, kernels are plain, and a warning says so once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gvpipe.runtime.kernel_form import Form, kernel_form

PROGRAM = """
import sys
{change}
import numpy as np
from gvpipe.runtime.compiled import compiled
from gvpipe.runtime.kernel_form import kernel_form
from gvpipe.runtime.lanes import LANES, load, same, store

@compiled
def squares(values, results):
    row = load(values, 0)
    store(results, 0, row * row + same(1.0))

results = np.zeros(LANES)
squares(np.arange(float(LANES)), results)
print(kernel_form().value, *results.astype(int))
"""
EXPECTED = "1 2 5 10 17 26 37 50"
CHANGES = {
    "a private name is gone": "sys.modules['gvpipe.runtime.borrowing'] = None",
    "the step of lowering is gone": "import numba.core.typed_passes as m; m.NativeLowering = m.NoPythonBackend",
    "caches are made otherwise": "import numba.core.caching as m; del m._Cache",
    "compile results are made otherwise": "import gvpipe.runtime.code_file as m; m.CompileResult = object",
    "rows are no vectors": "import gvpipe.runtime.vector_rows as m; m._vector = lambda lanes: None",
    "a result is wrong": "import operator, gvpipe.runtime.vector_rows as m; m.OPERATORS[operator.mul] = 'fadd'",
}
QUICKLY_TESTED = ("a private name is gone",)  # which compiles nothing


def _run(folder: Path, change: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
    program = folder / "program.py"  # numba keeps code of functions in files alone
    program.write_text(PROGRAM.format(change=change))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **variables}
    return subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True)


def test_kernels_are_quick_here() -> None:
    """Else all tests would run plain kernels, and nobody would know."""
    assert kernel_form() is (Form.PLAIN if os.environ.get("GVPIPE_KERNELS") == "plain" else Form.QUICK)


@pytest.mark.parametrize(
    "change",
    [pytest.param(text, id=name, marks=() if name in QUICKLY_TESTED else pytest.mark.slow) for name, text in CHANGES.items()],
)
def test_another_numba(change: str, tmp_path: Path) -> None:
    ended = _run(tmp_path, change, GVPIPE_KERNELS="", NUMBA_CACHE_DIR=str(tmp_path))
    assert ended.stdout.split(" ", 1) == ["plain", EXPECTED + "\n"], ended.stderr
    assert ended.stderr.count("plain ones give the same results") == 1 and ended.stderr.count("\n") == 1


@pytest.mark.slow
def test_plain_kernels_are_kept_in_the_private_folder(tmp_path: Path) -> None:
    for _ in range(2):
        ended = _run(tmp_path, GVPIPE_KERNELS="plain", NUMBA_CACHE_DIR=str(tmp_path))
        assert ended.stdout == f"plain {EXPECTED}\n" and not ended.stderr

    assert len(list(tmp_path.rglob("*.nbi"))) == 1


def test_a_form_that_there_is_not(tmp_path: Path) -> None:
    ended = _run(tmp_path, GVPIPE_KERNELS="fast")
    assert ended.returncode and ended.stderr.strip().endswith("GVPIPE_KERNELS is 'fast'; quick or plain is needed")
