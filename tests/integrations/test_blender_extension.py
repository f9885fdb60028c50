"""The Blender extension, in Blender: import, play, save, bake, export; and its zip.

bpy runs in a process of its own, by this Python or by the one that the environment variable ``BPY_PYTHON`` names.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from changing import write_objs
from folders import SAMPLES
from integrations.test_blender_zip import build

import gvpipe

N_FRAMES = 10
PYTHON = os.environ.get("BPY_PYTHON") or (sys.executable if importlib.util.find_spec("bpy") else "")
SCRIPT = Path(__file__).parents[1] / "blender_extension.py"
VOICE = SAMPLES / "voice.wav"
TOLERANCE = 1e-6  # of the diagonal

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not PYTHON, reason="bpy is not there: pip install bpy")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("blender")
    for name in ("saved/deep", "objs", "sizes"):
        (folder / name).mkdir(parents=True)
    gvpipe.encode(scene(N_FRAMES), folder / "scene.mp4", "pca", max_error="0.01%", audio=VOICE, audio_trim=True)
    for frame in range(N_FRAMES):
        gvpipe.write(scene(N_FRAMES).part(frame, frame + 1), folder / "objs" / f"sheet_{frame:04d}.obj")
    gvpipe.encode(gvpipe.read_capture(write_objs(folder / "sizes")), folder / "capture.mp4", "pca")
    return folder


def test_import_plays_saves_and_exports(folder: Path) -> None:
    arrays, told = by_blender("imported", folder)
    decoded = gvpipe.decode(folder / "scene.mp4")
    assert error(arrays["frames"], turned(decoded)) < TOLERANCE
    assert told["objects"] == {"left": ["skin"], "right": ["steel"]}
    assert told["fps"] == 24 and told["frames"] == [1, N_FRAMES] and told["images"] == ["skin.png"]
    assert told["sounds"] == (["scene.mp4"] if told["reads sound"] else [])
    assert told["valid"] == [True, True] and told["polygons"] == len(decoded.polygons)  # type: ignore[arg-type]
    assert told["uv"] == ["uv"] and told["attributes"]["color"] == ["FLOAT_COLOR", "POINT"]
    n_left = decoded.parts[0].vertices[1]
    assert np.array_equal(told["stress"], decoded.fields["stress"].read(7, 8)[0][:n_left])
    assert told["attributes"]["state"] == ["INT", "FACE"]
    assert told["path"] == told["path after a copy"] == "//../scene.mp4"
    assert told["frame after export"] == 8 and told["left"] == [False, 0]
    again = gvpipe.decode(folder / "again.mp4")
    assert error(again.read_absolute(0, N_FRAMES), arrays["frames"]) < 1.01e-4
    assert {part.name for part in again.parts} == {"left", "right"} and again.metadata.up_axis == "z"
    assert [each.name for each in again.materials] == ["skin", "steel"] and len(again.images) == 1
    assert again.materials[0].base_color_texture and again.attributes["uv"].kind == "uv"
    assert again.polygons is not None and len(again.polygons) == told["polygons"]
    assert np.allclose(again.fields["stress"].read(7, 8)[0][:n_left], told["stress"], atol=0.1)


def test_saved_file_follows_its_video(folder: Path) -> None:
    by_blender("imported", folder)
    arrays, told = by_blender("reopened", folder)
    expected = turned(gvpipe.decode(folder / "scene.mp4"))
    assert error(arrays["frames"], expected) < TOLERANCE
    assert error(arrays["loaded"], expected[7]) < TOLERANCE
    assert error(arrays["undone"], expected[arrays["shown"]]) < TOLERANCE
    assert error(arrays["found"], expected[4]) < TOLERANCE and told["left"] == {}
    assert all("no such file" in each for each in told["problems"].values()) and set(told["problems"]) == {"left", "right"}
    assert len(arrays["stays"]) == expected.shape[1]


def test_baked_files_need_no_extension(folder: Path) -> None:
    arrays, _ = by_blender("baked", folder)
    expected = turned(gvpipe.decode(folder / "scene.mp4"))
    for target in ("SHAPE_KEYS", "PC2", "ALEMBIC"):
        found = np.stack([arrays[f"{target}_scene_{frame}"] for frame in range(N_FRAMES)])
        assert error(found, expected) < 4 * TOLERANCE, target
    with gvpipe.open_capture(folder / "capture.mp4") as video:
        for frame in range(len(video)):
            shot = video.frame(frame)
            assert error(arrays[f"ALEMBIC_capture_{frame}"], turned(shot)[0]) < TOLERANCE


def test_captures_frames_modifiers_and_refusals(folder: Path) -> None:
    arrays, told = by_blender("others", folder)
    assert told["counts"] == [25, 25, 25, 49, 49, 16]
    with gvpipe.open_capture(folder / "capture_again.mp4") as video:
        assert [len(each) for each in video] == told["counts"] and len(video.shots) == 3
    expected = turned(gvpipe.decode(folder / "scene.mp4"))
    assert error(arrays["slow"], expected[np.arange(24) // 2 % N_FRAMES]) < TOLERANCE
    assert error(arrays["objs"], turned(gvpipe.read(folder / "objs"))) < TOLERANCE
    cube = gvpipe.decode(folder / "cube.mp4")
    assert error(cube.read_absolute(0, 8), arrays["cube"]) < 1e-4 and len(cube.polygons) == 96  # type: ignore[arg-type]
    first = cube.read(0, 1)[0][cube.faces]
    volume = np.einsum("ni,ni->", first[:, 0], np.cross(first[:, 1], first[:, 2])) / 6
    assert volume > 0  # outside is outside, also where the object is mirrored
    skinned = gvpipe.read(folder / "cube.glb")
    assert len(skinned) == 8
    for message, wanted in zip(told["refused"], ("no such file", "no such file", "create it first", "'much'"), strict=True):
        assert wanted in message and "Traceback" not in message
    assert told["stopped"] == [False, 8]
    (ended, is_there, notes, rises), stopped = told["modal"]
    assert (ended, is_there, rises) == ("FINISHED", True, True) and "8 frames" in notes[0]
    assert stopped == ["CANCELLED", False, ["cancelled; no file was written"], True]


def test_blender_validates_and_installs_the_zip(folder: Path) -> None:
    wheel = folder / "nothing-1.0-py3-none-any.whl"
    head = "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    rows = {
        "nothing.py": "",
        "nothing-1.0.dist-info/WHEEL": head,
        "nothing-1.0.dist-info/METADATA": "Name: nothing\nVersion: 1.0\n",
    }
    rows["nothing-1.0.dist-info/RECORD"] = "".join(f"{name},,\n" for name in [*rows, "nothing-1.0.dist-info/RECORD"])
    with zipfile.ZipFile(wheel, "w") as file:
        for name, text in rows.items():
            file.writestr(name, text)
    build().pack(folder / "extension.zip", "linux-x64", "3.11", [wheel])
    _, told = by_blender("installed", folder)
    assert "Success" in told.pop("validated")
    assert told == {"modules": ["bl_ext.user_default.geometry_video"], "objects": 2, "left": False}


def test_cycles_draws_the_frame(folder: Path) -> None:
    red, green, _, _ = np.moveaxis(by_blender("pictured", folder)[0]["pixels"], 2, 0)
    is_red = (red > 0.6) & (green < 0.4)  # stripes of the flag's texture
    assert 0.02 < np.mean(is_red) < 0.2
    assert np.nonzero(is_red)[0].min() / len(red) > 0.5  # rows count from below: it flies high


def by_blender(step: str, folder: Path) -> tuple[Any, Any]:
    """What a step of `SCRIPT` found."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment["BLENDER_USER_RESOURCES"] = str(folder / "user")
    command = [PYTHON, str(SCRIPT), step, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "RuntimeWarning" not in done.stderr, done.stderr
    return np.load(folder / f"{step}.npz"), json.loads((folder / f"{step}.json").read_text(encoding="utf-8"))


def turned(sequence: gvpipe.MeshSequence) -> Any:
    """Positions ``(F, V, 3)`` in Blender's axes and metres."""
    unit, positions = sequence.metadata.metres_per_unit or 1.0, sequence.read_absolute(0, len(sequence))
    return unit * (positions if sequence.metadata.up_axis == "z" else positions[:, :, [0, 2, 1]] * [1, -1, 1])


def error(found: Any, expected: Any) -> float:
    """Largest distance of a vertex, as a part of the diagonal."""
    assert found.shape == expected.shape
    diagonal = np.linalg.norm(np.ptp(expected.reshape(-1, 3), axis=0))
    return float(np.linalg.norm(found - expected, axis=-1).max() / diagonal)
