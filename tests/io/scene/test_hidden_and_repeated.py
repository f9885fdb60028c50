"""USD and Alembic: meshes that are hidden for a while, and those that point instancers repeat."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError

HEAD = '#usda 1.0\n(\n defaultPrim = "W"\n startTimeCode = 1\n endTimeCode = 4\n timeCodesPerSecond = 24\n)\n'
MESH = """int[] faceVertexCounts = [3]
 int[] faceVertexIndices = [0, 1, 2]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
 uniform token subdivisionScheme = "none"
"""


def usd(folder: Path, body: str) -> gvpipe.MeshSequence:
    pytest.importorskip("pxr")
    (folder / "a.usda").write_text(HEAD + body)
    return gvpipe.read(folder / "a.usda")


def extents(sequence: gvpipe.MeshSequence, start: int = 0, stop: int = 3) -> list[float]:
    """The largest extent of some vertices, frame by frame."""
    found: list[float] = np.ptp(sequence.read(0, sequence.n_frames)[:, start:stop], axis=1).max(axis=1).tolist()
    return found


@pytest.mark.parametrize("above", [False, True])
def test_animated_visibility_of_usd(above: bool, tmp_path: Path) -> None:
    samples = 'token visibility.timeSamples = {1: "inherited", 3: "invisible", 4: "inherited"}\n'
    body = f'def Xform "W" {{\n {samples if above else ""} def Mesh "m" {{\n {MESH} {"" if above else samples} }}\n}}\n'
    found = usd(tmp_path, f'{body}def Mesh "n" {{\n {MESH} }}\n')
    assert extents(found) == [1, 1, 0, 1] and extents(found, 3, 6) == [1] * 4
    assert any("1 mesh is hidden in some frames" in note for note in found.notes)


def test_a_mesh_of_usd_that_is_never_visible(tmp_path: Path) -> None:
    samples = 'token visibility.timeSamples = {1: "invisible", 3: "invisible"}\n'
    found = usd(tmp_path, f'def Mesh "m" {{\n {MESH} {samples} }}\ndef Mesh "n" {{\n {MESH} }}\n')
    assert found.n_vertices == 3 and any("1 of 2 meshes are invisible" in note for note in found.notes)


def test_a_point_instancer(tmp_path: Path) -> None:
    """Two prototypes, one with a transform of its own and one below a group, below an instancer that is moved."""
    body = f"""def PointInstancer "W" {{
 double3 xformOp:translate = (0, 0, 10)
 uniform token[] xformOpOrder = ["xformOp:translate"]
 point3f[] positions.timeSamples = {{1: [(0, 0, 0), (5, 0, 0), (7, 0, 0)], 4: [(0, 0, 0), (8, 0, 0), (7, 3, 0)]}}
 quath[] orientations = [(1, 0, 0, 0), (0, 0, 0, 1), (1, 0, 0, 0)]
 float3[] scales = [(1, 1, 1), (1, 1, 1), (2, 2, 2)]
 int[] protoIndices = [0, 1, 0]
 rel prototypes = [</W/p>, </W/g>]
 def Mesh "p" {{
 double3 xformOp:translate = (0, 0, 1)
 uniform token[] xformOpOrder = ["xformOp:translate"]
 {MESH} }}
 def Xform "g" {{
  def Mesh "inner" {{
  double3 xformOp:translate = (0, 0, 2)
  uniform token[] xformOpOrder = ["xformOp:translate"]
  {MESH} }}
 }}
}}
"""
    found = usd(tmp_path, body)
    assert found.n_vertices == 9 and [part.name for part in found.parts] == ["p", "inner", "p"]
    first, last = found.read(0, 1)[0].reshape(3, 3, 3), found.read(3, 4)[0].reshape(3, 3, 3)
    np.testing.assert_allclose(first[:, 0], [[0, 0, 11], [5, 0, 12], [7, 0, 12]], atol=1e-5)
    np.testing.assert_allclose(last[:, 0], [[0, 0, 11], [8, 0, 12], [7, 3, 12]], atol=1e-5)
    np.testing.assert_allclose(first[:, 1] - first[:, 0], [[1, 0, 0], [-1, 0, 0], [2, 0, 0]], atol=1e-5)
    assert found.not_carried == ()


def test_instances_that_are_hidden_or_change(tmp_path: Path) -> None:
    body = 'def PointInstancer "W" {{\n point3f[] positions = [(0, 0, 0), (5, 0, 0)]\n {}\n rel prototypes = </W/p>\n'
    body += f' def Mesh "p" {{{{\n {MESH} }}}}\n}}}}\n'
    hidden = "int[] protoIndices = [0, 0]\n int64[] invisibleIds.timeSamples = {1: [], 3: [1]}"
    assert extents(usd(tmp_path, body.format(hidden)), 3, 6) == [1, 1, 0, 0]
    changing = "int[] protoIndices.timeSamples = {1: [0, 0], 3: [0]}"
    with pytest.raises(InputError, match="other instances than at first"):
        usd(tmp_path, body.format(changing)).read(0, 4)


def test_prims_that_are_not_read_are_named(tmp_path: Path) -> None:
    others = 'def Camera "c" {}\ndef SphereLight "l" {}\ndef BasisCurves "b" {}\ndef BasisCurves "d" {}\ndef "Untyped" {}\n'
    found = usd(tmp_path, f'def Mesh "m" {{\n {MESH} }}\n{others}')
    assert found.not_carried == ("BasisCurves prims (2)", "Camera prims", "SphereLight prims")


@pytest.mark.parametrize("above", [False, True])
def test_animated_visibility_of_alembic(above: bool, tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    sampling = AbcCoreAbstract.TimeSampling(0.5, 0.0)
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    place = AbcGeom.OXform(archive.getTop(), "place")
    meshes = [AbcGeom.OPolyMesh(place, "m"), AbcGeom.OPolyMesh(archive.getTop(), "n")]
    for mesh in meshes:
        sample = AbcGeom.OPolyMeshSchemaSample()
        points, corners, counts = imath.V3fArray(3), imath.IntArray(3), imath.IntArray(1)
        for k, point in enumerate([(0, 0, 0), (1, 0, 0), (0, 1, 0)]):
            points[k], corners[k] = imath.V3f(*point), 2 - k
        counts[0] = 3
        sample.setPositions(points)
        sample.setFaceIndices(corners)
        sample.setFaceCounts(counts)
        mesh.getSchema().set(sample)
    held = AbcGeom.CreateVisibilityProperty(place if above else meshes[0], sampling)
    for state in (-1, 0, 0, 1):
        held.setValue(state)
    del held, mesh, meshes, place, archive
    found = gvpipe.read(tmp_path / "a.abc")
    assert found.n_frames == 4 and extents(found) == [1, 0, 0, 1] and extents(found, 3, 6) == [1] * 4
    assert any("1 mesh is hidden in some frames" in note for note in found.notes)
