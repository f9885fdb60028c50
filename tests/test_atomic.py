"""A file that is being written takes its name when it is whole."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from pathlib import Path

import pytest

from gvpipe.atomic import atomic_path, lasting_folder, temporary_folder
from gvpipe.errors import OutputError


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
    assert Path(lasting_folder()).parent == tmp_path


def test_no_place_for_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = tmp_path / "missing"
    monkeypatch.setattr(tempfile, "tempdir", str(missing))
    with (
        pytest.raises(OutputError, match=f"cannot write {re.escape(str(missing))}: .*; create its folder first"),
        temporary_folder(),
    ):
        pass
