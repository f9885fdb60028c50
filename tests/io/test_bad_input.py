"""Bad input of every kind that is read: one line that names the file, and nothing is left behind."""

from __future__ import annotations

import os
import shutil
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from input_files import EXTRAS, KINDS, MARK, NEED_MESH, PACKAGES, TEXTS, is_installed, read_all

from gvpipe import io
from gvpipe.errors import InputError

SUFFIXES = [
    pytest.param(name, marks=pytest.mark.skipif(not is_installed(name), reason="its package is missing")) for name in KINDS
]
PREFIXES = 8  # of a file, that are tried
OTHERS = [b"\x89PNG\r\n\x1a\n" + bytes(60), b'{"a": 1}', b"hello\n" * 30, b"PK\x03\x04" + bytes(90), bytes(400)]


@pytest.fixture(scope="session")
def originals(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder per kind, with a file ``a.KIND`` that is as it should be."""
    made = {}
    for suffix, make in KINDS.items():
        if is_installed(suffix):
            made[suffix] = tmp_path_factory.mktemp(suffix[1:])
            make(made[suffix])
    return made


@pytest.fixture
def copied(originals: dict[str, Path], tmp_path: Path) -> Any:
    """Return what copies the files of a kind into this test's folder, and gives the path of the main one."""

    def copy(suffix: str) -> Path:
        shutil.copytree(originals[suffix], tmp_path / "in")
        return tmp_path / "in" / f"a{suffix}"

    return copy


@contextmanager
def refused(path: Path, *words: str) -> Iterator[None]:
    """One line with the file's name and all words is raised."""
    with pytest.raises(InputError) as caught:
        yield
    message = str(caught.value)
    assert "\n" not in message and len(message) < 700 and path.stem in message, message
    assert [word for word in words if word not in message] == [], message


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_as_it_should_be(copied: Any, suffix: str) -> None:
    sequence = read_all(copied(suffix))
    assert sequence.n_vertices == 4 and np.isclose(sequence.read_absolute(0, 1).max(), MARK)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_and_pipes(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    path.write_bytes(b"")
    with refused(path, "is empty"):
        read_all(path)
    if hasattr(os, "mkfifo"):
        path.unlink()
        os.mkfifo(path)
        with refused(path, "no ordinary file"):
            read_all(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_cut(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    if suffix == ".obj":  # any whole lines are a mesh, so its last lines are left out
        path.write_text(path.read_text().split("f ")[0])
    whole = path.read_bytes()
    for part in range(1, PREFIXES):
        path.write_bytes(whole[: len(whole) * part // PREFIXES])
        with refused(path):
            read_all(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_another_format_under_the_name(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    for data in OTHERS:
        path.write_bytes(data)
        with refused(path):
            read_all(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_not_finite(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    if suffix == ".npz":
        with np.load(path) as archive:
            held = dict(archive)
        held["vertices"] = np.where(held["vertices"] == MARK, np.nan, held["vertices"])
        np.savez(path, **held)
    else:
        assert sum(spoil(file) for file in path.parent.rglob("*") if file.is_file() and file.name != "base.obj")
    with refused(path if suffix not in (".series", ".pvd") else path.with_name("s0.vtu")):
        read_all(path)


def spoil(path: Path) -> bool:
    """Put a NaN in place of every marked coordinate; whether there was one."""
    data = path.read_bytes()
    for mark, nan in [(struct.pack(form, MARK), struct.pack(form, np.nan)) for form in ("<f", ">f", "<d", ">d")]:
        if mark in data and path.suffix not in TEXTS:
            path.write_bytes(data.replace(mark, nan))
            return True
    path.write_bytes(data.replace(str(MARK).encode(), b"nan"))
    return str(MARK).encode() in data


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_names_that_do_not_exist(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    there = {".fbx": "'Lift'", ".gltf": "'Lift'", ".glb": "there are: "}
    with refused(path, "clip", there.get(suffix, "has no clips")):
        read_all(path, clip="Lfit")
    with refused(path, "are none of its"):
        read_all(path, frames=(90, 95))


@pytest.mark.parametrize("suffix", [suffix for suffix in PACKAGES if suffix != ".fbx"])
def test_extra_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str) -> None:
    monkeypatch.setitem(sys.modules, PACKAGES[suffix], None)
    (tmp_path / f"a{suffix}").write_bytes(b"something")
    with refused(tmp_path / f"a{suffix}", f"pip install 'gvpipe[{EXTRAS[PACKAGES[suffix]]}]'"):
        io.read(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", NEED_MESH)
def test_caches_without_their_mesh(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    with refused(path, "--mesh"):
        io.read(path)
    with refused(path, "gone.obj"):
        io.read(path, mesh=path.with_name("gone.obj"))


@pytest.mark.parametrize(
    ("suffix", "side"), [(".gltf", "a.bin"), (".series", "s0.vtu"), (".case", "a.geo"), (".pvd", "s0.vtu")]
)
def test_missing_side_files(copied: Any, suffix: str, side: str) -> None:
    path = copied(suffix)
    gone = path.with_name(side)
    gone.unlink()
    with refused(path, gone.name, "missing"):
        read_all(path)
