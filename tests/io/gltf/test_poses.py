"""Skins, morph targets and curves against numbers worked out by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import CORNERS, morphing, skinned, square_file

import gvpipe
from gvpipe.foundation.errors import InputError

TURN = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # a quarter turn about z


@pytest.mark.parametrize("n_sets", [1, 2])
def test_skins_blend_their_joints(tmp_path: Path, n_sets: int) -> None:
    file = skinned(n_sets)
    still = gvpipe.read(file.write(tmp_path / "still.glb"))
    np.testing.assert_allclose(still[0], CORNERS, atol=1e-6)
    moves = [(1 + i, "translation", [0, 1], [[10, 0, 0], (np.eye(3)[i] + [10, 0, 0]).tolist()], "LINEAR") for i in range(3)]
    file.clip(*moves)
    read = gvpipe.read(file.write(tmp_path / "a.glb"), fps=2)
    full = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.25, 0.25]])
    for frame, part in enumerate((0, 0.5, 1)):
        np.testing.assert_allclose(read[frame], CORNERS + part * full, atol=1e-6)


def test_a_joint_that_the_skin_lacks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="node 0 shows a mesh that uses joint 3, but its skin has 3"):
        gvpipe.read(skinned(joint=3).write(tmp_path / "a.glb"))


def test_joints_turn_about_themselves(tmp_path: Path) -> None:
    file = skinned()
    file.tree["nodes"][1]["rotation"] = TURN
    assert np.allclose(gvpipe.read(file.write(tmp_path / "a.glb"))[0][0], [10, -10, 0])


def test_morph_targets(tmp_path: Path) -> None:
    file = morphing()
    assert np.array_equal(gvpipe.read(file.write(tmp_path / "rest.glb"))[0], CORNERS + np.array([0, 0, 0.5], np.float32))
    file.tree["nodes"][0]["weights"] = [0, 1]
    second = CORNERS + np.array([[0, 0, 0]] * 2 + [[4, 0, 0]] + [[0, 0, 0]], np.float32)
    assert np.array_equal(gvpipe.read(file.write(tmp_path / "node.glb"))[0], second)
    file.clip((0, "weights", [0, 1, 2], [[0, 0], [1, 0], [1, 2]], "LINEAR"))
    read = gvpipe.read(file.write(tmp_path / "a.glb"), fps=2)
    np.testing.assert_allclose(read[1], CORNERS + np.array([0, 0, 0.5]))
    np.testing.assert_allclose(read[3], second + np.array([0, 0, 1]))


CURVES: dict[str, tuple[str, Any, float]] = {
    "step": ("STEP", [[0, 0, 0], [8, 0, 0]], 0),
    "linear": ("LINEAR", [[0, 0, 0], [8, 0, 0]], 2),
    # value t^3 of 8 from tangents 0 and 24 a second
    "spline": ("CUBICSPLINE", [[0, 0, 0], [0, 0, 0], [0, 0, 0], [24, 0, 0], [8, 0, 0], [0, 0, 0]], 8 * 0.25**3),
}


@pytest.mark.parametrize(("mode", "values", "expected"), CURVES.values(), ids=CURVES.keys())
def test_curves_at_a_quarter(tmp_path: Path, mode: str, values: Any, expected: float) -> None:
    file = square_file()
    file.clip((0, "translation", [0, 1], values, mode))
    read = gvpipe.read(file.write(tmp_path / "a.glb"), fps=4)
    np.testing.assert_allclose(read[1][0], [expected, 0, 0], atol=1e-6)
    assert read[4][0].tolist() == [8, 0, 0]


@pytest.mark.parametrize("sign", [1, -1])
def test_rotations_take_the_shorter_arc(tmp_path: Path, sign: int) -> None:
    file = square_file()
    file.clip((0, "rotation", [0, 1], [[0, 0, 0, 1], (sign * np.array(TURN)).tolist()], "LINEAR"))
    read = gvpipe.read(file.write(tmp_path / "a.glb"), fps=3)
    np.testing.assert_allclose(read[1][1], [np.cos(np.pi / 6), np.sin(np.pi / 6), 0], atol=1e-6)


def test_the_parent_of_a_moving_node_may_be_still_and_its_child_too(tmp_path: Path) -> None:
    file = square_file()
    file.tree["nodes"] = [
        {"children": [1], "scale": [2, 2, 2]}, {"children": [2]}, {"mesh": 0, "translation": [1, 0, 0]}
    ]  # fmt: skip
    file.clip((1, "translation", [0, 1], [[0, 0, 0], [0, 5, 0]], "LINEAR"))
    read = gvpipe.read(file.write(tmp_path / "a.glb"), fps=1)
    np.testing.assert_allclose(read[1], 2 * (CORNERS + np.array([1, 5, 0])))


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        ((0, "translation", [0, 1, 0.5], [[0, 0, 0]] * 3, "LINEAR"), "its times do not rise"),
        ((0, "translation", [0, np.nan], [[0, 0, 0]] * 2, "LINEAR"), "its times do not rise, or are not finite"),
        ((0, "translation", [0, 1], [[0, 0, 0]] * 3, "LINEAR"), "has 9 numbers for 2 keys of 3; 6 are needed"),
        ((0, "translation", [0, 1], [[0, 0, 0], [np.inf, 0, 0]], "LINEAR"), "values that are not finite"),
        ((0, "translation", [0, 1], [[0, 0, 0]] * 2, "SMOOTH"), "interpolated by 'SMOOTH'"),
        ((7, "translation", [0, 1], [[0, 0, 0]] * 2, "LINEAR"), "'node' is 7"),
    ],
)
def test_damaged_curves(tmp_path: Path, curve: Any, words: str) -> None:
    file = square_file()
    file.clip(curve)
    with pytest.raises(InputError, match=words):
        gvpipe.read(file.write(tmp_path / "a.glb"))
