"""Read, encoded within a bound, decoded, written, and read by another library: every vertex is within the bound.

Readers: usd-core, Alembic's own library, trimesh, and three.js in Node for animated glTF.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from folders import DATA

import gvpipe
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence

N_FRAMES = 5
THREE = Path(gvpipe.__file__).parent / "web" / "node_modules" / "three"
PART = 1e-4  # 0.01 % of the diagonal
ASSETS = {
    "man": "gltf/CesiumMan_Binary/CesiumMan.glb",
    "mix": "abc/mix1_abc/mix1_abc.abc",
    "bunny": "usd/bunny_walk_skel/bunny_walk_skel.usdc",
}


def by_usd(path: Path) -> Any:
    """Points of all meshes, frame by frame, in world space."""
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    stage: Any = Usd.Stage.Open(str(path))
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    frames = []
    for code in np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1):
        placed = []
        for mesh in meshes:
            points = np.array(mesh.GetPointsAttr().Get(float(code)), np.float64)
            world = np.array(UsdGeom.Imageable(mesh).ComputeLocalToWorldTransform(float(code)))
            placed.append(points @ world[:3, :3] + world[3, :3])
        frames.append(np.concatenate(placed))
    return np.stack(frames)


def by_alembic(path: Path) -> Any:
    """Positions of all meshes, sample by sample; their transforms are checked to move nothing."""
    pytest.importorskip("alembic3d")
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(path))
    held: list[Any] = []

    def visit(item: Any) -> None:
        for child in (item.getChild(number) for number in range(item.getNumChildren())):
            schema = child.getMetaData().get("schema")
            if schema == "AbcGeom_PolyMesh_v1":
                held.append(AbcGeom.IPolyMesh(item, child.getName()))
            elif schema == "AbcGeom_Xform_v3":
                assert AbcGeom.IXform(item, child.getName()).getSchema().getNumOps() == 0
            visit(child)

    visit(archive.getTop())
    meshes = []
    for mesh in held:
        positions = mesh.getSchema().getPositionsProperty()
        times = [positions.getTimeSampling().getSampleTime(sample) for sample in range(positions.getNumSamples())]
        meshes.append(np.stack([np.array(positions.getValue(Abc.ISampleSelector(float(time)))) for time in times]))
    return np.concatenate(meshes, axis=1)


def by_trimesh(folder: Path) -> Any:
    """Vertices of frame files; formats split and order them in their own ways.

    trimesh reads no binary PLY whose faces differ in length and have texture coordinates, so PLY is written as triangles.
    """
    import trimesh

    meshes: list[Any] = [trimesh.load(path, process=False, force="mesh") for path in sorted(folder.glob("[0-9]*"))]
    return [np.asarray(mesh.vertices, np.float64) for mesh in meshes]


def by_three(path: Path) -> Any:
    """Vertices of an animated .glb in world space, frame by frame."""
    node = shutil.which("node")
    if node is None or not THREE.exists():
        pytest.skip("Node or three.js is not there: cd gvpipe/web && npm ci")
    script = Path(__file__).parents[1] / "three_positions.mjs"
    command = [node, str(script), str(THREE), str(path), str(N_FRAMES), repr(gvpipe.read(path).fps)]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    return np.frombuffer(done.stdout).reshape(N_FRAMES, -1, 3)


READERS: dict[str, Callable[[Path], Any]] = {
    "a.usdc": by_usd,
    "a.usdz": by_usd,
    "a.abc": by_alembic,
    "a.glb": by_three,
    "out/%02d.glb": by_trimesh,
    "out/%02d.ply": by_trimesh,
    "out/%02d.obj": by_trimesh,
}


@pytest.fixture(scope="module", params=["scene", *(pytest.param(name, marks=pytest.mark.slow) for name in ASSETS)])
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[MeshSequence, MeshSequence]:
    """An asset, and what is decoded of it."""
    path = DATA / "assets" / ASSETS.get(request.param, "")
    if request.param in ASSETS and not path.exists():
        pytest.skip("the shared data are not there")
    source = gvpipe.read(path).part(0, N_FRAMES) if request.param in ASSETS else scene(N_FRAMES)
    video = tmp_path_factory.mktemp("others") / "a.mp4"
    gvpipe.encode(source, video, "pca", max_error="0.01%")
    return source, gvpipe.decode(video)


@pytest.mark.parametrize("name", READERS)
def test_positions_are_within_the_bound(pair: tuple[MeshSequence, MeshSequence], name: str, tmp_path: Path) -> None:
    from scipy.spatial import cKDTree

    source, decoded = pair
    if name.endswith(".ply"):
        decoded = replace(decoded, polygons=None)
    gvpipe.write(decoded, tmp_path / name)
    found = READERS[name]((tmp_path / name).parent if "%" in name else tmp_path / name)
    expected = source.read_absolute(0, N_FRAMES)
    bound = PART * frame_diagonal(source) * (1 + 1e-5) + 1e-6 * float(np.abs(expected).max())
    assert len(found) == N_FRAMES
    for ours, theirs in zip(expected, found, strict=True):
        if name in ("a.usdc", "a.usdz", "a.abc"):
            assert float(np.max(np.linalg.norm(ours - theirs, axis=1))) <= bound
            continue
        if name.endswith(".glb"):
            theirs = _back(theirs, source)
        used = ours[np.unique(source.faces)]
        for given, searched in ((used, theirs), (theirs, ours)):
            assert float(np.max(cKDTree(searched).query(given)[0])) <= bound


def _back(points: Any, source: MeshSequence) -> Any:
    """Points in metres with Y up, in the axes and the unit of the source."""
    turned = {"z": points[:, [0, 2, 1]] * [1, -1, 1], "x": points[:, [1, 0, 2]] * [1, -1, 1]}
    return turned.get(source.metadata.up_axis, points) / (source.metadata.metres_per_unit or 1.0)
