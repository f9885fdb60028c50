"""``gvpipe convert``, and what ``decode`` shares with it: nothing is lost, and no input is replaced."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]


@pytest.fixture
def two(sequence: MeshSequence, tmp_path: Path) -> Path:
    """The tube beside a copy of it, each a part."""
    other = sequence.read(0, 11) + np.array([5, 0, 0], np.float32)
    n, t = sequence.n_vertices, len(sequence.faces)
    scene = MeshSequence(
        np.concatenate([sequence.read(0, 11), other], axis=1),
        np.concatenate([sequence.faces, sequence.faces + n]),
        sequence.fps,
        parts=(Part("left", (0, n), (0, t)), Part("right", (n, 2 * n), (t, 2 * t))),
    )
    gvpipe.write(scene, tmp_path / "two.npz")
    return tmp_path / "two.npz"


def test_there_and_back(run: Run, two: Path, tmp_path: Path) -> None:
    assert run("convert", two, tmp_path / "a.glb").status == 0
    ended = run("convert", tmp_path / "a.glb", tmp_path / "b.npz", "--json")
    values = json.loads(ended.out)
    assert (ended.status, ended.err) == (0, "")
    given, found = gvpipe.read(two), gvpipe.read(tmp_path / "b.npz")
    assert np.abs(found.read(0, 11) - given.read(0, 11)).max() < 1e-6 and np.array_equal(found.faces, given.faces)
    assert [part.name for part in found.parts] == ["left", "right"]
    shape = (values["frames"], values["vertices"], values["triangles"], values["fps"], values["start"], values["stop"])
    assert shape == (11, 144, 256, 25.0, 0, 11) and values["output"] == str(tmp_path / "b.npz")


def test_parts_frames_and_rate(run: Run, two: Path, tmp_path: Path) -> None:
    options = ("--part", "right", "--start", 3, "--stop", 5, "--fps", 12)
    ended = run("convert", two, tmp_path / "out" / "f_%02d.obj", *options)
    assert ended.status == 0 and ended.out == f"{two} -> {tmp_path / 'out' / 'f_%02d.obj'} (2 frames, 72 vertices)\n"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["f_03.obj", "f_04.obj"]
    assert np.array_equal(gvpipe.read(tmp_path / "out").read(0, 2), gvpipe.read(two).read(3, 5)[:, 72:])
    run("convert", two, tmp_path / "c.npz", *options)
    assert gvpipe.read(tmp_path / "c.npz").fps == 12


def test_decode_has_parts_and_a_rate(run: Run, two: Path, tmp_path: Path) -> None:
    gvpipe.encode(two, tmp_path / "two.mp4", preset="ultrafast", clusters=3, gop=4)
    whole = gvpipe.decode(tmp_path / "two.mp4")
    ended = run("decode", tmp_path / "two.mp4", tmp_path / "d.npz", "--part", "left", "--fps", 50, "--json")
    assert json.loads(ended.out)["fps"] == 50 and json.loads(ended.out)["vertices"] == 72
    found = gvpipe.read(tmp_path / "d.npz")
    assert found.fps == 50 and np.array_equal(found.read(0, 11), whole.read(0, 11)[:, slice(*whole.parts[0].vertices)])
    ended = run("decode", tmp_path / "two.mp4", tmp_path / "e.npz", "--part", "lift")
    assert ended.status == 1 and "there are: left, right; did you mean 'left'" in ended.err
    assert not (tmp_path / "e.npz").exists()


def test_far_positions_keep_their_digits(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    """With a progress bar, which watches the frames, and without."""
    exact = sequence.read(0, 11).astype(np.float64) + np.array([1e7 + 0.123456789, 0, 0])
    np.savez(tmp_path / "far.npz", vertices=exact, faces=sequence.faces)
    for name, more in (("a", ()), ("b", ("--verbose",))):
        assert run("convert", tmp_path / "far.npz", tmp_path / f"{name}.npz", *more).status == 0
        with np.load(tmp_path / f"{name}.npz") as held:
            assert np.array_equal(held["vertices"], exact)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("two.npz", "is the input too"),
        ("x.mp4", "use gvpipe encode"),
        ("x.docx", ".docx"),
        ("x.obj", "%04d"),
    ],
)
def test_refusals(run: Run, two: Path, tmp_path: Path, target: str, words: str) -> None:
    before = two.read_bytes()
    ended = run("convert", two, tmp_path / target)
    assert ended.status == 1 and words in ended.err and ended.err.count("\n") == 1
    assert two.read_bytes() == before and sorted(path.name for path in tmp_path.iterdir()) == ["two.npz"]


def test_frames_are_not_replaced_by_themselves(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(replace(sequence, fps=30), tmp_path / "walk" / "%02d.obj")
    for source in ("walk", "walk/*.obj", "walk/%02d.obj"):
        for target in ("walk/%02d.obj", "walk"):
            ended = run("convert", tmp_path / source, tmp_path / target)
            assert ended.status == 1 and "choose another folder" in ended.err
    assert run("convert", tmp_path / "walk", tmp_path / "walk" / "all.npz").status == 0
    assert np.array_equal(gvpipe.read(tmp_path / "walk" / "all.npz").read(0, 11), sequence.read(0, 11))
