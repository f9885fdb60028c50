"""The metrics that `compare` measures where they are asked for, against trimesh, closed forms and plain loops."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.metrics import surface_comparison
from gvpipe.metrics.dihedral import Dame
from gvpipe.metrics.frame_metrics import FrameMetric, check_metrics, vertex_psnr
from gvpipe.metrics.roughness import Roughness, perceptual_distance
from gvpipe.metrics.surface import surface_distances
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence


@pytest.fixture(autouse=True)
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_comparison, "SAMPLES", 300)
    monkeypatch.setattr(surface_comparison, "GRID", 33)


def _bumpy(seed: int, size: float, is_open: bool) -> tuple[Float64, Int32]:
    ball = trimesh.creation.icosphere(subdivisions=2)
    faces = np.asarray(ball.faces, np.int32)
    points = np.asarray(ball.vertices) + np.random.default_rng(seed).normal(0, size, ball.vertices.shape)
    return points, faces[25:] if is_open else faces


# DAME


def _trimesh_angles(points: Float64, faces: Int32) -> tuple[Float64, Float64]:
    """Oriented angles of trimesh's pairs of neighbours, and the areas of both together."""
    mesh = trimesh.Trimesh(points, faces, process=False)
    signed = np.where(mesh.face_adjacency_convex, 1, -1) * mesh.face_adjacency_angles
    return signed, mesh.area_faces[mesh.face_adjacency].sum(axis=1)


@pytest.mark.parametrize("is_open", [False, True])
def test_dame_is_what_trimesh_adjacency_gives(is_open: bool) -> None:
    (points, faces), (moved, _) = _bumpy(1, 0.03, is_open), _bumpy(2, 0.05, is_open)
    (before, weights), (after, _) = _trimesh_angles(points, faces), _trimesh_angles(moved, faces)
    wanted = (weights * np.abs(before - after) * np.exp(-(before**2))).sum() / weights.sum()
    assert Dame(faces).of(points[None], moved[None])[0] == pytest.approx(wanted, rel=1e-6)  # trimesh's angles are by arccos


def test_dame_of_a_hinge() -> None:
    """Two triangles of one area: the angle's change, times the masking of the angle before."""
    hinge = np.array(
        [[[0, 0, 0], [0, 1, 0], [-1, 0, 0], [math.cos(angle), 0, -math.sin(angle)]] for angle in (0.2, 0.5, -0.1, 0.2)]
    )
    faces = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    found = Dame(faces).of(hinge[[0, 0, 0]], hinge[[1, 2, 3]])
    assert found == pytest.approx(np.array([0.3, 0.3, 0]) * math.exp(-0.04))
    moved = hinge[:1][:, :, [1, 2, 0]] * 7 + 3  # turned, enlarged, shifted
    assert Dame(faces).of(hinge[:1], moved)[0] == pytest.approx(0, abs=1e-12)


# FMPD


def _plain_fmpd(one: Float64, other: Float64, faces: Int32) -> float:
    """The published program's steps, a vertex and a matrix entry at a time."""
    (rough_one, mass_one), (rough_other, mass_other) = (_plain_roughness(points, faces) for points in (one, other))
    means = [(rough * mass).sum() / mass.sum() for rough, mass in ((rough_one, mass_one), (rough_other, mass_other))]
    turning, top = max(min(means), 0.0005), max(0.2, 5 * min(means))

    def seen(value: float) -> float:
        power: float = min(max(value, 0.0005), top) ** 0.15 - 0.0005**0.15
        corner = turning**0.15 - 0.0005**0.15
        return power if power <= corner else (power - corner) / 2 + corner

    sums = [
        sum(seen(value) * area for value, area in zip(rough, mass, strict=True)) / mass.sum()
        for rough, mass in ((rough_one, mass_one), (rough_other, mass_other))
    ]
    return float(min(1.0, 8 * abs(sums[0] - sums[1])))


