"""Skeletons: what moves a file's vertices, what is found for a sequence, and what readers show of a GLB that holds one."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from asset_scene import scene
from folders import GOLDEN, ROOT
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from sequences import rigid, waving, wrinkled

import gvpipe
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.io.gltf.reader import read_poses
from gvpipe.io.gltf.scene_writing import prepare
from gvpipe.io.scene.affine_nodes import BETWEEN, factor, find_keys, matrices
from gvpipe.model.clips import Clip, join_clips
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin
from gvpipe.skinning.rigid_fit import similar

RIGID = GOLDEN / "mcgv-1-rigid.mp4"  # without pictures; has frames that repeat, and vertices that stand still
THREE = ROOT / "gvpipe" / "web" / "node_modules" / "three"
BABYLON = ROOT / "tests" / "web" / "npm" / "node_modules"


def diagonal(frames: Any) -> float:
    return float(np.linalg.norm(np.ptp(frames[0], axis=0)))


def farthest(a: Any, b: Any) -> float:
    """Largest distance of a vertex, part of the first frame's diagonal."""
    return float(np.linalg.norm(np.asarray(a, np.float64) - b, axis=2).max() / diagonal(b))


def test_the_skeleton_of_a_file_moves_it_exactly() -> None:
    with gvpipe.open(RIGID) as video:
        skin, frames = video.skin(), video[:]
    assert skin is not None and skin.n_frames == len(frames) and 1 <= skin.joints <= 3
    assert (skin.weights.sum(axis=1) == 1).all() and (skin.weights >= 0).all()
    assert farthest(skin.read(0, len(frames)), frames) < 1e-6 and skin.error < 1e-6
    assert np.array_equal(skin.part(3, 7).evaluate(0), skin.evaluate(3))


def test_where_pictures_say_more_the_error_is_told() -> None:
    with gvpipe.open(GOLDEN / "mcgv-1-h264.mp4") as video:
        skin, frames = video.skin(), video[:]
    assert skin is not None and skin.error == pytest.approx(farthest(skin.read(0, len(frames)), frames))
    assert 1e-4 < skin.error < 0.2


@pytest.mark.parametrize("name", ["mcgv-1-affine", "mcgv-1-klt", "pca-1-lsp", "laplacian-1", "pdct-1"])
def test_files_without_a_skeleton(name: str) -> None:
    with gvpipe.open(GOLDEN / f"{name}.mp4") as video:
        assert video.skin() is None


def affine(n_frames: int, kind: str) -> Any:
    """Matrices ``(F, 3, 4, 4)`` whose factors are not unique, in one way or another."""
    draw = np.random.default_rng(3)
    result = np.tile(np.eye(4), (n_frames, 3, 1, 1))
    angle = np.linspace(0, 3, n_frames)
    turn = np.zeros((n_frames, 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1], turn[:, 2, 2] = -turn[:, 1, 0], 1
    shapes = {
        "rigid": np.eye(3), "scaled": 2 * np.eye(3), "two equal scales": np.diag([2.0, 2.0, 0.5]),
        "flat": np.diag([1.0, 1.0, 0.0]), "mirrored": np.diag([1.0, -1.0, 1.0]), "nothing": np.zeros((3, 3)),
        "sheared": np.array([[1, 0.7, 0], [0, 1, 0.2], [0, 0, 1.0]]),
    }  # fmt: skip
    result[:, :, :3, :3] = turn[:, None] @ (draw.normal(size=(3, 3, 3)) if kind == "any" else shapes[kind])
    result[:, :, :3, 3] = draw.normal(size=(n_frames, 3, 3))
    return result


@pytest.mark.parametrize("kind", ["rigid", "scaled", "two equal scales", "flat", "mirrored", "nothing", "sheared", "any"])
def test_affine_motions_are_two_nodes(kind: str) -> None:
    """Exactly; and factors go on from moment to moment as smoothly as the motion does."""
    given = affine(40, kind)
    nodes = factor(given)
    assert np.allclose(matrices(nodes), given, atol=1e-9)
    assert (np.linalg.norm(nodes.rotations, axis=-1) == pytest.approx(1)) and nodes.scales.shape == (40, 3, 3)
    steps = [(one[1:] * one[:-1]).sum(axis=-1).min() for one in (nodes.rotations, nodes.inner)]
    if kind not in ("any", "nothing"):
        assert min(steps) > np.cos(0.2)  # quaternions of neighbours are near each other


def test_keys_are_where_they_are_needed() -> None:
    """A joint that stands has two, one that turns evenly few, one that turns far from frame to frame has some between."""
    given = np.tile(np.eye(4), (33, 3, 1, 1))
    given[:, 1] = affine(33, "rigid")[:, 0]
    given[:, 1, :3, 3] = 0
    given[1::2, 2, :2, :2] = [[-1, 0], [0, -1]]
    bind = np.random.default_rng(0).random((12, 3), np.float32)
    indices = np.zeros((12, 4), np.int32)
    indices[:, 0] = np.arange(12) % 3
    weights = np.tile(np.array([1, 0, 0, 0], np.float32), (12, 1))
    keys = find_keys(Skin(indices, weights, bind, given))
    shifts = np.tile(np.eye(4), (3, 1, 1))
    shifts[:, :3, 3] = keys.pivots
    assert keys.is_key[[0, -1]].all() and np.allclose(matrices(keys.nodes)[::4], given @ shifts)
    stands, even, wild = keys.is_key.sum(axis=0)
    assert stands == 2 and even <= 33 < wild


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any, float]:
    """A file with a skeleton, its frames, and frames a second."""
    path = tmp_path_factory.mktemp("skin") / "a.glb"
    with gvpipe.open(RIGID) as video:
        skin = video.skin()
        assert gvpipe.write(video.sequence(), path, skin=skin) == []
        return path, video[:], video.fps


