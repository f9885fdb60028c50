"""Other processes compile what a first encode is about to need; the file is the same, and so is a second one's time."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from folders import SAMPLES

from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.cores import count_cores
from gvpipe.foundation.isolation.python import run_python
from gvpipe.runtime import first_kernels
from gvpipe.runtime.kernel_form import Form, kernel_form

LEAST_FOUND = 0.9  # of the kernels that are listed

ENCODE = """
import sys, gvpipe
from gvpipe.runtime.machine_code import MachineCode
compiled, save = [], MachineCode.save_overload
MachineCode.save_overload = lambda self, sig, data: (compiled.append(sig), save(self, sig, data))
gvpipe.encode(sys.argv[1], sys.argv[2], "pdct")
print(len(compiled))
"""


@pytest.mark.parametrize("codec", codec_ids())
def test_the_list_names_kernels_that_there_are(codec: str) -> None:
    """Else tools/list_first_kernels.py is to be run again."""
    listed, found = first_kernels._listed()[codec], list(first_kernels._kernels(codec))
    assert len(listed) > 40 and len(found) == len(listed)


def test_an_unknown_codec_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_kernels, "count_cores", lambda: 8)
    monkeypatch.setattr(first_kernels, "start_python", lambda *_: pytest.fail("a process was started"))
    first_kernels._compile_beside.__wrapped__("another")


def test_what_is_there_is_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_kernels, "count_cores", lambda: 8)
    monkeypatch.setattr(first_kernels, "_is_wanted", lambda *_: False)
    monkeypatch.setattr(first_kernels, "start_python", lambda *_: pytest.fail("a process was started"))
    first_kernels._compile_beside.__wrapped__("mcgv")


@pytest.mark.slow
@pytest.mark.skipif(kernel_form() is not Form.QUICK or sys.platform == "win32", reason="it needs quick kernels, and locks")
def test_a_first_encode_is_helped(tmp_path: Path) -> None:
    if count_cores() < 2:
        pytest.skip("there is one core")
    compiled, files = [], []
    for name, alone in (("alone", "1"), ("helped", "")):
        (tmp_path / name).mkdir()
        video = tmp_path / f"{name}.mp4"
        variables = {"NUMBA_CACHE_DIR": str(tmp_path / name), first_kernels.VARIABLE: alone}
        ended = run_python(["-c", ENCODE, str(SAMPLES / "creature.npz"), str(video)], variables)
        assert not ended.status, ended.err
        compiled.append(int(ended.out))
        files.append(video.read_bytes())
    assert files[0] == files[1] and compiled[1] < 0.8 * compiled[0]  # on two idle cores about half