def _plain_roughness(points: Float64, faces: Int32) -> tuple[Float64, Float64]:
    n = len(points)
    curvature, mass, laplacian = np.full(n, 2 * math.pi), np.zeros(n), np.zeros((n, n))
    sides = {(a, b) for f in faces.tolist() for a, b in zip(f, f[1:] + f[:1], strict=True)}
    for vertex in {v for a, b in sides if (b, a) not in sides for v in (a, b)}:
        curvature[vertex] = math.pi
    for face in faces:
        for k in range(3):
            i, j, m = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            p, q = points[j] - points[i], points[m] - points[i]
            angle = math.acos(p @ q / np.linalg.norm(p) / np.linalg.norm(q))
            curvature[i] -= angle
            weight = min(max(1 / math.tan(angle) / 2, 0.001), 1000)
            for a, b in ((j, m), (m, j)):
                laplacian[a, b] -= weight
                laplacian[a, a] += weight
            mass[i] += np.linalg.norm(np.cross(p, q)) / 6
    return np.abs(laplacian @ np.abs(curvature)) / np.maximum(np.diag(laplacian), 1e-300), mass  # 0 of unused vertices


@pytest.mark.parametrize(("is_open", "size"), [(False, 0.02), (True, 0.004)])
def test_fmpd_is_what_plain_loops_give(is_open: bool, size: float) -> None:
    (points, faces), (moved, _) = _bumpy(1, 0.01, is_open), _bumpy(2, size, is_open)
    rough = Roughness(faces, len(points))
    found = perceptual_distance(rough.of(points[None]), rough.of(moved[None]))[0]
    assert 0 < found < 1
    assert found == pytest.approx(_plain_fmpd(points, moved, faces), rel=1e-9)


def test_fmpd_of_equal_corners_is_nothing() -> None:
    """All vertices of a tetrahedron have the curvature pi: no roughness, at any size."""
    tetrahedron = trimesh.creation.icosahedron()
    points, faces = np.asarray(tetrahedron.vertices), np.asarray(tetrahedron.faces, np.int32)
    rough, areas = Roughness(faces, len(points)).of(np.stack([points, 2 * points]))
    assert rough == pytest.approx(0, abs=1e-12)
    assert areas.sum(axis=1) == pytest.approx([tetrahedron.area, 4 * tetrahedron.area])


def test_collapsed_triangles_are_measured() -> None:
    flat = np.zeros((2, 4, 3))
    flat[1, :, 0] = [0, 1, 2, 2]
    faces = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    assert Dame(faces).of(flat, flat).tolist() == [0, 0]
    rough = Roughness(faces, 4).of(flat)
    assert np.isfinite(rough).all() and perceptual_distance(rough, rough).tolist() == [0, 0]


# The others


def test_vertex_psnr() -> None:
    assert vertex_psnr(0.1, 10.0) == pytest.approx(40)
    assert vertex_psnr(0.0, 1.0) == vertex_psnr(1e-9, 1.0) == 99.99
    assert vertex_psnr(0.0, 0.0) is None


def test_mesh_counts_by_area_alone() -> None:
    """A square, shifted by 0.5 within itself: a sixth of the area is 0 to 0.5 away, evenly; many vertices are 0.5 away."""
    square, faces = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])
    side = np.column_stack([np.zeros(2000), np.linspace(4, 0, 2000), np.zeros(2000)])
    fan = np.column_stack([np.full(2001, 1), np.arange(2001) + 2, np.arange(2001) + 3])
    crowded = np.concatenate([square[:1] - [9, 0, 0], square[1:3], side, square[:1]])  # from a corner to all of that side
    errors = surface_distances(crowded, fan, np.add(square, [0.5, 0, 0]), faces, samples=20_000, grid=0)
    assert errors.mesh_rms == pytest.approx(math.sqrt(0.25 / 3 / 6), rel=0.01)
    assert errors.mesh_rms_diag == pytest.approx(errors.mesh_rms / np.linalg.norm(np.ptp(crowded, axis=0)))
    assert errors.rms > 1.2 * errors.mesh_rms


# `compare`


def _pair() -> tuple[MeshSequence, MeshSequence]:
    reference = waving(6, 4)
    moved = np.asarray(reference.positions[:]) + np.random.default_rng(0).normal(0, 0.002, reference.positions.shape)
    moved[2] = reference.positions[2:3][0]
    return reference, MeshSequence(moved.astype(np.float32), reference.faces, reference.fps, name="moved")


