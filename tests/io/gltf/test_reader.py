"""Still files are frames, animated files are sequences; both whatever the file's name."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pytest
from gltf_files import CORNERS, TWO, File, square_file, take_apart
from mesh_files import same_bits

import gvpipe
from gvpipe.foundation.errors import InputError


def waving() -> File:
    """A square that moves along x in clip "go" (2 s), and up in clip "up" (1 s)."""
    file = square_file()
    file.clip((0, "translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [4, 0, 0]], "LINEAR"), name="go")
    file.clip((0, "translation", [0.5, 1], [[0, 0, 0], [0, 3, 0]], "STEP"), name="up")
    return file


def test_a_clip_is_a_sequence(tmp_path: Path) -> None:
    read = gvpipe.read(waving().write(tmp_path / "a.glb"))
    assert read.shape == (61, 4, 3) and read.fps == 30
    along = np.interp(np.arange(61) / 30, [0, 1, 2], [0, 1, 4])
    np.testing.assert_allclose(read.read(0, 61), CORNERS + along[:, None, None] * [1, 0, 0], atol=1e-6)
    assert same_bits(read.read(40, 43), read.read(0, 61)[40:43])
    assert read.metadata.up_axis == "y" and read.metadata.metres_per_unit == 1 and read.metadata.texts["clip"] == "go"
    assert read.notes == (
        "its keys are 1 s apart; it was sampled at 30 frames per second (fps, --fps)",
        "clip 'go' was read; others of the file: up (clip, --clip)",
    )


def test_clip_and_rate_are_chosen(tmp_path: Path) -> None:
    path = waving().write(tmp_path / "a.glb")
    read = gvpipe.read(path, fps=8, clip="up")
    assert read.shape[0] == 5 and read.fps == 8 and read.metadata.start_time == 0.5
    assert read.read(0, 5)[:, 0, 1].tolist() == [0, 0, 0, 0, 3]
    with pytest.raises(InputError, match="a.glb: it has no clip 'ap'; there are: 'go', 'up'"):
        gvpipe.read(path, clip="ap")
    with pytest.raises(InputError, match="it has no clip 'go'; it has none"):
        gvpipe.read(square_file().write(tmp_path / "still.glb"), clip="go")
    np.savez(tmp_path / "a.npz", vertices=CORNERS[None], faces=TWO.reshape(2, 3))
    with pytest.raises(InputError, match="has no clips"):
        gvpipe.read(tmp_path / "a.npz", clip="go")


@pytest.mark.parametrize(("gap", "rate"), [(1 / 24, 24), (1 / 59.94, 59.94), (0.2, 30), (1e-3, 30)])
def test_the_rate_is_that_of_the_keys(tmp_path: Path, gap: float, rate: float) -> None:
    file = square_file()
    times = [0, gap, 1 + gap] if gap >= 0.01 else [0, 0.5, 0.5 + gap]  # a jump is no rate
    file.clip((0, "translation", times, [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "LINEAR"))
    assert gvpipe.read(file.write(tmp_path / "a.glb")).fps == pytest.approx(rate, rel=1e-4)


def test_too_many_frames_are_refused(tmp_path: Path) -> None:
    file = square_file()
    file.clip((0, "translation", [0, 9e6], [[0, 0, 0], [1, 0, 0]], "LINEAR"))
    with pytest.raises(InputError, match="would have 270000001 frames at 30 per second; at most 1000000, so lower fps"):
        gvpipe.read(file.write(tmp_path / "a.glb"))
    assert len(gvpipe.read(tmp_path / "a.glb", fps=0.1)) == 900001


def test_an_animated_file_is_no_frame_of_a_series(tmp_path: Path) -> None:
    for i in range(3):
        (square_file() if i < 2 else waving()).write(tmp_path / f"f{i}.glb")
    with pytest.raises(InputError, match="f2.glb holds 2 animations, so it is a sequence of its own"):
        gvpipe.read(tmp_path).read(0, 3)


def test_far_from_the_origin(tmp_path: Path) -> None:
    file = square_file()
    file.tree["nodes"][0]["translation"] = [5_200_000.123, 0, 0]
    (tmp_path / "s").mkdir()
    for path in (tmp_path / "still.glb", tmp_path / "moving.glb"):
        read = gvpipe.read(file.write(path))
        assert read.origin[0] > 5e6
        np.testing.assert_allclose(read.read_absolute(0, 1)[0], CORNERS + np.array([5_200_000.123, 0, 0]), atol=1e-6)
        file.clip((0, "scale", [0, 1], [[1, 1, 1], [1, 1, 1]], "LINEAR"))


def test_text_and_binary_whatever_the_name(tmp_path: Path) -> None:
    file = square_file()
    file.write(tmp_path / "binary.gltf")
    tree, binary = take_apart(file.data())
    (tmp_path / "side file.bin").write_bytes(binary)
    tree["buffers"][0]["uri"] = "side%20file.bin"
    (tmp_path / "side.gltf").write_text(json.dumps(tree))
    tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    (tmp_path / "text.glb").write_text(json.dumps(tree))
    for name in ("binary.gltf", "side.gltf", "text.glb"):
        read = gvpipe.read(tmp_path / name)
        assert same_bits(read.read(0, 1)[0], CORNERS) and read.faces.tolist() == TWO.reshape(2, 3).tolist()


def test_numbers_that_change_in_a_series_are_fields(tmp_path: Path) -> None:
    for i in range(3):
        file = File()
        heat = file.floats(np.arange(4) + 10 * i)
        kind = file.array(np.array([1, 2, 3, 4], np.uint16))
        file.mesh(file.square(_heat=heat, _kind=kind, TEXCOORD_0=file.floats(CORNERS[:, :2])))
        file.add("nodes", {"mesh": 0})
        file.write(tmp_path / f"{i}.glb")
    read = gvpipe.read(tmp_path)
    assert set(read.fields) == {"heat"} and set(read.attributes) == {"uv", "kind"}
    assert read.fields["heat"].read(2, 3).reshape(-1).tolist() == [20, 21, 22, 23]
    assert read.attributes["kind"].kind == "label"
    assert np.asarray(read.attributes["uv"]).tolist() == (CORNERS[:, :2] * [1, -1] + [0, 1]).tolist()
