"""Blender opens what is written: positions of every frame, meshes, materials and pictures.

bpy runs in a process of its own, by this Python or by the one that the environment variable ``BPY_PYTHON`` names.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from folders import DATA, GOLDEN
from sequences import wrinkled

import gvpipe

N_FRAMES = 5
PYTHON = os.environ.get("BPY_PYTHON") or (sys.executable if importlib.util.find_spec("bpy") else "")
SCRIPT = Path(__file__).parents[1] / "blender_positions.py"
SOURCES = ("", "gltf/CesiumMan_Binary/CesiumMan.glb", "abc/mix1_abc/mix1_abc.abc", "usd/bunny_walk_skel/bunny_walk_skel.usdc")
TOLERANCE = 1e-6  # of the diagonal

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not PYTHON, reason="bpy is not there: pip install bpy")]


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("suffix", ["glb", "usdc", "usdz", "abc"])
def test_blender_has_every_position(tmp_path: Path, source: str, suffix: str) -> None:
    if source and not (DATA / "assets" / source).exists():
        pytest.skip("the shared data are not there")
    sequence = gvpipe.read(DATA / "assets" / source).part(0, N_FRAMES) if source else scene(N_FRAMES)
    gvpipe.write(sequence, tmp_path / f"a.{suffix}")
    found = by_blender(tmp_path / f"a.{suffix}", sequence.fps)
    unit = 1.0 if suffix == "abc" else sequence.metadata.metres_per_unit or 1.0
    is_turned = suffix == "abc" or sequence.metadata.up_axis != "z"  # Blender takes Alembic's scenes as Y up
    for ours, theirs in zip(sequence.read_absolute(0, N_FRAMES), found["positions"], strict=True):
        expected = unit * (ours[:, [0, 2, 1]] * [1, -1, 1] if is_turned else ours)
        assert farthest(expected[np.unique(sequence.faces)], theirs) < TOLERANCE
    assert len(found["meshes"]) == len({(part.name, part.parent, part.vertices) for part in sequence.parts})
    drawn = {sequence.materials[part.material].name for part in sequence.parts if part.material is not None}
    assert len(found["materials"]) == len(drawn)
    assert len(found["pictures"]) == (0 if suffix == "abc" else len(sequence.images))
    assert len(found["uv"]) == sum(each.kind == "uv" for each in sequence.attributes.values())


@pytest.mark.parametrize("suffix", ["glb", "usdc"])
def test_blender_moves_skeletons(tmp_path: Path, suffix: str) -> None:
    with gvpipe.open(GOLDEN / "mcgv-1-rigid.mp4") as video:
        sequence, skin = video.sequence(), video.skin()
    gvpipe.write(sequence, tmp_path / f"a.{suffix}", skin=skin)
    found = by_blender(tmp_path / f"a.{suffix}", sequence.fps)["positions"]
    expected = sequence.read(0, N_FRAMES)[:, :, [0, 2, 1]] * [1, -1, 1]
    assert found.shape == expected.shape
    bound = 1e-5 if suffix == "glb" else 1e-4  # USD has scales as half floats
    assert np.linalg.norm(found - expected, axis=2).max() < bound * np.linalg.norm(np.ptp(expected[0], axis=0))


@pytest.mark.parametrize("suffix", ["glb", "usdc"])
@pytest.mark.parametrize("is_rigid", [False, True])
def test_blender_moves_corrective_shapes(tmp_path: Path, suffix: str, is_rigid: bool) -> None:
    sequence = wrinkled()
    skin = gvpipe.skin(sequence, joints=2, target_kg=0.2, rigid=is_rigid)
    gvpipe.write(sequence, tmp_path / f"a.{suffix}", skin=skin)
    found = by_blender(tmp_path / f"a.{suffix}", sequence.fps)["positions"]
    for ours, theirs in zip(skin.read(0, N_FRAMES), found, strict=True):
        assert len(skin.shapes) and farthest(ours[:, [0, 2, 1]] * [1, -1, 1], theirs) < max(1e-4, 0.1 * skin.error)


def by_blender(path: Path, fps: float) -> Any:
    """What Blender reads; see `SCRIPT`."""
    target = path.with_suffix(".npz")
    command = [PYTHON, str(SCRIPT), str(path), str(target), str(N_FRAMES), repr(float(fps))]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    return np.load(target)


def farthest(a: Any, b: Any) -> float:
    """Largest distance of a point of one set from the other set, as a part of the diagonal; formats split vertices."""
    from scipy.spatial import cKDTree

    diagonal = float(np.linalg.norm(np.ptp(a, axis=0)))
    return max(float(np.max(cKDTree(x).query(y)[0])) for x, y in ((a, b), (b, a))) / diagonal
