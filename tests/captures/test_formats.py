"""Captures into mesh formats and back: one file, or numbered frames, and the same shots."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changing import SIZES, SPANS, sheet
from folders import ROOT

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.captures.writing import write_capture_files
from gvpipe.errors import InputError, TopologyChange
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]
PNG = b"\x89PNG\r\n\x1a\n"  # enough for an image's type
MODULES = {".usda": "pxr", ".usdc": "pxr", ".usdz": "pxr", ".abc": "alembic3d", ".vtkhdf": "h5py"}


def scene() -> gvpipe.Capture:
    """Three shots of other parts, colours, texture coordinates, materials and fields."""
    shots = []
    for number, (start, stop) in enumerate(SPANS):
        points = np.stack([sheet(SIZES[frame], frame)[0] for frame in range(start, stop)])
        faces, n = sheet(SIZES[start], start)[1], points.shape[1]
        parts = [Part("left", (0, n), (0, len(faces)), 0)]
        if number < 2:  # one more beside it
            points = np.concatenate([points, points + np.float32(9)], axis=1)
            parts.append(Part("right", (n, 2 * n), (len(faces), 2 * len(faces)), 1))
            faces = np.concatenate([faces, faces + n]).astype(np.int32)
        random = np.random.default_rng(number)
        attributes: dict[str, Attribute] = {}
        if number == 1:
            attributes["color"] = Attribute(random.random((points.shape[1], 3)).astype(np.float32), "vertex", "color")
        else:
            attributes["uv"] = Attribute(random.random((points.shape[1], 2)).astype(np.float32), "vertex", "uv")
        heat = {"heat": Field(random.random(points.shape[:2]).astype(np.float32), "vertex")} if number == 1 else {}
        texture = Texture(0, "uv") if number != 1 else None
        images = (Image("skin", "image/png", PNG + bytes([number])),) if number != 1 else ()
        materials = (Material("red", (1, 0, 0, 1), texture), Material("blue", (0, number / 2, 1, 1)))[: len(parts)]
        about = Metadata("y", 1.0)
        shots.append(
            MeshSequence(
                points, faces, 25.0, attributes, "scene", fields=heat, parts=tuple(parts), materials=materials, images=images,
                metadata=about,
            )
        )  # fmt: skip
    return gvpipe.Capture(shots, "scene")


def check_shots(found: gvpipe.Capture, given: gvpipe.Capture) -> None:
    """The same spans, triangles and positions."""
    assert (found.lengths, found.fps) == (given.lengths, given.fps)
    for one, other in zip(found.shots, given.shots, strict=True):
        assert np.array_equal(one.faces, other.faces)
        points = one.read(0, len(one)) + one.origin.astype(np.float32)
        assert np.allclose(points, other.read(0, len(other)), atol=1e-6)


@pytest.mark.parametrize("suffix", [".usda", ".usdz", ".abc", ".vtkhdf", ".pvd", ".glb"])
def test_one_file_and_back(tmp_path: Path, suffix: str) -> None:
    if suffix in MODULES:
        pytest.importorskip(MODULES[suffix])
    path = tmp_path / f"scene{suffix}"
    gvpipe.write(scene(), path)
    beside = [each.name for each in tmp_path.iterdir() if each.name != path.name]
    assert beside == {".pvd": ["scene"], ".usda": ["scene_textures"]}.get(suffix, [])
    found = gvpipe.read_capture(path)
    check_shots(found, scene())
    names = [[part.name for part in shot.parts] for shot in found.shots]
    assert names == [["left", "right"], ["left", "right"], ["left"]]
    colors = found.shots[1].attributes["color"]
    assert np.allclose(colors.values, scene().shots[1].attributes["color"].values, atol=1e-6)
    assert suffix == ".vtkhdf" or "color" not in found.shots[0].attributes
    if suffix != ".glb":
        fields = found.shots[1].fields["heat"].read(0, 2).reshape(2, -1)
        assert np.allclose(fields, scene().shots[1].fields["heat"].values.reshape(2, -1))
        assert not found.shots[0].fields
    for number in (0, 2):
        assert np.allclose(
            found.shots[number].attributes["uv"].values, scene().shots[number].attributes["uv"].values, atol=1e-6
        )
    if suffix in (".usda", ".usdz", ".glb"):
        assert [found.shots[number].images[0].data for number in (0, 2)] == [PNG + b"\0", PNG + b"\2"]
        assert [shot.materials[-1].base_color[1] for shot in found.shots] == [0, 0.5, 0]
    starts = [shot.times[0] for shot in found.shots]
    assert np.allclose(starts, np.array(found.starts) / 25)


def test_frames_and_back(tmp_path: Path) -> None:
    given = scene()
    gvpipe.write(given, tmp_path / "out" / "f_%02d.obj")
    libraries = {path.name for path in (tmp_path / "out").iterdir() if path.suffix != ".obj"}
    assert libraries == {"f.mtl", "f_1.mtl", "f_2.mtl", "skin.png", "skin-1.png"}
    found = gvpipe.read_capture(tmp_path / "out", 25)
    check_shots(found, given)
    assert [shot.materials[-1].base_color[1] for shot in found.shots] == [0, 0.5, 0]
    assert [shot.images and shot.images[0].data for shot in found.shots] == [PNG + b"\0", (), PNG + b"\2"]
    plain = gvpipe.Capture([replace(shot, images=(), materials=(), parts=()) for shot in given.shots])
    for suffix in ("ply", "off", "stl"):
        gvpipe.write(plain, tmp_path / suffix / f"f_%02d.{suffix}", 7)
        found = gvpipe.read_capture(tmp_path / suffix, 25)
        assert found.lengths == (3, 2, 1)
        assert suffix == "stl" or np.allclose(found.frame(4)[0], given.frame(4)[0])


def test_each_shot_has_a_file_where_triangles_are_kept(tmp_path: Path) -> None:
    names, notes = write_capture_files(scene(), tmp_path / "a.npz")
    assert [Path(name).name for name in names] == ["a-000.npz", "a-001.npz", "a-002.npz"]
    assert "each of the 3 shots has a file" in notes[-1]
    assert gvpipe.write(gvpipe.Capture(scene().shots[:1]), tmp_path / "b.npz") == []
    assert gvpipe.read(tmp_path / "b.npz").n_frames == 3


def test_shots_in_gltf_are_shown_by_their_scale(tmp_path: Path) -> None:
    from gvpipe.io.gltf.document import load_document

    notes = gvpipe.write(scene(), tmp_path / "a.glb")
    assert any("a node of its own, whose scale is 0 outside of its frames" in note for note in notes)
    tree = load_document(tmp_path / "a.glb").tree
    roots = [tree["nodes"][number] for number in tree["scenes"][0]["nodes"]]
    assert [(root["name"], root["scale"]) for root in roots] == [("shot0", [1] * 3), ("shot1", [0] * 3), ("shot2", [0] * 3)]
    with pytest.raises(TopologyChange, match="meshes take turns"):
        gvpipe.read(tmp_path / "a.glb")
    found = gvpipe.read_capture(tmp_path / "a.glb", frames=(2, 4))
    assert found.lengths == (1, 1) and np.allclose(found.frame(1)[0], scene().frame(3)[0])


def test_three_js_shows_one_shot_at_a_time(tmp_path: Path) -> None:
    node, homes = shutil.which("node"), (ROOT / "gvpipe" / "web", ROOT / "tests" / "web" / "npm")
    three = next((home / "node_modules" / "three" for home in homes if (home / "node_modules" / "three").exists()), None)
    if node is None or three is None:
        pytest.skip("Node or three.js is not there: cd gvpipe/web && npm ci")
    given = scene()
    gvpipe.write(given, tmp_path / "a.glb")
    command = [node, str(ROOT / "tests" / "three_positions.mjs"), str(three), str(tmp_path / "a.glb"), "6", "25"]
    found = np.frombuffer(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout).reshape(6, -1, 3)
    ends = np.cumsum([0, *(shot.n_vertices for shot in given.shots)])
    for frame in range(6):
        shown, own = given.locate(frame)
        for number, shot in enumerate(given.shots):
            points = found[frame, ends[number] : ends[number + 1]]
            assert np.allclose(points, shot[own]) if number == shown else not points.any()


def test_what_an_attribute_cannot_change_is_said(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    first, second, _ = scene().shots
    corners = Attribute(np.zeros((3 * len(second.faces), 2), np.float32), "corner", "uv")
    capture = gvpipe.Capture([first, replace(second, attributes={"uv": corners})])
    notes = gvpipe.write(capture, tmp_path / "a.usda")
    assert any("st is of another kind in some shots" in note for note in notes)
    found = gvpipe.read_capture(tmp_path / "a.usda")
    assert "uv" in found.shots[0].attributes and "uv" not in found.shots[1].attributes


@pytest.mark.parametrize("suffix", [".obj", ".vtkhdf", ".usdc", ".abc", ".glb"])
def test_one_pass_over_many_runs(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run is read once, and what was found for the first serves all."""
    if suffix in MODULES:
        pytest.importorskip(MODULES[suffix])
    from gvpipe.io import reading

    shots = [MeshSequence(sheet(3 + frame % 2, frame)[0][None], sheet(3 + frame % 2, frame)[1], 25.0) for frame in range(12)]
    path = tmp_path / "in" / "f_%02d.obj" if suffix == ".obj" else tmp_path / f"a{suffix}"
    gvpipe.write(gvpipe.Capture(shots), path)
    asked: list[Any] = []
    read = reading.read

    def noted(*given: Any) -> MeshSequence:
        asked.append(given[4])
        return read(*given)

    monkeypatch.setattr(reading, "read", noted)
    found = gvpipe.read_capture(path.parent if suffix == ".obj" else path)
    assert found.lengths == (1,) * 12
    assert asked == [None, *((frame, None) for frame in range(1, 12))]
    assert np.allclose(found.frame(7)[0], shots[7][0])


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "stl"])
def test_frames_without_triangles_or_vertices(tmp_path: Path, suffix: str) -> None:
    bare = {
        "obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "# nothing\n"),
        "off": ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "OFF\n0 0 0\n"),
        "stl": ("solid a\nendsolid a\n", "solid b\nendsolid b\n"),
        "ply": (
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 0\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n",
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 0\n"
            "property list uchar int vertex_indices\nend_header\n",
        ),
    }[suffix]
    for number, text in enumerate(bare):
        folder = tmp_path / str(number)
        gvpipe.write(gvpipe.Capture(scene().shots[:2]), folder / f"f_%02d.{suffix}")
        (folder / f"f_03.{suffix}").write_text(text)
        try:
            found = gvpipe.read_capture(folder)
        except InputError as exc:
            assert f"f_03.{suffix}" in str(exc) and "\n" not in str(exc)
        else:
            assert found.lengths == (3, 1, 1) and found.shots[1].n_vertices == 3


