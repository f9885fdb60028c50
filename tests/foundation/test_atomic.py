"""A file that is being written takes its name when it is whole."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from pathlib import Path

import pytest

from gvpipe.foundation import atomic
from gvpipe.foundation.atomic import atomic_path, lasting_folder, temporary_folder, unnamed_path
from gvpipe.foundation.errors import OutputError
from gvpipe.foundation.isolation.python import run_python


def test_atomic_path(tmp_path: Path) -> None:
    target = tmp_path / "a.mp4"
    target.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert target.read_text() == "old"
    with atomic_path(target) as temporary:
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".mp4")
        temporary.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert os.listdir(tmp_path) == ["a.mp4"]
    with pytest.raises(OutputError, match="not an ordinary file"), atomic_path(tmp_path):
        pass


@pytest.mark.parametrize("has_unnamed", [True, False])
def test_unnamed_path(has_unnamed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not has_unnamed:
        monkeypatch.delattr(os, "O_TMPFILE", raising=False)
    target = tmp_path / "a.mp4"
    for old in ("", "old"):
        with pytest.raises(KeyboardInterrupt), unnamed_path(target) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt
        assert [path.read_text() for path in tmp_path.iterdir()] == [old] * bool(old)
        with unnamed_path(target) as temporary:
            temporary.write_text("longer than old")
            temporary.write_text("old")
        assert target.read_text() == "old"
        assert os.listdir(tmp_path) == ["a.mp4"]
    (tmp_path / "plain").touch()
    assert target.stat().st_mode == (tmp_path / "plain").stat().st_mode
    with pytest.raises(OutputError, match="not an ordinary file"), unnamed_path(tmp_path):
        pass
    with pytest.raises(OutputError, match="create its folder first"), unnamed_path(tmp_path / "missing" / "a.mp4"):
        pass


@pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="this system has no files without names")
def test_a_file_without_a_name(tmp_path: Path) -> None:
    try:
        os.close(os.open(tmp_path, os.O_TMPFILE | os.O_RDWR))
    except OSError:
        pytest.skip("this file system has no files without names")
    with unnamed_path(tmp_path / "a.mp4") as temporary:
        temporary.write_text("half")
        assert not os.listdir(tmp_path)  # so a process that is killed here leaves nothing


@pytest.mark.skipif(sys.platform == "win32", reason="permissions and links of POSIX")
def test_atomic_path_keeps_links_and_permissions(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.npz").symlink_to(tmp_path / "real" / "a.npz")
    with atomic_path(tmp_path / "link.npz") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.npz").is_symlink()
    (tmp_path / "plain").touch()
    assert (tmp_path / "real" / "a.npz").stat().st_mode == (tmp_path / "plain").stat().st_mode
    with pytest.raises(OutputError, match="not an ordinary file"), atomic_path("/dev/null"):
        pass


def test_a_temporary_folder_vanishes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt), temporary_folder() as folder:
        Path(folder, "a.mp4").write_text("half")
        assert [name.startswith("gvpipe-") for name in os.listdir(tmp_path)] == [True]
        raise KeyboardInterrupt
    assert not os.listdir(tmp_path)


def test_a_lasting_folder_stays_for_a_day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt), lasting_folder() as folder:
        Path(folder, "a.html").touch()
        raise KeyboardInterrupt
    assert not os.listdir(tmp_path)
    with lasting_folder() as first:
        Path(first, "a.html").touch()
    (tmp_path / "gvpipe-play-file").touch()
    with lasting_folder() as second:
        pass
    assert os.path.exists(Path(first, "a.html"))
    day_before_last = time.time() - 2 * 24 * 3600
    for name in os.listdir(tmp_path):
        os.utime(tmp_path / name, (day_before_last, day_before_last))
    with lasting_folder() as third:
        pass
    assert sorted(os.listdir(tmp_path)) == sorted(["gvpipe-play-file", os.path.basename(third)]) and second != third


def test_no_place_for_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = tmp_path / "missing"
    monkeypatch.setattr(tempfile, "tempdir", str(missing))
    with (
        pytest.raises(OutputError, match=f"cannot write {re.escape(str(missing))}: .*; create its folder first"),
        temporary_folder(),
    ):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="there are no locks of folders")
def test_what_killed_processes_leave_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the next command; folders that a process uses stay, as do young ones, and those of others."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    long_ago = time.time() - 3600
    code = "import os, signal, tempfile; from gvpipe.foundation.atomic import temporary_folder as t\nwith t() as f:\n"
    code += "    open(os.path.join(f, 'left'), 'w').close(); os.kill(os.getpid(), signal.SIGKILL)"
    assert run_python(["-c", code], {"TMPDIR": str(tmp_path)}).status == -9
    (left,) = tmp_path.iterdir()
    atomic.remove_abandoned_folders()
    assert left.exists()  # it is young
    os.utime(left, (long_ago, long_ago))
    (tmp_path / "gvpipe-link").symlink_to(left)
    (tmp_path / "other-folder").mkdir()
    with atomic.temporary_folder() as used:
        for path in (used, tmp_path / "other-folder"):
            os.utime(path, (long_ago, long_ago))
        code = "from gvpipe.cli import main; main()"
        run_python(["-c", code, "codecs"], {"TMPDIR": str(tmp_path)})
        assert os.path.isdir(used) and not left.exists() and (tmp_path / "other-folder").exists()
