"""Real files against positions of other programs, vertex by vertex; skipped where they are absent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from folders import DATA

import gvpipe
from gvpipe.io.gltf import read_poses

ASSETS = DATA / "assets" / "gltf"
FOUR_INFLUENCES = "gdx_pbrTest_8influences"  # its own pose is three.js's, which drops four of eight influences
NAMES = sorted(path.name for path in ASSETS.iterdir()) if ASSETS.exists() else []


def asset_file(name: str) -> Path:
    return next(path for path in (ASSETS / name).iterdir() if path.suffix in (".gltf", ".glb"))


@pytest.mark.slow
@pytest.mark.skipif(not NAMES, reason="no shared data")
@pytest.mark.parametrize("name", NAMES)
def test_positions_agree_with_other_programs(name: str) -> None:
    path = asset_file(name)
    parts = gvpipe.read(path).parts
    with np.load(DATA / "reference" / f"{name}.npz") as reference:
        clips, times, expected = reference["clips"], reference["times"], reference["positions"]
        names = dict(zip([int(clip) for clip in np.unique(clips) if clip >= 0], reference["clip_names"], strict=True))
    for clip in np.unique(clips):
        if clip < 0 and name == FOUR_INFLUENCES:
            continue
        positions = read_poses(path, str(names.get(int(clip), ""))).at(times[clips == clip].astype(np.float64))
        if parts:
            positions = np.concatenate([positions[:, slice(*part.vertices)] for part in parts], axis=1)
        diagonal = np.linalg.norm(np.ptp(expected[clips == clip].reshape(-1, 3), axis=0))
        assert np.linalg.norm(positions - expected[clips == clip], axis=2).max() < 1e-5 * diagonal


@pytest.mark.skipif(not NAMES, reason="no shared data")
@pytest.mark.parametrize("name", NAMES)
def test_assets_come_back_from_what_is_written(name: str, tmp_path: Path) -> None:
    sequence = gvpipe.read(asset_file(name))
    sequence = sequence.part(0, min(len(sequence), 12))
    gvpipe.write(sequence, tmp_path / "a.glb")
    read = gvpipe.read(tmp_path / "a.glb")
    size = np.abs(sequence[0]).max()
    np.testing.assert_allclose(read.read(0, len(read)), sequence.read(0, len(sequence)), atol=4e-7 * size)
    assert read.parts == sequence.parts and read.materials == sequence.materials and read.images == sequence.images
    assert np.array_equal(read.faces, sequence.faces) and set(read.attributes) == set(sequence.attributes)
    for key, values in sequence.attributes.items():
        np.testing.assert_allclose(np.asarray(read.attributes[key]), np.asarray(values), atol=1e-6)