def test_empty_frames_of_scenes(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    gvpipe.write(gvpipe.Capture([replace(shot, parts=()) for shot in scene().shots]), tmp_path / "a.usda")
    from pxr import Usd, UsdGeom, Vt

    stage: Any = Usd.Stage.Open(str(tmp_path / "a.usda"))
    mesh = next(UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    for frame in (3, 4):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray(), frame)
        mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray(), frame)
        mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray(), frame)
    stage.Save()
    with pytest.raises(InputError, match=r"a.usda .*: no mesh has points at frame 3 \(time code 3\); leave it out"):
        gvpipe.read_capture(tmp_path / "a.usda")
    assert gvpipe.read_capture(tmp_path / "a.usda", frames=(0, 3)).lengths == (3,)


def test_info_of_sources(run: Run, tmp_path: Path) -> None:
    gvpipe.write(scene(), tmp_path / "in" / "f_%02d.obj")
    ended = run("info", tmp_path / "in", "--json")
    values = json.loads(ended.out)
    assert ended.status == 0 and values["frames"] == 6 and values["vertices"] == 98
    assert values["shots"][1] == {"start": 3, "frames": 2, "vertices": 98, "triangles": 144}
    assert values["time_range"] == pytest.approx([0, 5 / 30])
    assert "shot of frames 5:6: 16 vertices, 18 triangles" in run("info", tmp_path / "in").out
    gvpipe.write(scene().shots[0], tmp_path / "one.npz")
    assert json.loads(run("info", tmp_path / "one.npz", "--json").out)["shots"] == []


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="a MeshSequence is needed"):
        gvpipe.write(3, tmp_path / "a.npz")  # type: ignore[arg-type]
    skin: Any = object()
    with pytest.raises(InputError, match="a skin moves one mesh, and scene has 3 shots"):
        gvpipe.write(scene(), tmp_path / "a.glb", skin=skin)
    assert not list(tmp_path.iterdir())
