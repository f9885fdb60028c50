"""A folder of machine code that others may write to is neither read nor written."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest

from gvpipe.foundation.isolation.python import run_python
from gvpipe.runtime import code_folder
from gvpipe.runtime.code_folder import _choose, _fault, own_folder, why_none

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no modes of folders")


@pytest.fixture
def wanted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What ``NUMBA_CACHE_DIR`` names: a folder of the user's."""
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    _choose.cache_clear()
    return folder


def test_it_is_made_for_the_user_alone(wanted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(wanted / "a" / "b"))
    old = os.umask(0)
    try:
        assert own_folder() == wanted / "a" / "b" / "gvpipe"
    finally:
        os.umask(old)
    for made in (wanted / "a", wanted / "a" / "b", wanted / "a" / "b" / "gvpipe"):
        assert stat.S_IMODE(made.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_a_folder_that_others_write_to(mode: int, wanted: Path) -> None:
    (wanted / "gvpipe").mkdir()
    (wanted / "gvpipe").chmod(mode)
    assert own_folder() is None
    assert why_none() == f"others may write to {wanted / 'gvpipe'}"


@pytest.mark.parametrize(("mode", "is_safe"), [(0o777, False), (0o1777, True), (0o755, True)])
def test_a_folder_above_that_others_write_to(mode: int, is_safe: bool, wanted: Path) -> None:
    wanted.chmod(mode)
    assert (own_folder() is not None) == is_safe
    assert (wanted / "gvpipe").exists() == is_safe


def test_a_link_into_a_folder_that_others_write_to(wanted: Path, tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o777)
    (wanted / "gvpipe").symlink_to(tmp_path / "shared")
    assert own_folder() is None


@pytest.mark.parametrize("owner", ["folder", "above"])
def test_a_folder_of_another_user(owner: str, wanted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_folder()
    monkeypatch.setattr(code_folder, "_owner", lambda found: 12345 if found.st_ino == (
        wanted / "gvpipe" if owner == "folder" else wanted).stat().st_ino else os.getuid())  # fmt: skip
    assert "belongs to another user" in _fault(wanted / "gvpipe")


@pytest.mark.parametrize(
    "variables",
    [
        {"NUMBA_CACHE_DIR": "cache"},
        {"XDG_CACHE_HOME": "cache"},
        {"HOME": "relative"},
    ],
    ids=str,
)
def test_relative_folders(variables: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Whatever the environment says, nothing is read from the current folder, and nothing is written to it."""
    monkeypatch.chdir(tmp_path)
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(code_folder, "BESIDE", Path("beside"))
    _choose.cache_clear()
    assert own_folder() is None and "is no absolute path" in why_none()
    assert list(tmp_path.iterdir()) == []
    _choose.cache_clear()


def test_no_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a user without a home and without a passwd entry: ``~`` stays as it is."""
    monkeypatch.chdir(tmp_path)
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    monkeypatch.setattr(code_folder, "BESIDE", tmp_path / "beside")
    _choose.cache_clear()
    assert own_folder() == tmp_path / "beside"
    assert [path.name for path in tmp_path.iterdir()] == ["beside"]
    _choose.cache_clear()


def test_settings_of_numba_in_the_current_folder(tmp_path: Path) -> None:
    """numba reads ``.numba_config.yaml`` there; it has no say."""
    pytest.importorskip("yaml")
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path}\n")
    code = "import os; os.chdir(os.environ['WHERE']); import numba; from gvpipe.runtime.code_folder import own_folder; "
    done = run_python(["-c", code + "print(own_folder())"], {"WHERE": str(tmp_path), "NUMBA_CACHE_DIR": ""})
    assert done.status == 0 and str(tmp_path) not in done.out.decode()
