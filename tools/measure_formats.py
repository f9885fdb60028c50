"""How fast formats are read, beside the libraries themselves, and written.

    python tools/measure_formats.py ../shared/data [--only abc] [--markdown]

Reading: every frame of an asset, by gvpipe and by the format's own library alone: usd-core, alembic3d, ufbx, trimesh (frames of
GLB, OBJ and PLY), h5py and meshio (simulations). The libraries give what gvpipe reads, as arrays: positions in world space,
polygons, texture coordinates, normals, colours, fields. What gvpipe does beside, they do not: triangles, surfaces of volume
meshes, parts, materials, checks. Both run in turn, the fastest of `--repeats` counts. Times are of the processor, with those of
processes that are started. gvpipe starts one for USD, FBX and Alembic, whose libraries damaged files can crash; so do these
libraries here. Writing: `samba.npz` as `.glb`, `.usdc` and `.abc`.

Status 1: reading takes more than twice the library's own time, and writing more than 3 s. Readings below 0.2 s may take 0.1 s
more.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import gvpipe

TIMES, LONGEST = 2.0, 3.0  # of the library's own reading; seconds of writing
SHORT, SLACK = 0.2, 0.1  # seconds of a reading that may take more, and how much


class Row(NamedTuple):
    """What was measured of a file."""

    file: str
    library: str
    own: float | None
    ours: float

    @property
    def is_slow(self) -> bool:
        """Whether gvpipe misses its budget."""
        if self.own is None:
            return self.ours > LONGEST
        return self.ours > TIMES * self.own + (SLACK if self.ours < SHORT else 0.0)


def main() -> int:
    """Measure the assets of the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with assets/ and samba.npz")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--repeats", type=int, default=3, help="readings of each file [default: 3]")
    parser.add_argument("--markdown", action="store_true", help="print a table for the documentation")
    given = parser.parse_args()
    if given.markdown:
        print("| file | library | its seconds | gvpipe's seconds | ratio |\n| --- | --- | --- | --- | --- |")
    is_slow = False
    for row in chain(read_rows(given.folder, given.only, given.repeats), write_rows(given.folder, given.only, given.repeats)):
        is_slow |= row.is_slow
        own, ratio = ("-", "-") if row.own is None else (f"{row.own:.3f}", f"{row.ours / row.own:.2f}")
        cells = [row.file, row.library, own, f"{row.ours:.3f}", ratio]
        text = "| " + " | ".join(cells) + " |" if given.markdown else "  ".join(cells) + ("  too slow" if row.is_slow else "")
        print(text, flush=True)
    return int(is_slow)


def read_rows(folder: Path, only: str, repeats: int) -> Iterator[Row]:
    """Yield a row for each file that is read."""
    for name, library, own in FILES:
        if only in name:
            yield compared(name, library, own, folder / "assets" / name, repeats)
    with tempfile.TemporaryDirectory() as place:
        for suffix, (library, own) in SCENES.items():
            name, path = f"samba as .{suffix}", Path(place, f"a.{suffix}")
            if only in name:
                gvpipe.write(gvpipe.read(folder / "samba.npz"), path)
                yield compared(name, library, own, path, repeats)
    name = "samba, 20 frames as .glb"
    if only in name:
        with tempfile.TemporaryDirectory() as place:
            gvpipe.write(gvpipe.read(folder / "samba.npz").part(0, 20), Path(place, "%03d.glb"))
            yield compared(name, "trimesh", by_trimesh, Path(place), repeats)


def compared(name: str, library: str, own: Callable[[Path], None], path: Path, repeats: int) -> Row:
    """The row of one file."""
    return Row(name, library, seconds(lambda: own(path), repeats), seconds(lambda: read(path), repeats))


def write_rows(folder: Path, only: str, repeats: int) -> Iterator[Row]:
    """Yield a row for each format that samba is written in."""
    samba = gvpipe.read(folder / "samba.npz")
    samba.read(0, 1)
    with tempfile.TemporaryDirectory() as place:
        for suffix in ("glb", "usdc", "abc"):
            name = f"samba.{suffix}, written"
            if only in name:
                target = Path(place, f"a.{suffix}")
                yield Row(name, "-", None, seconds(partial(gvpipe.write, samba, target), repeats))


def seconds(work: Callable[[], Any], repeats: int) -> float:
    """Seconds of the processor that some work takes, processes that it starts and ends included, the least of several times."""
    spent = []
    for _ in range(repeats):
        started, before = time.process_time(), os.times()
        work()
        after = os.times()
        below = after.children_user + after.children_system - before.children_user - before.children_system
        spent.append(time.process_time() - started + below)
    return min(spent)


def read(path: Path) -> None:
    """Read all frames and fields by gvpipe."""
    sequence = gvpipe.read(path)
    for _ in sequence.chunks():
        pass
    for field in sequence.fields.values():
        field.read(0, len(field))


