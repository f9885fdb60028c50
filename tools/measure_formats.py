"""How fast formats are read, beside the libraries themselves, and written.

    python tools/measure_formats.py ../shared/data [--only abc] [--markdown]

Reading: every frame of an asset, as positions in world space, by gvpipe and by the format's own library alone: usd-core,
alembic3d, trimesh (frames of GLB, OBJ and PLY), h5py and meshio (simulations). Both run in turn, in this process, the
fastest of `--repeats` counts; times are of the processor. gvpipe's time has what the others leave out: triangles, attributes,
materials, checks. Writing: `samba.npz` as `.glb`, `.usdc` and `.abc`.

Status 1: reading takes more than twice the library's own time and 0.1 s more, or writing more than 3 s.
"""

from __future__ import annotations

import argparse
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

TIMES, SLACK, LONGEST = 2.0, 0.1, 3.0  # of the library's own reading; seconds more that count for nothing; seconds of writing


class Row(NamedTuple):
    """What was measured of a file."""

    file: str
    library: str
    own: float | None
    ours: float

    @property
    def is_slow(self) -> bool:
        """Whether gvpipe misses its budget."""
        return self.ours > (LONGEST if self.own is None else TIMES * self.own + SLACK)


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
    """Seconds of the processor that some work takes, the least of several times."""
    spent = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        spent.append(time.process_time() - started)
    return min(spent)


def read(path: Path) -> None:
    """Read all frames by gvpipe."""
    sequence = gvpipe.read(path)
    for _ in sequence.chunks():
        pass


def by_usd(path: Path) -> None:
    """Points of all meshes at all time codes in world space, and the polygons."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage: Any = Usd.Stage.Open(str(path))
    stage.Reload()
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    roots = [UsdSkel.Root(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    start, stop = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    for root in roots:
        UsdSkel.BakeSkinning(root, _interval(start, stop))
    for mesh in meshes:
        np.array(mesh.GetFaceVertexIndicesAttr().Get())
        for frame in np.arange(start, stop + 1):
            points = np.array(mesh.GetPointsAttr().Get(frame), np.float64)
            world = np.array(UsdGeom.Imageable(mesh).ComputeLocalToWorldTransform(frame))
            _ = points @ world[:3, :3] + world[3, :3]


def _interval(start: float, stop: float) -> Any:
    from pxr import Gf

    return Gf.Interval(start, stop)


def by_alembic(path: Path) -> None:
    """Positions of all meshes in all samples, in the space of each mesh, and the polygons."""
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(path))
    held: list[Any] = []

    def visit(item: Any) -> None:
        for number in range(item.getNumChildren()):
            child = item.getChild(number)
            if child.getMetaData().get("schema") == "AbcGeom_PolyMesh_v1":
                mesh = AbcGeom.IPolyMesh(item, child.getName())
                held.append(mesh)
                schema = mesh.getSchema()
                np.array(schema.getFaceIndicesProperty().getValue())
                positions = schema.getPositionsProperty()
                sampling = positions.getTimeSampling()
                for sample in range(positions.getNumSamples()):
                    np.array(positions.getValue(Abc.ISampleSelector(float(sampling.getSampleTime(sample)))))
            visit(child)

    visit(archive.getTop())


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
        file.visititems(lambda _, one: one[...] if isinstance(one, h5py.Dataset) else None)


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
    ("usd/HIK_Export/HIK_Export.usda", "usd-core", by_usd),
    ("usd/bunny_walk_skel/bunny_walk_skel.usdc", "usd-core", by_usd),
    ("usd/transformAnim/transformAnim.usda", "usd-core", by_usd),
    ("usd/skinCluster/skinCluster.usda", "usd-core", by_usd),
    ("abc/barbarian_walk_abc/barbarian_walk_abc.abc", "alembic3d", by_alembic),
    ("abc/cubes_hi/cubes-hi.abc", "alembic3d", by_alembic),
    ("abc/testUsdAbcIsConstant/testUsdAbcIsConstant.abc", "alembic3d", by_alembic),
    ("objseq/cesium_man_obj", "trimesh", by_trimesh),
    ("plyseq/fox_run_ply", "trimesh", by_trimesh),
    ("sim/can_vtkhdf/can-vtu.hdf", "h5py", by_h5py),
    ("sim/dolfinx_xdmf/no_checkpoint.xdmf", "meshio", by_meshio),
    ("sim/wavy_vtu_series/mesh.vtu.series", "meshio", by_meshio),
]


if __name__ == "__main__":
    sys.exit(main())
