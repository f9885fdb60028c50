"""Frames, rates, parts and levels of detail, for every format that is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import grid

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.part import Part
from gvpipe.cli.choices import chosen, chosen_frames
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]
OUTPUTS = [
    *(f"out.{suffix}" for suffix in ("npz", "glb", "usda", "usdc", "usdz", "abc", "pc2", "mdd", "npy", "pvd", "vtkhdf")),
    *(f"out/f_%03d.{suffix}" for suffix in ("obj", "ply", "stl", "off", "glb", "vtp")),
]
CACHES = (".pc2", ".mdd", ".npy")
NEEDS = {".usda": "pxr", ".usdc": "pxr", ".usdz": "pxr", ".abc": "alembic3d", ".vtkhdf": "h5py"}


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sheets that wave, each a part, with numbers per vertex and per corner."""
    points, faces = grid(12)
    n, t = len(points), len(faces)
    waves = 0.1 * np.sin(np.arange(9)[:, None] + 4 * points[:, 0])
    one = np.broadcast_to(points, (9, n, 3)) + waves[:, :, None] * np.array([0, 0, 1])
    positions = np.concatenate([one, one + np.array([3, 0, 0])], axis=1).astype(np.float32)
    scene = MeshSequence(
        positions,
        np.concatenate([faces, faces + n]).astype(np.int32),
        24.0,
        {
            "heat": np.arange(2 * n, dtype=np.float32)[:, None],
            "uv": Attribute(positions[0, :, :2].copy(), "corner", "uv", np.concatenate([faces, faces + n]).reshape(-1)),
        },
        fields={"height": Field(positions[:, :, 2].copy())},
        parts=(Part("left", (0, n), (0, t)), Part("right", (n, 2 * n), (t, 2 * t))),
    )
    path = tmp_path_factory.mktemp("choices") / "sheets.mp4"
    gvpipe.encode(scene, path, "pca", quality=90, attributes={"heat": "exact"})
    return path


@pytest.mark.parametrize("command", ["decode", "convert"])
@pytest.mark.parametrize("output", OUTPUTS)
def test_choices(run: Run, video: Path, tmp_path: Path, output: str, command: str) -> None:
    pytest.importorskip(NEEDS.get(Path(output).suffix, "numpy"))
    target = tmp_path / output
    ended = run(command, video, target, "--frames", "2:5", "--fps", 12, "--part", "right", "--lod", 1, "--json")
    assert ended.status == 0, ended.err
    values = json.loads(ended.out)
    assert "level of detail 1 leaves out uv" in values["notes"]
    level = gvpipe.open(video).level(1)
    n, t = values["vertices"], values["triangles"]
    assert (values["start"], values["stop"], values["frames"], values["fps"]) == (2, 5, 3, 12)
    assert (n, t) == (np.ptp(level.parts[1].vertices), np.ptp(level.parts[1].triangles)) and t < 2 * 11 * 11
    mesh = None
    if target.suffix in CACHES:
        mesh = tmp_path / "mesh.obj"
        assert run(command, video, mesh, "--frames", "2:3", "--part", "right", "--lod", 1).status == 0
    is_pattern = "%" in output
    found = gvpipe.read(target, mesh=mesh, fps=12 if is_pattern or target.suffix in (".pc2", ".npy") else None)
    expected = level.read(2, 5)[:, slice(*level.parts[1].vertices)]
    assert found.n_frames == 3 and found.fps == pytest.approx(12) and len(found.faces) == t
    ours, theirs = (np.asarray(each.read(0, 3))[:, each.faces] for each in (found, MeshSequence(expected, _faces(level))))
    assert np.abs(_sorted(ours) - _sorted(theirs)).max() < 1e-6
    if is_pattern:
        names = [target.name % number for number in (2, 3, 4)]
        assert [path.name for path in sorted(target.parent.glob(f"*{target.suffix}"))] == names


def test_textures(run: Run, video: Path, tmp_path: Path) -> None:
    target = f"{tmp_path / 'out.openvat'}/"
    ended = run("decode", video, target, "--frames", "2:5", "--fps", 12, "--part", "right", "--lod", 1)
    assert ended.status == 0 and "12 frames per second" in ended.err and "level of detail 1 leaves out uv" in ended.err
    info = json.loads((tmp_path / "out.openvat" / "out-remap_info.json").read_text())
    assert info["os-remap"]["Frames"] == 3
    level = gvpipe.open(video).level(1)
    assert len(gvpipe.read(tmp_path / "out.openvat" / "out.glb").faces) == np.ptp(level.parts[1].triangles)


def _faces(level: MeshSequence) -> Any:
    """Triangles of the second part."""
    part = level.parts[1]
    return level.faces[slice(*part.triangles)] - part.vertices[0]


def _sorted(corners: Any) -> Any:
    """Corners ``(n, T, 3, 3)`` of triangles, by the place of these in the first frame."""
    centres = np.round(corners[0].mean(axis=1), 4)
    return corners[:, np.lexsort(centres.T)].mean(axis=2)


def test_what_survives_a_level(run: Run, video: Path, tmp_path: Path) -> None:
    whole, level = gvpipe.open(video).sequence(), gvpipe.open(video).level(2)
    assert [part.name for part in level.parts] == ["left", "right"] and set(level.attributes) == {"heat"}
    heat = np.asarray(level.attributes["heat"])[:, 0].astype(int)
    assert np.abs(level.read(0, 9) - whole.read(0, 9)[:, heat]).max() < 0.02
    assert np.array_equal(level.fields["height"].read(3, 5), whole.fields["height"].read(3, 5)[:, heat])
    decoded = gvpipe.decode(video, 3, 5, lod=2)
    assert np.array_equal(decoded.fields["height"].read(0, 2), level.fields["height"].read(3, 5))
    ended = run("convert", video, tmp_path / "a.npz", "--lod", 99)
    assert ended.status == 1 and "no level of detail 99" in ended.err
    gvpipe.write(whole, tmp_path / "plain.npz")
    ended = run("convert", tmp_path / "plain.npz", tmp_path / "b.npz", "--lod", 1)
    assert ended.status == 1 and "--codec pca" in ended.err and not (tmp_path / "b.npz").exists()


def test_frames_are_named_once(run: Run, video: Path, tmp_path: Path) -> None:
    assert chosen_frames(None, None, "3:") == (3, None) and chosen_frames(2, 5, None) == (2, 5)
    for command in ("decode", "convert"):
        assert run(command, video, tmp_path / "a.npz", "--frames", "2:5", "--stop", 4).status == 2


def test_progress_does_not_step_back() -> None:
    told: list[float] = []
    points, faces = grid(3)
    sequence = MeshSequence(np.repeat(points[None].astype(np.float32), 4, axis=0), faces.astype(np.int32))
    watched = chosen(sequence, (), None, "write", lambda _, part: told.append(part))
    for frame in (1, 0, 1, 2, 3):  # a look ahead, then all
        watched.read(frame, frame + 1)
    assert told == [0.5, 0.5, 0.5, 0.75, 1.0]
