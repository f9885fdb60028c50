"""One small file of every kind that is read, with the files beside it, for tests of bad input.

Every mesh has a vertex at height 7.25, which is in no other number of the file.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fbx_files import FBX
from gltf_files import File, take_apart

from gvpipe import io
from gvpipe.model.sequence import MeshSequence

MARK = 7.25
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, MARK]], np.float32)
FACES = np.array([[0, 1, 2], [2, 1, 3]], np.int32)
PACKAGES = {
    ".usda": "pxr",
    ".usdc": "pxr",
    ".usd": "pxr",
    ".usdz": "pxr",
    ".abc": "alembic3d",
    ".fbx": "ufbx",
    ".vtkhdf": "h5py",
}
EXTRAS = {"pxr": "usd", "alembic3d": "alembic", "ufbx": "fbx", "h5py": "vtk"}
NEED_MESH = (".pc2", ".mdd", ".npy")
TEXTS = (".obj", ".off", ".gltf", ".usda", ".vtp", ".vtu", ".vtk", ".pvd", ".series", ".xdmf", ".case", ".fbx")


def square(n_frames: int = 3) -> MeshSequence:
    """A square that rises, but for its marked vertex."""
    moving = np.tile(POINTS, (n_frames, 1, 1))
    moving[:, :3, 2] += np.arange(n_frames)[:, None] / 8
    return MeshSequence(moving, FACES, 24)


def written(suffix: str, n_frames: int = 3) -> Callable[[Path], None]:
    """What writes a file by gvpipe itself, and a mesh beside point caches."""

    def make(folder: Path) -> None:
        if suffix in NEED_MESH:
            io.write(square(1), folder / "base.obj")
        io.write(square(n_frames), folder / f"a{suffix}")

    return make


def rows(values: Any) -> str:
    """Numbers as text, a row in a line."""
    return "\n".join(" ".join(f"{x:g}" for x in row) for row in np.asarray(values).tolist())


def gltf(folder: Path) -> None:
    """A text file with its buffer beside."""
    file = File()
    primitive = {"attributes": {"POSITION": file.floats(POINTS)}, "indices": file.array(FACES.reshape(-1).astype("<u2"))}
    file.mesh(primitive)
    file.add("nodes", {"mesh": 0})
    file.clip((0, "translation", [0, 1], [[0, 0, 0], [0, 0, 1]], "LINEAR"), name="Lift")
    tree, blob = take_apart(file.data())
    tree["buffers"][0]["uri"] = "a.bin"
    (folder / "a.bin").write_bytes(blob)
    (folder / "a.gltf").write_text(json.dumps(tree))


def fbx(folder: Path) -> None:
    (folder / "a.fbx").write_text(FBX.replace("1,1,0,0,1,0", f"1,1,{MARK},0,1,0"))


def vtk(folder: Path) -> None:
    text = f"# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n{rows(POINTS)}\n"
    (folder / "a.vtk").write_text(
        text + f"POLYGONS 2 8\n3 0 1 2\n3 2 1 3\nPOINT_DATA 4\nSCALARS heat float\nLOOKUP_TABLE x\n{'1 ' * 4}\n"
    )


def xml_array(name: str, kind: str, values: Any, more: str = "") -> str:
    return f'<DataArray type="{kind}" Name="{name}" format="ascii"{more}>{rows(values)}</DataArray>'


def vtu(folder: Path) -> None:
    xml_grid(folder / "a.vtu", "UnstructuredGrid", "NumberOfCells", "Cells", xml_array("types", "UInt8", [[5, 5]]))


def vtp(folder: Path) -> None:
    xml_grid(folder / "a.vtp", "PolyData", "NumberOfPolys", "Polys", "")


def xml_grid(path: Path, kind: str, count: str, cells: str, types: str) -> None:
    points = xml_array("Points", "Float32", POINTS, ' NumberOfComponents="3"')
    held = xml_array("connectivity", "Int64", FACES) + xml_array("offsets", "Int64", [[3, 6]]) + types
    path.write_text(
        f'<VTKFile type="{kind}" byte_order="LittleEndian"><{kind}><Piece NumberOfPoints="4" {count}="2"><Points>{points}'
        f"</Points><{cells}>{held}</{cells}></Piece></{kind}></VTKFile>"
    )


def pvd(folder: Path) -> None:
    vtu(folder)
    (folder / "a.vtu").rename(folder / "s0.vtu")
    (folder / "a.pvd").write_text(
        '<VTKFile type="Collection"><Collection><DataSet timestep="0" file="s0.vtu"/></Collection></VTKFile>'
    )


def series(folder: Path) -> None:
    vtu(folder)
    (folder / "a.vtu").rename(folder / "s0.vtu")
    (folder / "a.series").write_text(json.dumps({"files": [{"name": "s0.vtu", "time": 0}]}))


def vtkhdf(folder: Path) -> None:
    import h5py

    io.write(square(), folder / "b.vtkhdf")
    with h5py.File(folder / "b.vtkhdf") as packed, h5py.File(folder / "a.vtkhdf", "w") as plain:
        packed.copy("VTKHDF", plain)
        points = plain["VTKHDF/Points"][:]
        del plain["VTKHDF/Points"]
        plain["VTKHDF/Points"] = points
    (folder / "b.vtkhdf").unlink()


def xdmf(folder: Path) -> None:
    def item(values: Any) -> str:
        shape = " ".join(map(str, np.shape(values)))
        kind = "Float" if np.asarray(values).dtype.kind == "f" else "Int"
        return f'<DataItem Format="XML" NumberType="{kind}" Dimensions="{shape}">{rows(values)}</DataItem>'

    grid = f'<Topology TopologyType="Triangle">{item(FACES)}</Topology><Geometry GeometryType="XYZ">{item(POINTS)}</Geometry>'
    (folder / "a.xdmf").write_text(f'<Xdmf><Domain><Grid Name="a">{grid}</Grid></Domain></Xdmf>')


def exodus(folder: Path) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(folder / "a.exo", "w", version=2) as file:
        for name, size in (("time_step", None), ("num_nodes", 4), ("num_el_in_blk1", 2), ("three", 3)):
            file.createDimension(name, size)
        for axis, letter in enumerate("xyz"):
            file.createVariable(f"coord{letter}", "d", ("num_nodes",))[:] = POINTS[:, axis]
        held = file.createVariable("connect1", "i", ("num_el_in_blk1", "three"))
        held[:] = FACES + 1
        held.elem_type = b"TRI3"  # type: ignore[attr-defined]  # any attribute is one of the file
        file.createVariable("time_whole", "d", ("time_step",))[:] = np.arange(2) / 10


def ensight(folder: Path) -> None:
    numbers = "\n".join(f"{x:g}" for x in POINTS.T.reshape(-1))
    (folder / "a.geo").write_text(
        f"a\nb\nnode id off\nelement id off\npart\n1\nsheet\ncoordinates\n4\n{numbers}\ntria3\n2\n{rows(FACES + 1)}\n"
    )
    (folder / "a.case").write_text("FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\n")


KINDS: dict[str, Callable[[Path], None]] = {
    **{suffix: written(suffix) for suffix in (".npz", ".glb", ".usda", ".usdc", ".usd", ".usdz", ".abc", *NEED_MESH)},
    **{suffix: written(suffix, 1) for suffix in (".obj", ".ply", ".stl", ".off")},
    ".vtp": vtp,
    ".pvd": pvd,
    ".vtkhdf": vtkhdf,
    ".gltf": gltf,
    ".fbx": fbx,
    ".vtk": vtk,
    ".vtu": vtu,
    ".series": series,
    ".xdmf": xdmf,
    ".exo": exodus,
    ".case": ensight,
}  # fmt: skip


def is_installed(suffix: str) -> bool:
    """Whether the package that reads a format is."""
    package = PACKAGES.get(suffix)
    return package is None or importlib.util.find_spec(package) is not None


def read_all(path: Path, **options: Any) -> MeshSequence:
    """Read a file and all its frames."""
    mesh = path.parent / "base.obj" if path.suffix in NEED_MESH else None
    sequence = io.read(path, mesh=mesh, **options)
    sequence.read(0, len(sequence))
    for field in sequence.fields.values():
        field[0 : len(sequence)]
    return sequence
