"""The stored samples are what the script makes, and what their descriptions say."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import DOCS, SAMPLES

import gvpipe
from gvpipe.io.picture_rows import open_pictures
from gvpipe.mesh.topology import adjacency, components, unique_edges


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """The names of ``make_samples.py``, whose modules are gone afterwards."""
    monkeypatch.syspath_prepend(str(SAMPLES))
    yield runpy.run_path(str(SAMPLES / "make_samples.py"))
    for path in SAMPLES.glob("*.py"):
        sys.modules.pop(path.stem, None)


def test_ball_frames_are_what_the_script_makes(script: dict[str, Any], tmp_path: Path) -> None:
    script["write_obj_frames"](tmp_path, script["make_bounce"]())
    made = sorted(tmp_path.glob("*.obj"))
    assert [path.name for path in made] == [f"ball_{i:04d}.obj" for i in range(1, 25)]
    for path in made:  # rounded on writing, so that other versions of numpy write the same
        assert path.read_bytes() == (SAMPLES / "ball_frames" / path.name).read_bytes()


def test_the_splash_is_what_its_script_makes(script: dict[str, Any], tmp_path: Path) -> None:
    """Two drops become one and part, in frames some of which share their triangles."""
    runpy.run_path(str(SAMPLES / "splash.py"))["write_splash"](tmp_path)
    made = sorted(tmp_path.iterdir())
    assert [path.name for path in made] == [f"splash_{number:02d}.obj" for number in range(1, 13)]
    for path in made:  # rounded on writing, so that other versions of numpy write the same
        assert path.read_bytes() == (SAMPLES / "splash" / path.name).read_bytes()
    assert sum(path.stat().st_size for path in made) < 150_000
    capture = gvpipe.read_capture(SAMPLES / "splash")
    assert capture.lengths == (3, 1, 1, 1, 3, 1, 1, 1)
    pieces = [components(adjacency(shot.faces, shot.n_vertices))[0] for shot in capture.shots]
    assert pieces == [2, 2, 2, 1, 1, 1, 2, 2]
    assert all(2 * len(unique_edges(shot.faces)) == 3 * len(shot.faces) for shot in capture.shots)


def test_the_voice_is_what_the_script_makes(script: dict[str, Any], tmp_path: Path) -> None:
    script["write_voice"](tmp_path / "voice.wav")
    assert (tmp_path / "voice.wav").read_bytes() == (SAMPLES / "voice.wav").read_bytes()
    assert (SAMPLES / "voice.wav").stat().st_size < 60_000


def test_the_banner_is_what_the_script_makes(script: dict[str, Any], tmp_path: Path) -> None:
    """But for what H.264 loses; another version of x264 writes other bytes. The flag shows it in step."""
    wanted, stored = sys.modules["banner"].make_banner(), open_pictures(SAMPLES / "banner.mp4", 48)
    for frame in (0, 23, 47):
        assert np.abs(stored.pixels(frame).astype(int) - wanted[frame]).mean() < 6
    assert (SAMPLES / "banner.mp4").stat().st_size < 12_000
    gvpipe.encode(SAMPLES / "flag.npz", tmp_path / "flag.mp4", "pca", texture=SAMPLES / "banner.mp4")
    with gvpipe.open(tmp_path / "flag.mp4") as video:
        assert [image.name for image in video.images] == ["banner"]
        assert [material.base_color_texture is None for material in video.materials] == [False, True]
        assert video.images[0].pictures is not None
        assert np.array_equal(video.images[0].pictures.pixels(30), stored.pixels(30))  # copied


@pytest.mark.parametrize("name", ["creature", "morphs", "robot", "soft_body", pytest.param("cloth", marks=pytest.mark.slow)])
def test_stored_sequences_are_what_the_script_makes(name: str, script: dict[str, Any], tmp_path: Path) -> None:
    """To a centimetre: where both diagonals of a quad are equally long, the last bit of a sum chooses one."""
    script["write_npz"](tmp_path / "made.npz", script["SEQUENCES"][name]())
    made, stored = gvpipe.read(tmp_path / "made.npz"), gvpipe.read(SAMPLES / f"{name}.npz")
    assert made.shape == stored.shape and made.fps == stored.fps
    assert np.abs(made[:] - stored[:]).max() < 0.01
    assert (made.faces == stored.faces).all(axis=1).mean() > 0.99


def test_the_flag_is_what_the_script_makes(script: dict[str, Any]) -> None:
    made, stored = script["make_flag"](), gvpipe.read(SAMPLES / "flag.npz")
    errors = gvpipe.compare(made, stored)
    assert errors.max < 1e-6
    assert all(error["max"] is not None and error["max"] < 1e-3 for error in (errors.attributes | errors.fields).values())
    assert (stored.parts, stored.materials, stored.metadata) == (made.parts, made.materials, made.metadata)
    assert np.array_equal(np.asarray(stored.polygons), np.asarray(made.polygons))
    assert stored.images[0].media_type == "image/png"
    assert (SAMPLES / "flag.npz").stat().st_size < 500_000


@pytest.mark.parametrize(("name", "closed", "frames"), [("cloth", False, 110), ("creature", True, 102)])
def test_sample_is_one_piece_that_moves(name: str, closed: bool, frames: int) -> None:
    sequence = gvpipe.read(SAMPLES / f"{name}.npz")
    assert len(sequence) == frames
    assert components(adjacency(sequence.faces, sequence.n_vertices))[0] == 1
    sides = 3 * len(sequence.faces)
    n_edges = len(unique_edges(sequence.faces))
    assert (2 * n_edges == sides) == closed
    positions = sequence.read(0, frames)
    assert np.abs(np.diff(positions, axis=0)).max(axis=(1, 2)).min() > 0
    assert (SAMPLES / f"{name}.npz").stat().st_size < 2_000_000


def test_robot_parts_are_rigid_and_half_of_the_face_is_still() -> None:
    robot, face, pudding = (gvpipe.read(SAMPLES / f"{name}.npz") for name in ("robot", "morphs", "soft_body"))
    edges = unique_edges(robot.faces)
    lengths = np.linalg.norm(np.diff(robot.read(0, 120)[:, edges], axis=2)[:, :, 0], axis=2)  # (F, E)
    assert np.ptp(lengths, axis=0).max() < 3 * 2.0**-13  # their rounding
    moves = np.ptp(face.read(0, 96), axis=0).any(axis=1)
    assert 0.2 < moves.mean() < 0.5
    assert components(adjacency(pudding.faces, pudding.n_vertices))[0] == 1
    assert 2 * len(unique_edges(pudding.faces)) == 3 * len(pudding.faces)
    assert sum((SAMPLES / f"{name}.npz").stat().st_size for name in ("robot", "morphs", "soft_body")) < 700_000


def test_body_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Vertices that a model poses on demand become a file that holds them within a thousandth of the diagonal."""
    names = runpy.run_path(str(SAMPLES / "body_model.py"))
    monkeypatch.setattr(sys, "argv", ["body_model.py", str(tmp_path / "a.mp4")])
    names["main"]()
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    assert decoded.shape == (120, 960, 3) and decoded.fps == 60 and decoded.metadata.up_axis == "z"
    template, faces = names["limb"]()
    assert {tuple(sorted(face)) for face in decoded.faces.tolist()} == {tuple(sorted(face)) for face in faces.tolist()}
    posed = names["pose"](np.array([[0.0, 0.0]]), template)
    assert np.abs(decoded[0] - posed[0]).max() < 2e-3


def test_the_site_s_video_shows_the_sample() -> None:
    """It is of today's format, and as `tools/make_gallery.py` writes it."""
    source, video = gvpipe.read(SAMPLES / "creature.npz"), gvpipe.open(DOCS / "gallery" / "creature.mp4")
    assert video[:].shape == (source.n_frames, source.n_vertices, 3)
    assert np.abs(video[0] - source.read(0, 1)[0]).max() < 0.01
