"""`gvpipe warmup`: kernels compile before they are needed, and are found after."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from folders import ROOT

from gvpipe.cli import warmup
from gvpipe.cli.commands import cli
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.runtime import code_folder, machine_code


def test_only_what_is_looked_for_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="add --installed"):
        warmup.warm_up(portable=True)
    monkeypatch.setattr(machine_code, "PORTABLE", {})
    with pytest.raises(InputError, match="leave out --portable"):
        warmup.warm_up(installed=True, portable=True)
    monkeypatch.setattr(code_folder, "own_folder", lambda: None)
    with pytest.raises(InputError, match="set NUMBA_CACHE_DIR"):
        warmup.warm_up()


def test_a_task_that_fails_is_one_line() -> None:
    with pytest.raises(GvpipeError, match=r"^compiling for nonesuch failed: .*'nonesuch'"):
        warmup._run_task("nonesuch", {})


def test_the_installation_gets_files_whole_or_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The processes have a folder of their own, and the settings of the portable processor."""
    given: dict[str, str] = {}

    def run(environment: dict[str, str], progress: object) -> None:
        given.update(environment)
        folder = Path(environment["NUMBA_CACHE_DIR"], "gvpipe")
        folder.mkdir()
        (folder / "some.kernel-0.nbc").write_bytes(b"code")

    monkeypatch.setattr(machine_code, "INSTALLED", tmp_path / "kernels")
    monkeypatch.setattr(machine_code, "PORTABLE", dict.fromkeys(machine_code.PORTABLE, ("some-processor", ())))
    monkeypatch.setattr(warmup, "_run_tasks", run)
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "other.kernel-0.nbc").write_bytes(b"older")
    done = warmup.warm_up(installed=True, portable=True)
    assert (done.files, done.new, done.size) == (2, 1, 9)
    assert (tmp_path / "kernels" / "some.kernel-0.nbc").read_bytes() == b"code"
    assert (given["NUMBA_CPU_NAME"], given["NUMBA_CPU_FEATURES"]) == ("some-processor", "")


def test_the_command_prints_what_was_done(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(warmup, "warm_up", lambda *arguments: warmup.Warmed("folder", 3, 1, 4096, 0.5))
    cli(["warmup", "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out) == {"folder": "folder", "files": 3, "new": 1, "size": 4096, "seconds": 0.5}
    cli(["warmup"], standalone_mode=False)
    assert capsys.readouterr().out == "folder: 3 files of machine code, 1 new, 4.1 kB; 0.5 s\n"


@pytest.mark.slow
def test_nothing_is_left_to_compile(tmp_path: Path) -> None:
    """After the warm-up, the first lines of the README find all their machine code."""
    warmup.warm_up()
    for command in (["encode", str(ROOT / "samples" / "creature.npz"), "creature.mp4"], ["decode", "creature.mp4", "back.npz"]):
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
        done = subprocess.run(
            [sys.executable, "-m", "gvpipe", *command, "--verbose"],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0 and "compiling" not in done.stderr, done.stderr
