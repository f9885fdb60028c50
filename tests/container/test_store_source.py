"""Files in a store that fsspec knows: here its own in memory."""

from __future__ import annotations

import importlib.util
import multiprocessing
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.container.store_source import FIRST
from gvpipe.foundation.errors import CorruptFile, InputError, NotGeometryVideo, TruncatedFile

fsspec = pytest.importorskip("fsspec")
WAVES = waving(30, 120)
NOISE = np.random.default_rng(1).normal(0, 0.05, (120, 900, 3)).astype(np.float32)  # so that a file exceeds the first request
SEQUENCE = gvpipe.MeshSequence(WAVES.read(0, 120) + NOISE, WAVES.faces, 24.0)


@pytest.fixture
def store() -> Iterator[Any]:
    found = fsspec.filesystem("memory")
    yield found
    found.rm("/films", recursive=True)


@pytest.fixture(scope="module")
def stream(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("store") / "a.mp4"
    gvpipe.encode(SEQUENCE, path, "pca", quality=95, segment=20, stream=True)
    assert path.stat().st_size > FIRST
    return path


@pytest.mark.parametrize("layout", ["stream", "plain"])
def test_frames_are_those_of_the_file(store: Any, stream: Path, tmp_path: Path, layout: str) -> None:
    gvpipe.restream(stream, tmp_path / "a.mp4", layout)
    store.pipe("/films/a.mp4", (tmp_path / "a.mp4").read_bytes())
    with gvpipe.open("memory://films/a.mp4") as video, gvpipe.open(stream) as own:
        for k in (119, 0, 60):
            assert np.array_equal(video[k], own[k])
        again = pickle.loads(pickle.dumps(video))
        assert np.array_equal(again[7], own[7])
    assert gvpipe.read("memory://films/a.mp4").shape == (120, 900, 3)
    result = CliRunner().invoke(cli, ["info", "memory://films/a.mp4"])
    assert result.exit_code == 0 and "120 frames" in result.output


def test_only_what_is_asked_for_comes(store: Any, stream: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store.pipe("/films/a.mp4", stream.read_bytes())
    asked: list[int] = []
    fetch = type(store).cat_file

    def counted(self: Any, path: str, start: int = 0, end: int = 0) -> bytes:
        asked.append(end - start)
        return bytes(fetch(self, path, start=start, end=end))

    monkeypatch.setattr(type(store), "cat_file", counted)
    with gvpipe.open("memory://films/a.mp4") as video:
        _ = video[119]
    assert asked[0] == FIRST and sum(asked) < stream.stat().st_size


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="the system does not fork")
def test_after_a_fork(store: Any, stream: Path) -> None:
    store.pipe("/films/a.mp4", stream.read_bytes())
    with gvpipe.open("memory://films/a.mp4") as video:
        first = video[0]
        with multiprocessing.get_context("fork").Pool(1) as pool:
            assert np.array_equal(pool.apply(video.__getitem__, (0,)), first)


def test_what_cannot_be_read(store: Any, stream: Path) -> None:
    data = stream.read_bytes()
    with pytest.raises(InputError, match=r"memory://films/none\.mp4: no such file; check the address"):
        gvpipe.open("memory://films/none.mp4")
    store.pipe("/films/cut.mp4", data[:-1])
    with pytest.raises(TruncatedFile, match=r"^memory://films/cut\.mp4: "):
        gvpipe.open("memory://films/cut.mp4")
    store.pipe("/films/other.mp4", b"none" * 10)
    with pytest.raises(NotGeometryVideo, match="download it first"):
        gvpipe.open("memory://films/other.mp4")
    store.mkdir("/films/folder.mp4")
    with pytest.raises(InputError, match=r"folder\.mp4 cannot be read: it is a folder; check the address"):
        gvpipe.open("memory://films/folder.mp4")


def test_another_file_in_its_place(store: Any, stream: Path) -> None:
    store.pipe("/films/a.mp4", stream.read_bytes())
    with gvpipe.open("memory://films/a.mp4") as video:
        _ = video[0]
        store.pipe("/films/a.mp4", bytes(10 * FIRST))
        with pytest.raises(CorruptFile, match="another file by now; open it again"):
            _ = video[119]


def test_stores_that_need_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """A store whose package is missing, and no fsspec at all."""
    missing = next(name for name, needs in (("oss", "ossfs"), ("gs", "gcsfs")) if importlib.util.find_spec(needs) is None)
    with pytest.raises(InputError, match=f"{missing}://x/a.mp4 cannot be read: .*nstall"):
        gvpipe.open(f"{missing}://x/a.mp4")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[remote\]'"):
        gvpipe.open("s3://x/a.mp4")