def by_usd(path: Path) -> None:
    """Points of all meshes at all time codes in world space, polygons, normals and primvars."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage: Any = Usd.Stage.Open(str(path))
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


def apart(name: str, path: Path) -> None:
    """A function of this module in a process of its own; only its library counts, not what gvpipe imports."""
    code = f"import sys; from pathlib import Path; from measure_formats import {name}; {name}(Path(sys.argv[1]))"
    folders = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, env={**os.environ, "PYTHONPATH": folders})


by_usd_apart = partial(apart, "by_usd")
by_alembic_apart = partial(apart, "by_alembic")


def by_alembic(path: Path) -> None:
    """Positions of all meshes in all samples, in world space, with polygons, texture coordinates, normals and face sets."""
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(path))
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


UFBX = """
import ctypes, gc, sys
import numpy as np, ufbx
gc.disable()
keep = ctypes.pythonapi.Py_IncRef
keep.argtypes, keep.restype = [ctypes.py_object], None
def hold(found):  # the library frees what is still in use
    if found is not None:
        keep(found)
    return found
def listed(found):
    hold(found)
    return [hold(found[number]) for number in range(len(found))]
def array(found):  # an empty list ends the process
    hold(found)
    return np.array(found) if len(found) else None
scene = hold(ufbx.load_file(sys.argv[1], generate_missing_normals=True))
for mesh in listed(scene.meshes):
    for each in (mesh.faces, mesh.vertex_indices, hold(mesh.vertex_normal).values, hold(mesh.vertex_normal).indices):
        array(each)
    for uv in listed(mesh.uv_sets):
        array(hold(uv.vertex_uv).values), array(hold(uv.vertex_uv).indices)
rate = hold(scene.settings).frames_per_second
take = listed(scene.anim_stacks)[0]
for frame in range(int((take.time_end - take.time_begin) * rate + 1.5)):
    now = hold(ufbx.evaluate_scene(scene, hold(take.anim), take.time_begin + frame / rate, evaluate_skinning=True))
    for node in listed(now.nodes):
        if hold(node.mesh) is not None:
            array(hold(node.mesh.skinned_position).values).reshape(-1, 3) @ np.array(hold(node.geometry_to_world))[:3]
    now.free()
"""


def by_ufbx(path: Path) -> None:
    """Positions of all meshes in all frames of the first take, polygons, normals and texture coordinates, in another process.

    There its objects can be held for ever; in this one, those of one reading would slow the next.
    """
    subprocess.run([sys.executable, "-c", UFBX, str(path)], check=True)


def by_trimesh(folder: Path) -> None:
    """All frames of a folder, or one file, as vertices and faces."""
    import trimesh

    for path in sorted(folder.iterdir()) if folder.is_dir() else [folder]:
        if path.suffix in (".obj", ".ply", ".glb"):
            mesh: Any = trimesh.load(path, process=False, force="mesh")
            _ = mesh.vertices, mesh.faces


def by_h5py(path: Path) -> None:
    """All numbers of an HDF5 file."""
    import h5py

    with h5py.File(path) as file:
        found: list[Any] = []
        file.visititems(lambda _, one: found.append(one))  # what the function returns would end the visit
        _ = [one[...] for one in found if isinstance(one, h5py.Dataset)]


def by_meshio(path: Path) -> None:
    """All steps of a simulation, as meshio gives them."""
    import contextlib
    import io

    import meshio

    with contextlib.redirect_stdout(io.StringIO()):
        if path.suffix == ".xdmf":
            with meshio.xdmf.TimeSeriesReader(path) as reader:
                reader.read_points_cells()
                for step in range(reader.num_steps):
                    reader.read_data(step)
        else:
            for file in sorted(path.parent.rglob("*.vtu")) if path.suffix == ".series" else [path]:
                meshio.read(file)


FILES: list[tuple[str, str, Callable[[Path], None]]] = [
    ("usd/HIK_Export/HIK_Export.usda", "usd-core", by_usd_apart),
    ("usd/bunny_walk_skel/bunny_walk_skel.usdc", "usd-core", by_usd_apart),
    ("usd/transformAnim/transformAnim.usda", "usd-core", by_usd_apart),
    ("usd/skinCluster/skinCluster.usda", "usd-core", by_usd_apart),
    ("abc/barbarian_walk_abc/barbarian_walk_abc.abc", "alembic3d", by_alembic_apart),
    ("abc/cubes_hi/cubes-hi.abc", "alembic3d", by_alembic_apart),
    ("abc/testUsdAbcIsConstant/testUsdAbcIsConstant.abc", "alembic3d", by_alembic_apart),
    ("fbx/bunny_walk_fbx/bunny_walk.fbx", "ufbx", by_ufbx),
    ("objseq/cesium_man_obj", "trimesh", by_trimesh),
    ("plyseq/fox_run_ply", "trimesh", by_trimesh),
    ("sim/can_vtkhdf/can-vtu.hdf", "h5py", by_h5py),
    ("sim/dolfinx_xdmf/no_checkpoint.xdmf", "meshio", by_meshio),
    ("sim/wavy_vtu_series/mesh.vtu.series", "meshio", by_meshio),
]

SCENES: dict[str, tuple[str, Callable[[Path], None]]] = {
    "usdc": ("usd-core", by_usd_apart),
    "abc": ("alembic3d", by_alembic_apart),
    "vtkhdf": ("h5py", by_h5py),
}


if __name__ == "__main__":
    sys.exit(main())
