"""A write that fails says so in one line and leaves nothing; a series says which frames are whole."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import OutputError
from gvpipe.model.sequence import MeshSequence

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no limits of file sizes")
LIMIT = 20_000  # bytes of a file, as if the disk were full then
SCENES = [".vtkhdf", ".abc", ".pvd", ".usdc", ".usda", ".usdz", ".glb", ".npz", ".pc2", ".mdd", ".npy", ".openvat"]


@pytest.fixture
def large() -> MeshSequence:
    """Frames of noise, each larger than `LIMIT`."""
    positions = np.random.default_rng(0).normal(size=(3, 4000, 3)).astype(np.float32)
    return MeshSequence(positions, np.arange(3999 // 3 * 3, dtype=np.int32).reshape(-1, 3))


@pytest.fixture
def full_disk() -> Iterator[None]:
    """No file of this process, and of those that it starts, gets larger than `LIMIT`."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.usefixtures("new_processes")
@pytest.mark.parametrize("suffix", SCENES)
def test_a_full_disk(suffix: str, large: MeshSequence, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    request.getfixturevalue("full_disk")
    with pytest.raises(OutputError, match=rf"^cannot write .*{suffix}.*; ") as caught:
        gvpipe.write(large, folder / f"a{suffix}")
    assert "\n" not in str(caught.value) and ".gvpipe-" not in str(caught.value)
    assert not list(folder.iterdir())


@pytest.mark.usefixtures("new_processes")
@pytest.mark.parametrize("suffix", [".vtkhdf", ".abc", ".pvd"])
def test_an_old_file_stays(suffix: str, large: MeshSequence, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    path = tmp_path / f"a{suffix}"
    gvpipe.write(large.part(0, 1), path)
    before = {each: each.read_bytes() for each in tmp_path.rglob("*") if each.is_file()}
    request.getfixturevalue("full_disk")
    with pytest.raises(OutputError):
        gvpipe.write(large, path)
    assert {each: each.read_bytes() for each in tmp_path.rglob("*") if each.is_file()} == before


def test_a_series_without_a_whole_frame(large: MeshSequence, tmp_path: Path, full_disk: None) -> None:
    with pytest.raises(OutputError, match=r"^cannot write .*; "):
        gvpipe.write(large, tmp_path / "a" / "b" / "%04d.ply")
    assert not list(tmp_path.iterdir())


def test_a_series_says_which_frames_are_whole(sequence: MeshSequence, tmp_path: Path) -> None:
    (tmp_path / "a_0012.ply").mkdir()
    with pytest.raises(OutputError, match=r"a_0012.*; frames 10 to 11 are whole, the others are not there$"):
        gvpipe.write(sequence, tmp_path / "a_%04d.ply", start=10)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a_0010.ply", "a_0011.ply", "a_0012.ply"]


@pytest.mark.usefixtures("new_processes")
@pytest.mark.parametrize("suffix", [".vtkhdf", ".abc"])
def test_a_library_that_dies(suffix: str, sequence: MeshSequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gvpipe.io.library import writing_process

    monkeypatch.setattr(writing_process, "WORKER", "gvpipe.foundation.version")  # it ends without a word
    with pytest.raises(OutputError, match=rf"^cannot write .*a{suffix}: its library died of it"):
        gvpipe.write(sequence, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".vtkhdf", ".abc"])
def test_what_the_process_writes(suffix: str, tmp_path: Path) -> None:
    """Positions far from the origin and fields: as they are in this process."""
    from gvpipe.io.alembic import writer
    from gvpipe.io.simulation import vtkhdf_writer

    positions = np.random.default_rng(0).normal(size=(5, 9, 3)) + 1e7
    fields = {"heat": np.random.default_rng(1).normal(size=(5, 9)).astype(np.float32)}
    sequence = MeshSequence(positions, np.arange(9, dtype=np.int32).reshape(3, 3), 25, fields=fields)
    write_here = vtkhdf_writer.write_here if suffix == ".vtkhdf" else writer.write_here
    here = write_here(sequence, tmp_path / f"here{suffix}", "here")
    there = gvpipe.write(sequence, tmp_path / f"there{suffix}")
    assert list(here) == there
    a, b = (gvpipe.read(tmp_path / f"{name}{suffix}") for name in ("here", "there"))
    np.testing.assert_array_equal(a.read_absolute(0, 5), b.read_absolute(0, 5))
    np.testing.assert_array_equal(a.fields["heat"].read(0, 5), b.fields["heat"].read(0, 5))
    if suffix == ".vtkhdf":
        np.testing.assert_allclose(b.read_absolute(0, 5), positions, rtol=0, atol=1e-6)  # float32 about its origin
