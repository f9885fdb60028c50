"""Positions of large archives stay in a temporary file: the same frames, errors and files, in bounded memory."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.io.npz import archive as npz
from gvpipe.io.npz.fields import NpzFrames
from gvpipe.model.sequence import MeshSequence


@pytest.fixture(autouse=True)
def small_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(npz, "LARGE", 1000)


def test_frames_are_those_of_the_archive(sequence: MeshSequence, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    gvpipe.write(sequence, path)
    read = gvpipe.read(path)
    assert isinstance(read.positions, NpzFrames) and read.positions.shape == (11, 72, 3)
    copied = pickle.loads(pickle.dumps(read))
    path.rename(tmp_path / "b.npz")  # what was read stays
    assert np.array_equal(read.read(0, 11), sequence.read(0, 11)) and np.array_equal(read[7], sequence[7])
    with pytest.raises(InputError, match=r"a\.npz"):  # a copy reads by the name
        copied.read(0, 1)
    gvpipe.encode(read, tmp_path / "lazy.mp4", "pca")
    gvpipe.encode(sequence, tmp_path / "memory.mp4", "pca")
    assert (tmp_path / "lazy.mp4").read_bytes() == (tmp_path / "memory.mp4").read_bytes()


def test_workers_read_the_archive(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / "a.npz")
    for source, name in ((gvpipe.read(tmp_path / "a.npz"), "object"), (tmp_path / "a.npz", "path")):
        gvpipe.encode(source, tmp_path / f"{name}.mp4", "pca", segment=4, workers=2)
    gvpipe.encode(sequence, tmp_path / "one.mp4", "pca", segment=4)
    assert len({(tmp_path / f"{name}.mp4").read_bytes() for name in ("object", "path", "one")}) == 1


@pytest.mark.parametrize("turn", [np.asfortranarray, lambda values: values.astype(">f4")])
def test_other_layouts_of_float32(turn: object, sequence: MeshSequence, tmp_path: Path) -> None:
    assert callable(turn)
    np.savez(tmp_path / "a.npz", vertices=turn(sequence.read(0, 11)), faces=sequence.faces, fps=25.0)
    assert np.array_equal(gvpipe.read(tmp_path / "a.npz").read(3, 9), sequence.read(3, 9))


@pytest.mark.parametrize("kind", [np.float64, np.float16, np.int32])
def test_other_types_are_loaded(kind: type, sequence: MeshSequence, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=sequence.read(0, 11).astype(kind), faces=sequence.faces, fps=25.0)
    assert not isinstance(gvpipe.read(tmp_path / "a.npz").positions, NpzFrames)


def test_bad_numbers_are_found_when_they_are_read(sequence: MeshSequence, tmp_path: Path) -> None:
    frames = sequence.read(0, 11).copy()
    frames[6, 5, 1] = np.nan
    np.savez_compressed(tmp_path / "a.npz", vertices=frames, faces=sequence.faces, fps=25.0)
    with pytest.raises(InputError, match=r"a\.npz: frame 6, vertex 5"):
        gvpipe.encode(tmp_path / "a.npz", tmp_path / "a.mp4", "pca")
    assert not (tmp_path / "a.mp4").exists()


def test_damage_is_found_at_once(sequence: MeshSequence, tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", vertices=sequence.read(0, 11), faces=sequence.faces, fps=25.0)
    data = bytearray((tmp_path / "a.npz").read_bytes())
    data[400:420] = bytes(20)
    (tmp_path / "a.npz").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.npz"):
        gvpipe.read(tmp_path / "a.npz")