def test_it_reads_back(written: tuple[Path, Any, float]) -> None:
    path, frames, fps = written
    read = gvpipe.read(path)
    assert (read.n_frames, read.fps) == (len(frames), fps) and read.not_carried == ()
    assert farthest(read.read(0, len(frames)), frames) < 1e-5
    halves = read_poses(path).at(np.asarray((np.arange(len(frames) - 1) + 0.5) / fps, np.float64))
    assert farthest(halves, (frames[1:] + frames[:-1]) / 2) < 3 * BETWEEN


ENGINES = {"three.js": ("run_skin.mjs", THREE), "Babylon.js": ("run_babylon.mjs", BABYLON)}
each_engine = pytest.mark.parametrize("engine", ENGINES)
three_quickly = pytest.mark.parametrize("engine", ["three.js", pytest.param("Babylon.js", marks=pytest.mark.slow)])  # takes 2 s


def shown_by(engine: str, path: Path, times: list[float]) -> Any:
    """Positions ``(n, V, 3)`` at some times, in the order of the file."""
    script, packages = ENGINES[engine]
    if shutil.which("node") is None or not (packages if engine == "three.js" else packages / "@babylonjs" / "loaders").exists():
        pytest.skip(f"no node, or no {engine}; npm ci in gvpipe/web and tests/web/npm")
    command = ["node", str(ROOT / "tests" / script), str(packages), str(path), *map(str, times)]
    found = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return np.array(found).reshape(len(times), -1, 3)


