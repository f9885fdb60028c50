"""``gvpipe info`` of inputs that are no geometry videos."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from gltf_files import assemble, take_apart, two_clips

import gvpipe
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]


def test_an_archive_with_everything(run: Run, tmp_path: Path) -> None:
    given = scene()
    gvpipe.write(given, tmp_path / "a.npz")
    ended = run("info", tmp_path / "a.npz", "--json")
    values = json.loads(ended.out)
    assert ended.status == 0 and values["clips"] == []
    shape = (values["frames"], values["vertices"], values["triangles"], values["fps"])
    assert shape == (given.n_frames, given.n_vertices, len(given.faces), given.fps)
    assert values["bytes"] == (tmp_path / "a.npz").stat().st_size
    assert {each["name"]: each["kind"] for each in values["attributes"]} == {
        name: each.kind for name, each in given.attributes.items()
    }
    assert [each["name"] for each in values["fields"]] == list(given.fields)
    assert [part["name"] for part in values["parts"]] == [part.name for part in given.parts]
    assert values["bounding_box"]["min"] == given[0].min(axis=0).tolist()
    gvpipe.encode(given, tmp_path / "a.mp4", "pca")
    of_video = json.loads(run("info", tmp_path / "a.mp4", "--json").out)
    assert set(values) - set(of_video) == {"clips", "clip_ranges", "time_range"}
    assert all(values[key] == of_video[key] for key in ("frames", "vertices", "materials", "images", "metadata"))
    text = run("info", tmp_path / "a.npz").out
    assert f"{given.n_vertices} vertices" in text and "attribute uv: uv, 2 x float32" in text and "bytes" in text


@pytest.mark.parametrize("source", ["walk", "walk/*.ply", "walk/%02d.ply"])
def test_frame_files(run: Run, sequence: MeshSequence, tmp_path: Path, source: str) -> None:
    gvpipe.write(sequence, tmp_path / "walk" / "%02d.ply")
    ended = run("info", tmp_path / source, "--json")
    values = json.loads(ended.out)
    assert (values["frames"], values["vertices"], values["bytes"]) == (11, 72, None)
    assert ended.err.startswith("Note: ") and values["notes"] == [ended.err[len("Note: ") :].strip()]


def test_clips_of_a_gltf_file(run: Run, tmp_path: Path) -> None:
    two_clips(tmp_path / "a.glb")
    values = json.loads(run("info", tmp_path / "a.glb", "--json").out)
    assert values["clips"] == ["Walk", "Run"] and values["clip_ranges"] == [[0, 1], [0, 2]] and values["frames"] == 31
    values = json.loads(run("info", tmp_path / "a.glb", "--clip", "Run", "--json").out)
    assert values["frames"] == 61
    assert "time: 0..1 s\nclips: Walk (0..1 s), Run (0..2 s)\n" in run("info", tmp_path / "a.glb").out
    ended = run("info", tmp_path / "a.glb", "--clip", "Rum")
    assert ended.status == 1 and "there are: 'Walk', 'Run'" in ended.err and ended.err.count("\n") == 1


def test_scenes_of_a_gltf_file(run: Run, tmp_path: Path) -> None:
    two_clips(tmp_path / "a.glb")
    tree, binary = take_apart((tmp_path / "a.glb").read_bytes())
    tree |= {"nodes": [*tree["nodes"], {"mesh": 0}, {"mesh": 0}], "scenes": [{"nodes": [1, 2]}, {"nodes": [0]}], "scene": 1}
    (tmp_path / "b.glb").write_bytes(assemble(tree, binary))
    ended = run("info", tmp_path / "b.glb")
    assert "3 vertices" in ended.out and "meshes outside of the scene (2), other scenes" in ended.err


def test_a_point_cache_needs_its_mesh(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / "a.pc2")
    gvpipe.write(sequence.part(0, 1), tmp_path / "base.obj")
    assert run("info", tmp_path / "a.pc2").status == 1
    values = json.loads(run("info", tmp_path / "a.pc2", "--mesh", tmp_path / "base.obj", "--json").out)
    assert (values["frames"], values["triangles"]) == (11, 128)
    picture = ["render", tmp_path / "a.pc2", tmp_path / "a.png", "--size", 32]
    assert run(*picture).status == 1
    assert run(*picture, "--mesh", tmp_path / "base.obj", "--frames", "5:", "--frame", 5).status == 0
    assert run(*picture, "--mesh", tmp_path / "base.obj", "--frames", "5:", "--frame", 6).status == 1


def test_some_frames_where_the_topology_changes(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence.part(0, 2), tmp_path / "walk" / "%02d.obj")
    gvpipe.write(scene(3), tmp_path / "walk" / "%02d.obj", start=2)
    ended = run("render", tmp_path / "walk", tmp_path / "a.gif", "--size", 32)
    assert ended.status == 0 and (tmp_path / "a.gif").is_file()  # a capture of two shots
    for span, frames, vertices in (("0:2", 2, 72), ("2:", 3, 98)):
        values = json.loads(run("info", tmp_path / "walk", "--frames", span, "--json").out)
        assert (values["frames"], values["vertices"]) == (frames, vertices)
        assert run("render", tmp_path / "walk", tmp_path / "a.png", "--size", 32, "--frames", span).status == 0


def test_a_clip_is_painted(run: Run, tmp_path: Path) -> None:
    two_clips(tmp_path / "a.glb")
    ended = run("render", tmp_path / "a.glb", tmp_path / "a.png", "--frame", 30, "--size", 32)
    assert ended.status == 0 and "clip 'Walk' was read; others of the file: Run (clip, --clip)" in ended.err
    assert run("render", tmp_path / "a.glb", tmp_path / "a.png", "--clip", "Run", "--frame", 60, "--size", 32).status == 0
    assert run("render", tmp_path / "a.glb", tmp_path / "a.png", "--fps", 4, "--frame", 4, "--size", 32).status == 0
    assert run("render", tmp_path / "a.glb", tmp_path / "a.png", "--fps", 4, "--frame", 5, "--size", 32).status == 1
    ended = run("render", tmp_path / "a.glb", tmp_path / "a.png", "--clip", "Rum")
    assert ended.status == 1 and "there are: 'Walk', 'Run'" in ended.err


@pytest.mark.parametrize(
    ("name", "data"), [("a.npz", b"hello"), ("a.glb", b"glTF\2\0\0\0"), ("a.txt", b"text"), ("a.obj", b"")]
)
def test_what_cannot_be_read(run: Run, tmp_path: Path, name: str, data: bytes) -> None:
    (tmp_path / name).write_bytes(data)
    for path in (tmp_path / name, tmp_path / "none" / name):
        ended = run("info", path)
        assert ended.status == 1 and ended.out == "" and str(path) in ended.err and ended.err.count("\n") == 1


def test_a_video_has_no_clips(run: Run, video: Path) -> None:
    for option, value in (("--clip", "Run"), ("--frames", "0:1"), ("--fps", 12)):
        assert run("info", video, option, value).status == 2


def test_info_at_another_rate(run: Run, tmp_path: Path) -> None:
    two_clips(tmp_path / "a.glb")
    given, other = (json.loads(run("info", tmp_path / "a.glb", *fps, "--json").out) for fps in ((), ("--fps", 4)))
    assert other["fps"] == 4 and other["frames"] < given["frames"] and other["time_range"] == pytest.approx(given["time_range"])


def test_one_is_no_plural(run: Run, tmp_path: Path) -> None:
    still = gvpipe.MeshSequence(np.eye(3, dtype=np.float32)[None], np.array([[0, 1, 2]], np.int32))
    gvpipe.write(still, tmp_path / "a.npz")
    assert "3 vertices, 1 triangle, 1 frame at 30 fps\n" in run("info", tmp_path / "a.npz").out
    assert run("convert", tmp_path / "a.npz", tmp_path / "b.npz").out.endswith("b.npz (1 frame, 3 vertices)\n")
    refused = run("convert", tmp_path / "a.npz", tmp_path / "b.npz", "--frames", "0:2")
    assert refused.status == 1 and "a.npz: frames 0:2 asked for; 0 <= start < stop <= 1 is needed" in refused.err
