"""Readings of mesh animations by other libraries alone: what `tools/measure_formats.py` compares gvpipe with.

    python tools/library_readers.py walk.usdc

Each function gives what gvpipe reads, as arrays: positions in world space, polygons, texture coordinates, normals, colours,
fields. What gvpipe does beside, none does: triangles, surfaces of volume meshes, parts, materials, checks.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

TREES = (".obj", ".ply", ".glb", ".gltf")  # what trimesh reads, of a folder
HDF5 = b"\x89HDF"


def by_usd(path: str) -> None:
    """Points of all meshes at all time codes in world space, polygons, normals and primvars."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage: Any = Usd.Stage.Open(path)
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    roots = [UsdSkel.Root(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    start, stop = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    for root in roots:
        UsdSkel.BakeSkinning(root, _interval(start, stop))
    for mesh in meshes:
        for held in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr(), mesh.GetNormalsAttr()):
            _ = np.array(held.Get(start) or ())
        for primvar in UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvars():
            _ = np.array(primvar.Get(start)), np.array(primvar.GetIndices(start))
        for frame in np.arange(start, stop + 1):
            points = np.array(mesh.GetPointsAttr().Get(frame), np.float64)
            world = np.array(UsdGeom.Imageable(mesh).ComputeLocalToWorldTransform(frame))
            _ = points @ world[:3, :3] + world[3, :3]


def _interval(start: float, stop: float) -> Any:
    from pxr import Gf

    return Gf.Interval(start, stop)


def by_alembic(path: str) -> None:
    """Positions of all meshes in all samples, in world space, with polygons, texture coordinates, normals and face sets."""
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(path)
    held: list[Any] = []

    def visit(item: Any, above: list[Any]) -> None:
        for number in range(item.getNumChildren()):
            child = item.getChild(number)
            if child.getMetaData().get("schema") == "AbcGeom_PolyMesh_v1":
                mesh = AbcGeom.IPolyMesh(item, child.getName())
                held.append(mesh)
                schema = mesh.getSchema()
                _ = np.array(schema.getFaceIndicesProperty().getValue()), np.array(schema.getFaceCountsProperty().getValue())
                for param in (schema.getUVsParam(), schema.getNormalsParam()):
                    if param.valid():
                        value = param.getIndexedValue()
                        _ = np.array(value.getVals()), np.array(value.getIndices())
                for name in schema.getFaceSetNames():
                    faces = schema.getFaceSet(str(name))
                    _ = np.array(faces.getSchema().getValue().getFaces())
                for one in moments([schema.getPositionsProperty(), *(xform.getSchema() for xform in above)]):
                    selector = Abc.ISampleSelector(float(one))
                    points = np.array(schema.getPositionsProperty().getValue(selector), np.float64)
                    for xform in above:
                        matrix = np.array(xform.getSchema().getValue(selector).getMatrix())
                        points = points @ matrix[:3, :3] + matrix[3, :3]
            elif child.getMetaData().get("schema") == "AbcGeom_Xform_v3":
                held.append(AbcGeom.IXform(item, child.getName()))
                visit(child, [held[-1], *above])
                continue
            visit(child, above)

    visit(archive.getTop(), [])


def moments(schemas: list[Any]) -> set[float]:
    """Times of the samples of what has several, or of the first."""
    moving = [one for one in schemas if one.getNumSamples() > 1] or schemas[:1]
    return {one.getTimeSampling().getSampleTime(number) for one in moving for number in range(one.getNumSamples())}


def by_ufbx(path: str) -> None:
    """Positions of all meshes in all frames of the first take, polygons, normals and texture coordinates.

    The library frees what is still in use, so every object gets a reference that is never taken back. It ends the process.
    """
    import ctypes
    import gc

    import ufbx

    gc.disable()
    keep = ctypes.pythonapi.Py_IncRef
    keep.argtypes, keep.restype = [ctypes.py_object], None

    def hold(found: Any) -> Any:
        if found is not None:
            keep(found)
        return found

    def listed(found: Any) -> list[Any]:
        hold(found)
        return [hold(found[number]) for number in range(len(found))]

    def array(found: Any) -> Any:  # an empty list ends the process
        hold(found)
        return np.array(found) if len(found) else np.zeros(0)

    scene = hold(ufbx.load_file(path, generate_missing_normals=True, load_external_files=True))
    for mesh in listed(scene.meshes):
        for each in (mesh.faces, mesh.vertex_indices, hold(mesh.vertex_normal).values, hold(mesh.vertex_normal).indices):
            array(each)
        for uv in listed(mesh.uv_sets):
            array(hold(uv.vertex_uv).values), array(hold(uv.vertex_uv).indices)
    rate = hold(scene.settings).frames_per_second
    take = listed(scene.anim_stacks)[0]
    settings = {"evaluate_skinning": True, "evaluate_caches": True, "load_external_files": True}
    for frame in range(int((take.time_end - take.time_begin) * rate + 1.5)):
        now = hold(ufbx.evaluate_scene(scene, hold(take.anim), take.time_begin + frame / rate, **settings))
        for node in listed(now.nodes):
            if hold(node.mesh) is not None:
                points = array(hold(node.mesh.skinned_position).values).reshape(-1, 3)
                _ = points @ np.array(hold(node.geometry_to_world))[:3]
        now.free()
    os._exit(0)  # taking its objects down would crash


def by_trimesh(path: str) -> None:
    """All frames of a folder, or one file without motion, as vertices and faces."""
    import trimesh

    given = Path(path)
    for file in sorted(given.iterdir()) if given.is_dir() else [given]:
        if file.suffix in TREES:
            mesh: Any = trimesh.load(file, process=False, force="mesh")
            _ = mesh.vertices, mesh.faces


def by_h5py(path: str) -> None:
    """All numbers of an HDF5 file."""
    import h5py

    with h5py.File(path) as file:
        found: list[Any] = []
        file.visititems(lambda _, one: found.append(one))  # what the function returns would end the visit
        _ = [one[...] for one in found if isinstance(one, h5py.Dataset)]


def by_scipy(path: str) -> None:
    """All numbers of a NetCDF file, version 3."""
    from scipy.io import netcdf_file

    with netcdf_file(path, mmap=False) as file:
        _ = [np.array(one.data) for one in file.variables.values()]


def by_meshio(path: str) -> None:
    """All steps of a simulation."""
    import meshio

    given = Path(path)
    with contextlib.redirect_stdout(io.StringIO()):
        if given.suffix == ".xdmf":
            with meshio.xdmf.TimeSeriesReader(path) as reader:
                reader.read_points_cells()
                for step in range(reader.num_steps):
                    reader.read_data(step)
        else:
            for file in sorted(given.parent.rglob("*.vtu")) if given.suffix == ".series" else [given]:
                meshio.read(file)


READERS: dict[str, tuple[str, Callable[[str], None]]] = {
    **dict.fromkeys((".usda", ".usdc", ".usd", ".usdz"), ("usd-core", by_usd)),
    ".abc": ("alembic3d", by_alembic),
    ".fbx": ("ufbx", by_ufbx),
    **dict.fromkeys(TREES, ("trimesh", by_trimesh)),
    **dict.fromkeys((".hdf", ".vtkhdf"), ("h5py", by_h5py)),
    **dict.fromkeys((".xdmf", ".series", ".vtk"), ("meshio", by_meshio)),
}


def reader_of(path: Path) -> tuple[str, Callable[[str], None]] | None:
    """The library for a file, or for a folder of frames, and its function here; None if there is none."""
    if path.suffix in (".e", ".exo"):
        return ("h5py", by_h5py) if path.read_bytes().startswith(HDF5) else ("scipy", by_scipy)
    return READERS.get(path.suffix, ("trimesh", by_trimesh) if path.is_dir() else None)


def main() -> int:
    """Read what the command line names; status 1 if no library reads it."""
    import argparse

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("path", type=Path, help="a file, or a folder of frames")
    path = parser.parse_args().path
    found = reader_of(path)
    if found is None:
        return 1
    print(found[0], flush=True)
    found[1](str(path))
    return 0


if __name__ == "__main__":
    sys.exit(main())