@each_engine
def test_engines_show_the_same(engine: str, written: tuple[Path, Any, float]) -> None:
    path, frames, fps = written
    shown = [0, 1, len(frames) // 2, len(frames) - 1]
    assert farthest(shown_by(engine, path, [k / fps for k in shown]), frames[shown]) < 1e-5


@three_quickly
@pytest.mark.parametrize("has_skin", [True, False])
def test_compressed_files_show_the_same(has_skin: bool, engine: str, tmp_path: Path) -> None:
    """In fewer bytes, and in another order of vertices; a skeleton and morph targets alike."""
    with gvpipe.open(RIGID) as video:
        sequence, frames = video.sequence(), video[:]
        skin = video.skin() if has_skin else None
    gvpipe.write(sequence, tmp_path / "plain.glb", skin=skin)
    gvpipe.write(sequence, tmp_path / "small.glb", skin=skin, compress="meshopt")
    assert (tmp_path / "small.glb").stat().st_size < 0.8 * (tmp_path / "plain.glb").stat().st_size
    sources = prepare(sequence, is_packed=True).split.sources
    assert not np.array_equal(sources, np.arange(len(sources)))
    read = gvpipe.read(tmp_path / "small.glb")
    assert read.n_frames == len(frames) and len(read.faces) == len(sequence.faces)
    assert farthest(read.read(0, len(frames)), frames[:, sources]) < 2e-5
    shown = [0, 1, len(frames) // 2, len(frames) - 1]
    found = shown_by(engine, tmp_path / "small.glb", [k / video.fps for k in shown])
    assert farthest(found, frames[shown][:, sources]) < 2e-5


def test_coarse_skeletons_have_coarse_keys(tmp_path: Path) -> None:
    """What is off by more may have fewer bits: the file is smaller, and hardly farther off."""
    sequence = waving(12, 30)
    skin = gvpipe.skin(sequence, joints=6)
    assert skin.error > 1e-3
    for compress in ("none", "meshopt"):
        gvpipe.write(sequence, tmp_path / f"{compress}.glb", skin=skin, compress=compress)
    assert (tmp_path / "meshopt.glb").stat().st_size < 0.8 * (tmp_path / "none.glb").stat().st_size
    sources = prepare(sequence, is_packed=True).split.sources
    own, found = skin.read(0, 30)[:, sources], gvpipe.read(tmp_path / "meshopt.glb").read(0, 30)
    assert farthest(found, own) < 0.1 * skin.error


def test_weights_and_positions_that_joints_pull_apart_stay_exact(tmp_path: Path) -> None:
    """Two joints that go off by a thousand sizes in opposite directions: 16 bits of their weights would not do."""
    sequence = rigid()
    bind = sequence.read(0, 1)[0]
    n = len(bind)
    weights = np.zeros((n, 4), np.float32)
    weights[:, 0] = np.float32(1 / 3)
    weights[:, 1] = 1 - weights[:, 0]
    indices = np.tile(np.array([0, 1, 0, 0], np.int32), (n, 1))
    transforms = np.tile(np.eye(4), (sequence.n_frames, 2, 1, 1))
    away = 1000.0 * diagonal(bind[None]) * np.linspace(0, 1, sequence.n_frames)
    transforms[:, 0, 0, 3] = away / float(weights[0, 0])
    transforms[:, 1, 0, 3] = -away / float(weights[0, 1])
    skin = Skin(indices, weights, bind, transforms)
    for compress in ("none", "meshopt"):
        gvpipe.write(sequence, tmp_path / "a.glb", skin=skin, compress=compress)
        sources = prepare(sequence, is_packed=compress != "none").split.sources
        found = gvpipe.read(tmp_path / "a.glb").read(0, sequence.n_frames)
        assert farthest(found, skin.read(0, sequence.n_frames)[:, sources]) < 2e-4  # float32 of a thousand sizes


def grown(sizes: Any, extent: float = 1.0) -> MeshSequence:
    """A sheet that grows from frame to frame."""
    sheet = waving(8, 1)
    return replace(sheet, positions=np.stack([sheet.read(0, 1)[0] * (extent * size) for size in sizes]).astype(np.float32))


@pytest.mark.parametrize("compress", ["none", "meshopt"])
@pytest.mark.parametrize("extent", [1.0, 1e-5, 1e30, 1e-25])
@pytest.mark.parametrize("first", [0.0, 0.5])
def test_sheets_of_any_size_grow_from_nothing(first: float, extent: float, compress: str, tmp_path: Path) -> None:
    """Where the first frame is a point, no diagonal says how fine is fine enough: then nothing is rounded."""
    sequence = grown(np.linspace(first, 1, 9), extent)
    for skin in (None, gvpipe.skin(sequence, joints=4)):
        gvpipe.write(sequence, tmp_path / "a.glb", skin=skin, compress=compress)
        sources = prepare(sequence, is_packed=compress != "none").split.sources
        found = np.asarray(gvpipe.read(tmp_path / "a.glb").read(0, 9), np.float64)
        given = np.asarray(sequence.read(0, 9) if skin is None else skin.read(0, 9), np.float64)[:, sources]
        assert np.abs(found - given).max() < 1e-4 * np.abs(given).max()


def test_a_frame_among_many_in_which_a_joint_goes_far(tmp_path: Path) -> None:
    """It is looked at, wherever it is, so that positions of 16 bits are not taken where it moves them too far."""
    sequence = waving(10, 100)
    skin = gvpipe.skin(sequence, joints=6)
    transforms = skin.transforms.copy()
    transforms[53, 0, :3, :3] *= 1000
    skin = replace(skin, transforms=transforms, error=2e-3)
    gvpipe.write(replace(sequence, positions=skin.read(0, 100)), tmp_path / "a.glb", skin=skin, compress="meshopt")
    sources = prepare(sequence, is_packed=True).split.sources
    found = gvpipe.read(tmp_path / "a.glb").read(53, 54)[0]
    own = skin.evaluate(53)[sources]
    assert np.abs(found - own).max() < 3e-4 * diagonal(sequence.read(0, 1))


def test_usd_refuses_scales_that_it_cannot_hold(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    sequence = grown(np.geomspace(1e-6, 1, 9))
    with pytest.raises(InputError, match="USD's scales end at 65504"):
        gvpipe.write(sequence, tmp_path / "a.usdc", skin=gvpipe.skin(sequence, joints=2))
    assert not list(tmp_path.iterdir())


def test_compression_of_what_moves_not_and_of_other_files(tmp_path: Path, run: Any) -> None:
    gvpipe.write(scene().part(0, 1), tmp_path / "still.glb", compress="meshopt")
    assert gvpipe.read(tmp_path / "still.glb").n_frames == 1 and "animations" not in _tree(tmp_path / "still.glb")
    with pytest.raises(InputError, match="one .glb"):
        gvpipe.write(scene(), tmp_path / "a.usdc", compress="meshopt")
    with pytest.raises(SettingError, match="'none', 'meshopt' or 'draco'"):
        gvpipe.write(scene(), tmp_path / "a.glb", compress="zip")
    ended = run("decode", RIGID, tmp_path / "b.npz", "--compress", "meshopt")
    assert ended.status == 2 and "--compress is for a .glb" in ended.err
    assert run("decode", RIGID, tmp_path / "b.glb", "--compress", "meshopt").status == 0
    gvpipe.write(waving(4, 5), tmp_path / "in.npz")
    assert run("convert", tmp_path / "in.npz", tmp_path / "c.glb", "--skin", "--compress", "meshopt").status == 0
    for name in ("b", "c"):
        assert "EXT_meshopt_compression" in _tree(tmp_path / f"{name}.glb")["extensionsRequired"]


def test_a_skeleton_is_found_for_a_sequence(tmp_path: Path) -> None:
    sequence = rigid()
    skin = gvpipe.skin(sequence, target_kg=0.05)
    frames = sequence.read(0, sequence.n_frames)
    assert np.array_equal(skin.bind, frames[0])  # a real frame
    assert skin.error == pytest.approx(farthest(skin.read(0, len(frames)), frames)) and skin.error < 1e-3
    gvpipe.write(sequence, tmp_path / "a.glb", skin=skin)
    assert farthest(gvpipe.read(tmp_path / "a.glb").read(0, len(frames)), frames) < 1e-3


@pytest.mark.slow
def test_corrective_shapes_add_what_joints_leave(tmp_path: Path, run: Any) -> None:
    """Few joints hold the error with shapes; every reader and engine shows what the skin says."""
    sequence = wrinkled()
    alone = gvpipe.skin(sequence, joints=2, target_kg=0.2, correctives=0)
    skin = gvpipe.skin(sequence, joints=2, target_kg=0.2)
    assert not len(alone.shapes) and alone.error > 0.01 and 1 <= len(skin.shapes) <= 8 and skin.joints == alone.joints
    frames = sequence.read(0, sequence.n_frames)
    assert (gvpipe.compare(sequence, replace(sequence, positions=skin.read(0, len(frames)))).kg or 1) <= 0.2
    assert skin.error == pytest.approx(farthest(skin.read(0, len(frames)), frames))
    assert not skin.shapes[:, 144:].any()  # the stiff sheet has none
    assert (skin.shape_weights.min(axis=0) == 0).all() and (skin.shape_weights.max(axis=0) == 1).all()
    assert np.array_equal(skin.part(3, 9).evaluate(2), skin.evaluate(5))
    limit = max(2e-5, 0.1 * skin.error)
    for compress in ("none", "meshopt"):
        path = tmp_path / f"{compress}.glb"
        gvpipe.write(sequence, path, skin=skin, compress=compress)
        sources = prepare(sequence, is_packed=compress == "meshopt").split.sources
        assert farthest(gvpipe.read(path).read(0, len(frames)), skin.read(0, len(frames))[:, sources]) < limit
        meshes = _tree(path)["meshes"]
        assert [("targets" in each["primitives"][0]) for each in meshes] == [True, False]
    ended = run(
        "convert", _saved(sequence, tmp_path), tmp_path / "c.glb", "--skin", "--joints", "2", "--target-kg", "0.2", "--json"
    )
    assert json.loads(ended.out)["correctives"] == len(skin.shapes) and "corrective shape" in ended.err
    ended = run(
        "convert",
        _saved(sequence, tmp_path),
        tmp_path / "d.glb",
        "--skin",
        "--target-kg",
        "0.2",
        "--correctives",
        "0",
        "--json",
    )
    assert json.loads(ended.out)["correctives"] == 0
    assert run("convert", _saved(sequence, tmp_path), tmp_path / "e.glb", "--correctives", "3").status == 2


def _saved(sequence: MeshSequence, folder: Path) -> Path:
    gvpipe.write(sequence, folder / "in.npz")
    return folder / "in.npz"


@three_quickly
@pytest.mark.parametrize("compress", ["none", "meshopt"])
def test_engines_show_corrective_shapes(compress: str, engine: str, tmp_path: Path) -> None:
    sequence = wrinkled()
    skin = gvpipe.skin(sequence, joints=2, target_kg=0.2)
    gvpipe.write(sequence, tmp_path / "a.glb", skin=skin, compress=compress)
    sources = prepare(sequence, is_packed=compress == "meshopt").split.sources
    shown = [0, 1, 11, 23]
    found = shown_by(engine, tmp_path / "a.glb", [k / sequence.fps for k in shown])
    assert farthest(found, skin.read(0, 24)[shown][:, sources]) < max(2e-5, 0.1 * skin.error)


@three_quickly
@pytest.mark.parametrize("correctives", [0, 8])
def test_draco_files_show_the_same(correctives: int, engine: str, tmp_path: Path) -> None:
    """In Draco's order of vertices; where shapes need it, in the order that they have."""
    sequence = wrinkled()
    skin = gvpipe.skin(sequence, joints=2, target_kg=0.2, correctives=correctives)
    assert gvpipe.write(sequence, tmp_path / "plain.glb", skin=skin) == []
    notes = gvpipe.write(sequence, tmp_path / "small.glb", skin=skin, compress="draco")
    assert ["not morph targets" in note for note in notes] == ([True] if correctives else [])
    assert (tmp_path / "small.glb").stat().st_size < (0.8 if correctives else 0.5) * (tmp_path / "plain.glb").stat().st_size
    frames, own = gvpipe.read(tmp_path / "small.glb").read(0, 24), skin.read(0, 24)
    rows: Any = cKDTree(own[5]).query(frames[5])[1]
    assert np.array_equal(np.sort(rows), np.arange(len(rows))) and np.array_equal(rows, np.sort(rows)) == bool(correctives)
    assert farthest(frames, own[:, rows]) < max(2e-5, 0.1 * skin.error)
    shown = [0, 1, 11, 23]
    assert farthest(shown_by(engine, tmp_path / "small.glb", [k / sequence.fps for k in shown]), frames[shown]) < 2e-5


def test_draco_holds_what_lies_beside_positions(tmp_path: Path) -> None:
    sequence = scene()
    skin = gvpipe.skin(sequence)
    for compress in ("none", "draco"):
        gvpipe.write(sequence, tmp_path / f"{compress}.glb", skin=skin, compress=compress)
    assert "KHR_draco_mesh_compression" in _tree(tmp_path / "draco.glb")["extensionsRequired"]
    plain, small = (gvpipe.read(tmp_path / f"{compress}.glb") for compress in ("none", "draco"))
    assert [part.name for part in small.parts] == [part.name for part in plain.parts]
    assert len(small.faces) == len(plain.faces) and set(small.attributes) == set(plain.attributes) > {"uv", "color", "normal"}
    corners = [corner_rows(each) for each in (plain, small)]
    assert max(np.max(cKDTree(one).query(other)[0]) for one, other in (corners, corners[::-1])) < 0.02  # normals have 10 bits


def test_what_draco_does_not_hold_stays_as_it_is(tmp_path: Path) -> None:
    """Triangles that are lines, and sheets that are a point."""
    sheet = waving(4, 5)
    lines = replace(sheet, faces=np.repeat(sheet.faces[:, :1], 3, axis=1))
    point = replace(sheet, positions=np.zeros_like(sheet.positions))
    for sequence, skin in ((lines, gvpipe.skin(sheet, joints=2)), (point, None)):
        notes = gvpipe.write(sequence, tmp_path / "a.glb", skin=skin, compress="draco")
        assert any("none is compressed" in note for note in notes)
        assert "extensionsUsed" not in _tree(tmp_path / "a.glb") and gvpipe.read(tmp_path / "a.glb").n_frames == 5


def corner_rows(sequence: MeshSequence) -> Any:
    """``(3 T, n)``: position in the first frame, uv, normal and colour of each corner."""
    corners = sequence.faces.reshape(-1)
    rows = [sequence.read(0, 1)[0][corners]]
    for name in ("uv", "normal", "color"):
        one = sequence.attributes[name]
        values = np.asarray(one) if one.domain == "corner" else np.asarray(one)[corners]
        rows.append(values / (255.0 if values.dtype == np.uint8 else 1.0))
    return np.concatenate(rows, axis=1)


def test_shapes_where_the_largest_error_counts() -> None:
    sequence = wrinkled()
    skin = gvpipe.skin(sequence, joints=2, max_error="0.5%")
    assert len(skin.shapes) and skin.error <= 0.005
    rigid_joints = gvpipe.skin(sequence, joints=2, max_error="0.5%", rigid=True)
    assert len(rigid_joints.shapes) and rigid_joints.error <= 0.005


def bent_arm() -> MeshSequence:
    """A tube of three bones, each of which turns against the one before it."""
    tube = waving(12, 1)
    bind = tube.read(0, 1)[0].astype(np.float64)
    along = (bind[:, 0] - bind[:, 0].min()) / np.ptp(bind[:, 0]) * 3
    joints = [bind[:, 0].min() + np.ptp(bind[:, 0]) * k / 3 for k in range(3)]
    frames = []
    for angle in np.linspace(0, 0.8, 20):
        frame, turned = bind.copy(), np.eye(3, 4)
        for k, x in enumerate(joints):
            hinge = turned[:, :3] @ [x, 0, 0] + turned[:, 3]
            turn = Rotation.from_euler("z", angle * (k > 0)).as_matrix() @ turned[:, :3]
            turned = np.concatenate([turn, (hinge - turn @ [x, 0, 0])[:, None]], axis=1)
            own = along >= k
            frame[own] = bind[own] @ turned[:, :3].T + turned[:, 3]
        frames.append(frame)
    return replace(tube, positions=np.array(frames, np.float32))


@pytest.mark.slow
def test_rigid_joints_turn_and_hang_together(tmp_path: Path) -> None:
    """Nothing is sheared; each joint is one node below its parent, and engines show what the skin says."""
    sequence = bent_arm()
    skin = gvpipe.skin(sequence, joints=3, rigid=True)
    assert skin.parents is not None and skin.pivots is not None and skin.error < 2e-3
    linear = skin.transforms[:, :, :3, :3]
    square = linear @ np.swapaxes(linear, -1, -2)
    size = np.trace(square, axis1=-2, axis2=-1)[..., None, None] / 3
    assert np.abs(square - size * np.eye(3)).max() < 1e-9 and (np.linalg.det(linear) > 0).all()
    assert (skin.parents < 0).sum() == 1  # one tree
    gvpipe.write(sequence, tmp_path / "a.glb", skin=skin)
    nodes = _tree(tmp_path / "a.glb")["nodes"]
    assert sum(node["name"].startswith("joint_") for node in nodes if "name" in node) == skin.joints
    assert farthest(gvpipe.read(tmp_path / "a.glb").read(0, 20), skin.read(0, 20)) < max(1e-5, 0.02 * skin.error)
    shown = shown_by("Babylon.js", tmp_path / "a.glb", [0, 10 / sequence.fps])
    assert farthest(shown, skin.read(0, 20)[[0, 10]]) < max(1e-5, 0.02 * skin.error)


def test_rigid_parts_that_vanish_for_a_while(tmp_path: Path) -> None:
    """A part at one point, as hidden ones are: its joint stays one on which others can hang, and nothing flies off."""
    arm = bent_arm()
    frames = arm.read(0, 20)
    n = frames.shape[1]
    piece = frames[:, : n // 3] + np.array([0, 0, 0.5], np.float32)
    piece[5:10] = piece[5:10, :1]
    faces = arm.faces[(arm.faces < n // 3).all(axis=1)]
    both = np.concatenate([arm.faces, faces + n]).astype(np.int32)
    sequence = replace(arm, positions=np.concatenate([frames, piece], axis=1), faces=both)
    skin = gvpipe.skin(sequence, joints=6, rigid=True)
    gvpipe.write(sequence, tmp_path / "a.glb", skin=skin)
    read, own = gvpipe.read(tmp_path / "a.glb"), skin.read(0, 20)
    assert farthest(read.read(0, 20), own) < max(1e-5, 0.03 * skin.error)
    halves = read_poses(tmp_path / "a.glb").at(np.asarray((np.arange(19) + 0.5) / sequence.fps, np.float64))
    low, high = own.min(axis=(0, 1)), own.max(axis=(0, 1))
    assert (halves > low - (high - low)).all() and (halves < high + (high - low)).all()


def test_one_frame_of_a_skeleton(tmp_path: Path) -> None:
    for rigid_joints in (False, True):
        skin = gvpipe.skin(bent_arm(), joints=3, rigid=rigid_joints).part(7, 8)
        gvpipe.write(bent_arm().part(7, 8), tmp_path / "a.glb", skin=skin)
        assert farthest(gvpipe.read(tmp_path / "a.glb").read(0, 1), skin.read(0, 1)) < 1e-4


def test_rigid_joints_lie_at_the_hinges() -> None:
    sequence = bent_arm()
    skin = gvpipe.skin(sequence, joints=3, rigid=True)
    assert skin.pivots is not None and skin.parents is not None
    low, size = float(sequence.read(0, 1)[0, :, 0].min()), float(np.ptp(sequence.read(0, 1)[0, :, 0]))
    found = skin.pivots[skin.parents >= 0, 0]
    for hinge in (low + size / 3, low + 2 * size / 3):
        assert np.abs(found - hinge).min() < 0.1 * size


def test_similar_motions_are_found() -> None:
    draw = np.random.default_rng(0)
    points = draw.normal(size=(20, 3))
    turns = Rotation.random(5, random_state=1).as_matrix() * draw.uniform(0.5, 2, 5)[:, None, None]
    shifts = draw.normal(size=(5, 3))
    targets = np.einsum("fab,nb->fna", turns, points) + shifts[:, None]
    found = similar(points, draw.random(20), targets)
    assert np.allclose(found[..., :3], turns) and np.allclose(found[..., 3], shifts)
    mirrored = similar(points, np.ones(20), points[None] * [1, 1, -1])
    assert np.linalg.det(mirrored[0, :, :3]) > 0


def test_fewer_joints_err_more() -> None:
    sequence = waving(10, 12)
    errors = [gvpipe.skin(sequence, joints=count).error for count in (1, 4, 16)]
    assert errors[0] > errors[1] > errors[2]


def test_all_else_travels(tmp_path: Path) -> None:
    """Parts, materials, pictures, colours, uv; the scene's axes and unit are the skeleton's."""
    sequence = scene()
    skin = gvpipe.skin(sequence)
    gvpipe.write(sequence, tmp_path / "plain.glb")
    gvpipe.write(sequence, tmp_path / "skin.glb", skin=skin)
    plain, found = gvpipe.read(tmp_path / "plain.glb"), gvpipe.read(tmp_path / "skin.glb")
    assert found.materials == plain.materials and found.images == plain.images
    assert [part.name for part in found.parts] == [part.name for part in plain.parts]
    assert set(found.attributes) == set(plain.attributes) and np.array_equal(found.faces, plain.faces)
    assert farthest(found.read(0, found.n_frames), plain.read(0, plain.n_frames)) < 3 * skin.error + 1e-5


def two_clips(tmp_path: Path) -> Path:
    """A glTF file of a mesh that goes to x in one clip of 10 frames, and to z in one of 6, as the skin writer makes it."""
    n, place = 9, np.eye(4)
    bind = waving(3, 1).read(0, 1)[0]
    transforms = np.tile(place, (16, 1, 1, 1))
    transforms[:10, 0, 0, 3] = np.linspace(0, 2, 10)
    transforms[10:, 0, 2, 3] = np.linspace(-1, 3, 6)
    weights = np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1))
    skin = Skin(np.zeros((n, 4), np.int32), weights, bind, transforms, 0.0, (Clip("go", 0, 10), Clip("stand up", 10, 16)))
    gvpipe.write(replace(waving(3, 16), positions=skin.read(0, 16)), tmp_path / "two.glb", skin=skin)
    return tmp_path / "two.glb"


def test_all_clips_have_one_skeleton(tmp_path: Path, run: Any) -> None:
    path = two_clips(tmp_path)
    ended = run("convert", path, tmp_path / "out.glb", "--skin", "--clip", "all", "--json")
    assert json.loads(ended.out)["clips"] == ["go", "stand up"] and json.loads(ended.out)["frames"] == 16
    assert "others of the file" not in ended.err
    for name, n_frames in (("go", 10), ("stand up", 6)):
        given, found = gvpipe.read(path, clip=name), gvpipe.read(tmp_path / "out.glb", clip=name)
        assert found.n_frames == given.n_frames == n_frames
        assert farthest(found.read(0, n_frames), given.read(0, n_frames)) < 2e-3
    assert len(_tree(tmp_path / "out.glb")["skins"]) == 1
    assert gvpipe.read(path, clip="stand up").read(0, 1)[0, :, 2].min() == pytest.approx(-1, abs=0.1)
    ended = run("convert", path, tmp_path / "b.glb", "--clip", "all")
    assert ended.status == 2 and "--clip all is for --skin" in ended.err
    ended = run("convert", path, tmp_path / "b.usdc", "--skin", "--clip", "all")
    assert ended.status == 2 and "--clip all is for --skin, a .glb" in ended.err
    with pytest.raises(InputError, match="USD has one animation"):
        one = waving(3, 4)
        gvpipe.write(one, tmp_path / "b.usdc", skin=replace(gvpipe.skin(one), clips=(Clip("a", 0, 1), Clip("b", 1, 4))))
    assert not list(tmp_path.glob("b.*"))


def test_clips_must_be_of_one_mesh() -> None:
    with pytest.raises(InputError, match="'b' of .* has other triangles than 'a'"):
        join_clips([("a", waving(3, 4)), ("b", waving(4, 4))])
    with pytest.raises(InputError, match="another frame rate"):
        join_clips([("a", waving(3, 4)), ("b", waving(3, 4).with_fps(7))])
    joined, clips = join_clips([("a", waving(3, 4)), ("b", waving(3, 7))])
    assert [tuple(each) for each in clips] == [("a", 0, 4), ("b", 4, 11)]
    assert np.array_equal(joined.read(2, 6), np.concatenate([waving(3, 4).read(2, 4), waving(3, 7).read(0, 2)]))


@pytest.mark.parametrize("suffix", [".usdc", ".usda", ".usdz"])
def test_usd_has_the_skeleton(suffix: str, tmp_path: Path) -> None:
    """USD's own library plays it as the skin does, but for its half-float scales; all else is as without a skeleton."""
    pytest.importorskip("pxr")
    sequence = replace(scene(), origin=np.array([1000.0, -20.0, 3.0]))
    skin = gvpipe.skin(sequence)
    gvpipe.write(sequence, tmp_path / f"plain{suffix}")
    gvpipe.write(sequence, tmp_path / f"skin{suffix}", skin=skin)
    plain, found = gvpipe.read(tmp_path / f"plain{suffix}"), gvpipe.read(tmp_path / f"skin{suffix}")
    assert (found.n_frames, found.fps) == (plain.n_frames, plain.fps) and found.not_carried == ()
    assert [part.name for part in found.parts] == [part.name for part in plain.parts] and not any(
        part.parent for part in found.parts
    )
    assert found.materials == plain.materials and np.array_equal(found.faces, plain.faces)
    absolute = skin.read(0, sequence.n_frames) + sequence.origin
    assert farthest(found.read(0, found.n_frames) + found.origin, absolute) < 3e-4


def test_usd_has_a_tree_of_rigid_joints_and_corrective_shapes(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdSkel

    for name, sequence, target in (("a", bent_arm(), None), ("b", wrinkled(), 0.2)):
        skin = gvpipe.skin(sequence, 3 if target is None else 2, target_kg=target, rigid=True)
        path = tmp_path / f"{name}.usdc"
        assert len(gvpipe.write(sequence, path, skin=skin)) == 1  # of the unit of length
        stage = Usd.Stage.Open(str(path))  # kept while its prims are looked at
        prims = list(stage.Traverse())
        (skeleton,) = (UsdSkel.Skeleton(prim) for prim in prims if prim.IsA(UsdSkel.Skeleton))
        names = list(skeleton.GetJointsAttr().Get())
        assert skin.parents is not None
        assert len(names) == skin.joints and sum("/" in each for each in names) == np.count_nonzero(skin.parents >= 0)
        shown = [prim for prim in prims if prim.IsA(UsdSkel.BlendShape)]  # those that change a part, for each part
        assert len(shown) == sum(skin.shapes[:, slice(*part.vertices)].any(axis=(1, 2)).sum() for part in sequence.parts)
        found = gvpipe.read(path).read(0, sequence.n_frames)
        assert farthest(found, skin.read(0, sequence.n_frames)) < 3e-4


def test_usd_of_a_video_turns_no_wrong_normals(tmp_path: Path, run: Any) -> None:
    """A file's bind pose is no frame, so its normals are left out, and a note says so."""
    pytest.importorskip("pxr")
    ended = run("decode", RIGID, tmp_path / "a.usdc", "--skin", "--json")
    assert json.loads(ended.out)["joints"] >= 1
    with gvpipe.open(RIGID) as video:
        assert farthest(gvpipe.read(tmp_path / "a.usdc").read(0, len(video)), video[:]) < 1e-4
    assert json.loads(run("decode", RIGID, tmp_path / "b.usdc", "--json").out)["joints"] == 0  # by default what is exact
    later = gvpipe.write(scene().part(4, 10), tmp_path / "c.usdc", skin=gvpipe.skin(scene()).part(4, 10))
    assert any("normals are left out" in note for note in later)


def test_what_is_refused(tmp_path: Path) -> None:
    sequence = waving(4, 5)
    skin = gvpipe.skin(sequence, joints=2)
    with pytest.raises(InputError, match="one .glb or USD"):
        gvpipe.write(sequence, tmp_path / "a.abc", skin=skin)
    with pytest.raises(InputError, match="one .glb"):
        gvpipe.write(sequence, tmp_path / "%d.glb", skin=skin)
    with pytest.raises(InputError, match="5 frames of 16 vertices, the sequence 4 of 16"):
        gvpipe.write(sequence.part(0, 4), tmp_path / "a.glb", skin=skin)
    with pytest.raises(InputError, match="names joints 0..9"):
        replace(skin, indices=skin.indices + np.int32(9 - skin.indices.max()) * (skin.indices == skin.indices.max()))
    with pytest.raises(InputError, match="of shapes"):
        replace(skin, weights=skin.weights[:, :3])
    for size in np.array([0.5, -1, np.nan], np.float32):
        with pytest.raises(InputError, match="add up to 1"):
            replace(skin, weights=size * skin.weights)
    with pytest.raises(InputError, match="not finite"):
        replace(skin, transforms=skin.transforms * np.nan)
    for parents in ([0] * skin.joints, [skin.joints] * skin.joints, [-1]):
        with pytest.raises(InputError, match="a skin's parents"):
            replace(skin, parents=np.array([*parents], np.int32))
    with pytest.raises(InputError, match="pivots"):
        replace(skin, pivots=np.zeros((1, 2)))
    with pytest.raises(InputError, match="clip 'a' is of frames"):
        replace(skin, clips=(Clip("a", 0, 99),))
    for shapes, weights in (((2, 3, 3), (5, 2)), ((2, 16, 3), (4, 2))):
        with pytest.raises(InputError, match="a skin's shapes are"):
            replace(skin, shapes=np.zeros(shapes, np.float32), shape_weights=np.zeros(weights))
    with pytest.raises(InputError, match="shapes or their weights are not finite"):
        replace(skin, shapes=np.full((1, 16, 3), np.nan, np.float32), shape_weights=np.ones((5, 1)))
    with pytest.raises(SettingError, match="correctives is"):
        gvpipe.skin(sequence, correctives=-1)
    for joints in (-1, 1025):
        with pytest.raises(SettingError, match="joints is"):
            gvpipe.skin(sequence, joints=joints)
    wrong: Any = (True, "4", 4.0)
    for joints in wrong:
        with pytest.raises(TypeError, match="joints is"):
            gvpipe.skin(sequence, joints=joints)
    for call in (lambda: gvpipe.skin(wrong), lambda: gvpipe.write(sequence, tmp_path / "a.glb", skin=wrong)):
        with pytest.raises(TypeError, match="is needed"):
            call()
    for kg in (0.0, -1.0, float("nan")):
        with pytest.raises(SettingError, match="target KG is"):
            gvpipe.skin(sequence, target_kg=kg)
    with pytest.raises(InputError, match="one frame"):
        gvpipe.skin(sequence.part(0, 1))
    assert not list(tmp_path.iterdir())


def test_what_no_skeleton_can_do(tmp_path: Path, run: Any) -> None:
    """An error that none holds is said with what is reached; one joint is a skeleton; more than glTF numbers are refused."""
    source = _saved(waving(4, 5), tmp_path)
    ended = run("convert", source, tmp_path / "a.glb", "--skin", "--joints", "1", "--target-kg", "1e-9", "--correctives", "0")
    assert ended.status == 0 and "a skeleton of one joint moves it: KG" in ended.err
    assert "no skeleton that was tried holds the error asked for; allow more" in ended.err
    skin = gvpipe.skin(waving(4, 5), joints=1)
    wide = replace(skin, transforms=np.tile(np.eye(4), (5, 65537, 1, 1)))
    with pytest.raises(InputError, match="65537 joints; glTF holds 65536"):
        gvpipe.write(waving(4, 5), tmp_path / "b.glb", skin=wide)
    point = MeshSequence(np.zeros((3, 1, 3), np.float32), np.zeros((0, 3), np.int32), 24)
    with pytest.raises(InputError, match="no triangles"):
        gvpipe.write(point, tmp_path / "b.glb", skin=gvpipe.skin(point))
    assert not (tmp_path / "b.glb").exists()


def test_still_and_small_sequences(tmp_path: Path) -> None:
    still = replace(waving(4, 5), positions=np.broadcast_to(waving(4, 5).read(0, 1), (5, 16, 3)).copy())
    skin = gvpipe.skin(still)
    assert skin.error < 1e-6
    gvpipe.write(still, tmp_path / "a.glb", skin=skin)
    assert gvpipe.read(tmp_path / "a.glb").n_frames == 5


def test_normals_where_the_first_frame_is_not_the_bind_pose(tmp_path: Path) -> None:
    """Engines turn normals with the joints, so that the bind pose has its own, not the first frame's."""
    still = waving(4, 1)
    turns = Rotation.from_rotvec(np.arange(6)[:, None] * [0.3, 0.2, 0.1]).as_matrix()
    sequence = replace(still, positions=np.einsum("kab,vb->kva", turns, still.read(0, 1)[0]).astype(np.float32))
    skin = gvpipe.skin(sequence)
    assert np.abs(skin.transforms[4, :, :3, :3] - np.eye(3)).max() > 0.5
    for name, start in (("whole", 0), ("part", 4)):
        gvpipe.write(sequence.part(start, 6), tmp_path / f"{name}.glb", skin=skin.part(start, 6))
    whole, part = (trimesh.load_mesh(tmp_path / f"{name}.glb", process=False).vertex_normals for name in ("whole", "part"))
    expected = trimesh.Trimesh(sequence.read(0, 1)[0], sequence.faces, process=False).vertex_normals
    np.testing.assert_allclose(whole, part, atol=1e-4)
    assert (whole * expected).sum(axis=1).min() > 0.99


def test_decode_and_convert(tmp_path: Path, run: Any) -> None:
    ended = run("decode", RIGID, tmp_path / "a.glb", "--json")
    values = json.loads(ended.out)
    assert values["joints"] >= 1 and "written with a skeleton" in values["notes"][0]
    assert "skins" in _tree(tmp_path / "a.glb")
    assert json.loads(run("decode", RIGID, tmp_path / "b.glb", "--no-skin", "--json").out)["joints"] == 0
    assert "skins" not in _tree(tmp_path / "b.glb")
    ended = run("decode", GOLDEN / "pca-1-lsp.mp4", tmp_path / "c.glb")
    assert ended.status == 0 and "written with morph targets, since the file has no skeleton" in ended.err
    assert "morph targets" in run("decode", GOLDEN / "mcgv-1-h264.mp4", tmp_path / "d.glb").err
    assert "up to" in run("decode", GOLDEN / "mcgv-1-h264.mp4", tmp_path / "d.glb", "--skin").err
    ended = run("decode", GOLDEN / "pca-1-lsp.mp4", tmp_path / "e.glb", "--skin")
    assert ended.status == 1 and "gvpipe convert --skin" in ended.err and not (tmp_path / "e.glb").exists()
    gvpipe.write(rigid(), tmp_path / "in.npz")
    ended = run("convert", tmp_path / "in.npz", tmp_path / "f.glb", "--skin", "--target-kg", "0.05", "--json")
    assert json.loads(ended.out)["joints"] >= 2 and "a skeleton of" in ended.err
    assert run("convert", tmp_path / "in.npz", tmp_path / "g.glb", "--joints", "4").status == 2
    assert run("convert", tmp_path / "in.npz", tmp_path / "g.abc", "--skin").status == 2
    ended = run("convert", tmp_path / "in.npz", tmp_path / "g.glb", "--skin", "--frames", "0:1")
    assert ended.status == 1 and "one frame" in ended.err
    ended = run("decode", RIGID, tmp_path / "g.glb", "--skin", "--frames", "3:4")
    assert ended.status == 1 and "one frame" in ended.err and not (tmp_path / "g.glb").exists()
    assert run("decode", RIGID, tmp_path / "h.glb", "--frames", "3:9").status == 0
    assert gvpipe.read(tmp_path / "h.glb").n_frames == 6
    ended = run("convert", tmp_path / "in.npz", tmp_path / "r.glb", "--skin", "--joints", "rigid:4", "--json")
    assert ended.status == 0 and "a rigid skeleton of" in ended.err and json.loads(ended.out)["joints"] >= 2
    gvpipe.encode(rigid(), tmp_path / "levels.mp4", "pca")
    ended = run("convert", tmp_path / "levels.mp4", tmp_path / "lod.glb", "--lod", "1", "--skin", "--json")
    assert json.loads(ended.out)["vertices"] == gvpipe.read(tmp_path / "lod.glb").n_vertices < 288
    ended = run("convert", tmp_path / "in.npz", tmp_path / "s.glb", "--skin", "--joints", "stiff")
    assert ended.status == 2 and "--joints is 'stiff'" in ended.err
    frames = tmp_path / "frames"
    gvpipe.write(waving(4, 5), frames / "%02d.obj")
    gvpipe.write(waving(3, 4), frames / "%02d.obj", 5)
    gvpipe.write(waving(4, 1), frames / "%02d.obj", 9)
    ended = run("convert", frames, tmp_path / "shots.glb", "--skin", "--split", "--compress", "meshopt", "--json")
    assert [each["joints"] > 0 for each in json.loads(ended.out)["files"]] == [True, True, False]
    assert [gvpipe.read(tmp_path / f"shots-00{k}.glb").n_frames for k in range(3)] == [5, 4, 1]
    assert "shots-001.glb: a skeleton of" in ended.err
    gvpipe.write(waving(40, 60), tmp_path / "heavy.npz")
    ended = run("convert", tmp_path / "heavy.npz", tmp_path / "heavy.glb")
    assert "lighter with --skin (within --target-kg) and --compress meshopt" in ended.err
    ended = run("convert", tmp_path / "in.npz", tmp_path / "i.glb", "--skin", "--joints", "8", "--frames", "0:2")
    assert ended.status == 0 and "leave out --skin" in ended.err
    assert "no skeleton that was tried" not in ended.err  # no error was asked for


def _tree(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    tree: dict[str, Any] = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    return tree
