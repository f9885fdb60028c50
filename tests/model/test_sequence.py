"""Sequences slice by frame, are values that move, and take lists and numbers of NumPy."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.model.sequence import MeshSequence

untyped: Any = gvpipe  # where calls break the annotations on purpose


def test_repr(sequence: MeshSequence, video: Path) -> None:
    shape = "11 frames of 72 vertices, 128 triangles, 25 fps"
    assert repr(sequence) == f"<MeshSequence sequence: {shape}>"
    assert repr(gvpipe.open(video)) == f"<Player {video}: codec mcgv, {shape}>"
    far = MeshSequence(np.array([[[5e6, 0, 0], [5e6 + 0.3, 0, 1], [5e6 + 0.1, 1, 0]]]), np.array([[0, 1, 2]]), 30.0, name="far")
    assert repr(far) == "<MeshSequence far: 1 frame of 3 vertices, 1 triangle, 30 fps, origin (5000000, 0, 0)>"


def test_slices(frames: Any) -> None:
    whole = frames[:]
    assert whole.shape == frames.shape == (11, 72, 3) and whole.dtype == np.float32
    assert np.array_equal(frames[3], whole[3]) and np.array_equal(frames[-1], whole[10])
    assert np.array_equal(frames[np.int64(4)], whole[4])
    for key in (slice(2, 5), slice(None, None, 3), slice(8, 2, -2), slice(-3, None), slice(5, 5), slice(7, 3), slice(5, 2, 2)):
        assert np.array_equal(frames[key], whole[key]) and frames[key].shape == whole[key].shape
    assert np.array_equal(np.stack(list(frames)), whole)
    for index in (11, -12):
        with pytest.raises(IndexError, match=f"frame {index}"):
            frames[index]
    for wrong in (1.5, "a", None):
        with pytest.raises(TypeError):
            frames[wrong]


def test_sequences_are_values_that_move(sequence: MeshSequence) -> None:
    for same in (copy.copy(sequence), copy.deepcopy(sequence), pickle.loads(pickle.dumps(sequence))):
        assert np.array_equal(same[:], sequence[:]) and same != sequence and len({same, sequence}) == 2


def test_numbers_of_numpy_are_numbers(sequence: MeshSequence, tmp_path: Path) -> None:
    made = untyped.MeshSequence(sequence.positions, sequence.faces, np.float32(24))
    assert gvpipe.encode(made, tmp_path / "o.mp4", preset="ultrafast", clusters=3).fps == 24.0 and type(made.fps) is float


def test_a_list_is_an_array() -> None:
    assert untyped.MeshSequence([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], [[0, 1, 2]]).shape == (1, 3, 3)
