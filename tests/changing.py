"""Inputs whose vertices and triangles change twice: sheets of other sizes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import grid

import gvpipe
from gvpipe.model.sequence import MeshSequence

SIZES = (5, 5, 5, 7, 7, 4)  # sheets of so many vertices a side, frame after frame
SPANS = [(0, 3), (3, 5), (5, 6)]


def sheet(side: int, frame: int) -> tuple[Any, Any]:
    points, faces = grid(side)
    return (points + np.array([0, 0, 0.1 * frame])).astype(np.float32), faces.astype(np.int32)


def write_objs(folder: Path) -> Path:
    for frame, side in enumerate(SIZES):
        points, faces = sheet(side, frame)
        gvpipe.write(MeshSequence(points[None], faces), folder / "f_%02d.obj", frame)
    return folder


def write_usd(path: Path) -> Path:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, Vt

    stage: Any = Usd.Stage.CreateNew(str(path))
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(len(SIZES))
    stage.SetTimeCodesPerSecond(24)
    mesh = UsdGeom.Mesh.Define(stage, "/sheet")
    heat = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("heat", _types().FloatArray, "vertex")
    for frame, side in enumerate(SIZES):
        points, faces = sheet(side, frame)
        mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), frame + 1)
        mesh.CreateFaceVertexCountsAttr().Set(Vt.IntArray([3] * len(faces)), frame + 1)
        mesh.CreateFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(faces.reshape(-1)), frame + 1)
        heat.Set(Vt.FloatArray.FromNumpy(np.arange(len(points), dtype=np.float32)), frame + 1)
    stage.Save()
    return path


def _types() -> Any:
    from pxr import Sdf

    return Sdf.ValueTypeNames


def write_abc(path: Path) -> Path:
    pytest.importorskip("alembic3d")
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    archive = Abc.OArchive(str(path))
    mesh = AbcGeom.OPolyMesh(archive.getTop(), "sheet")
    schema = mesh.getSchema()
    schema.setTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 1 / 24))
    for frame, side in enumerate(SIZES):
        points, faces = sheet(side, frame)
        sample = AbcGeom.OPolyMeshSchemaSample()
        held = imath.V3fArray(len(points))
        np.asarray(held)[...] = points
        corners, counts = imath.IntArray(3 * len(faces)), imath.IntArray(len(faces))
        np.asarray(corners)[...] = faces[:, ::-1].reshape(-1)
        np.asarray(counts)[...] = 3
        sample.setPositions(held)
        sample.setFaceIndices(corners)
        sample.setFaceCounts(counts)
        schema.set(sample)
    return path