def test_compare_measures_what_is_asked_for() -> None:
    reference, moved = _pair()
    assert gvpipe.compare(reference, moved).metrics == {}
    errors = gvpipe.compare(reference, moved, metrics=["psnr", "DAME", "fmpd", "mesh", "d1", "d2", "psnr"])
    assert list(errors.metrics) == ["psnr", "dame", "fmpd", "mesh", "d1", "d2"]
    assert errors.surface is not None
    assert errors.metrics["mesh"].value == pytest.approx(errors.surface.mesh_rms)
    assert errors.metrics["d1"].frames == [frame["d1_psnr"] for frame in errors.surface.frames]
    for name, metric in errors.metrics.items():
        assert metric.value == pytest.approx(math.fsum(frame or 0 for frame in metric.frames) / 4), name
        assert (metric.frames[2] or 0) == pytest.approx(99.99 if name in ("psnr", "d1", "d2") else 0), name
        assert len(metric.frames) == 4
    alone = gvpipe.compare(reference.part(1, 2), moved.part(1, 2), metrics="dame,fmpd", surface=False).metrics
    assert alone["dame"].value == errors.metrics["dame"].frames[1]
    assert alone["fmpd"].value == errors.metrics["fmpd"].frames[1]


def test_order_does_not_matter() -> None:
    reference, moved = _pair()
    order = np.random.default_rng(1).permutation(reference.n_vertices)
    shuffled = moved.reordered(order, np.argsort(order)[moved.faces].astype(np.int32))
    found = [gvpipe.compare(reference, each, metrics="dame,fmpd,psnr").metrics for each in (moved, shuffled)]
    for name, metric in found[0].items():
        assert found[1][name].frames == pytest.approx(metric.frames, abs=1e-9), name


def test_without_correspondence_some_have_no_numbers() -> None:
    reference, moved = _pair()
    other = waving(7, 4)
    found = gvpipe.compare(reference, other, metrics="psnr,dame,fmpd,mesh").metrics
    assert found["psnr"] == found["dame"] == FrameMetric(None, [])
    assert found["fmpd"].value is not None and found["mesh"].value is not None
    assert gvpipe.compare(Capture([reference]), Capture([moved]), metrics="fmpd").metrics["fmpd"].frames == pytest.approx(
        gvpipe.compare(reference, moved, metrics="fmpd").metrics["fmpd"].frames
    )


def test_points_have_no_angles() -> None:
    cloud = MeshSequence(np.random.default_rng(0).random((2, 5, 3)).astype(np.float32), np.zeros((0, 3), np.int32))
    found = gvpipe.compare(cloud, cloud, metrics="dame,fmpd,psnr").metrics
    assert found["dame"] == found["fmpd"] == FrameMetric(None, [None, None])
    assert found["psnr"].value == 99.99
    with pytest.raises(InputError, match="no surfaces to compare"):
        gvpipe.compare(cloud, cloud, metrics="mesh")


def test_a_wrong_name_gives_the_list() -> None:
    with pytest.raises(InputError, match=r"no metric is called 'damee'; did you mean 'dame'\?; choose from d1, d2, dame, fmpd"):
        check_metrics("psnr,damee")
    with pytest.raises(InputError, match="kg, da, sted, hausdorff are always measured"):
        gvpipe.compare("absent.npz", "absent.npz", metrics=["kg"])
    with pytest.raises(TypeError, match="names are needed"):
        check_metrics(3)  # type: ignore[arg-type]


def test_the_command_prints_and_lists_them(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("files")
    paths = [str(folder / name) for name in ("a.npz", "b.npz")]
    for path, each in zip(paths, _pair(), strict=True):
        gvpipe.write(each, path)
    run = CliRunner().invoke(cli, ["compare", *paths, "--metrics", "dame,psnr"])
    assert "dame " in run.stdout and "(frames: 0 to" in run.stdout
    found = json.loads(CliRunner().invoke(cli, ["compare", *paths, "--metrics", "dame,psnr", "--json"]).stdout)["metrics"]
    assert set(found) == {"dame", "psnr"} and set(found["dame"]) == {"value", "frames"} and len(found["dame"]["frames"]) == 4
    wrong = CliRunner().invoke(cli, ["compare", *paths, "--metrics", "sharpness"])
    assert isinstance(wrong.exception, InputError)
