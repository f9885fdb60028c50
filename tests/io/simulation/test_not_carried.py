"""VTK and its kin: what a step has beside its surface and its numbers is named."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError


def _binary(text: str, size: int) -> bytes:
    """A text in legacy VTK's binary form: its length behind the code of how many bytes tell it."""
    data = text.encode()
    return bytes([0b11000000 | len(data)]) + data if size == 1 else struct.pack(">H", 0x8000 | len(data)) + data


@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_legacy_data_of_other_kinds(form: str, tmp_path: Path) -> None:
    """Texts stand between numbers; what lies behind them is read."""
    is_text = form == "ASCII"

    def numbers(values: list[float], kind: str) -> bytes:
        return (" ".join(map(str, values)) + "\n").encode() if is_text else np.array(values, kind).tobytes() + b"\n"

    def texts(values: list[str]) -> bytes:
        if is_text:
            return "".join(f"{each}\n" for each in values).encode()
        return b"".join(_binary(each, 1 + i % 2) for i, each in enumerate(values)) + b"\n"

    data = b"# vtk DataFile Version 5.1\ntitle\n" + form.encode() + b"\nDATASET POLYDATA\n"
    data += b"FIELD FieldData 2\nTIME 1 1 float\n" + numbers([2.5], ">f4") + b"author 1 1 string\n" + texts(["somebody else"])
    data += b"POINTS 3 float\n" + numbers([0, 0, 0, 1, 0, 0, 0, 1, 0], ">f4")
    data += b"POLYGONS 1 4\n" + numbers([3, 0, 1, 2], ">i4")
    data += b"POINT_DATA 3\nSCALARS heat float 1\nLOOKUP_TABLE hot\n" + numbers([1, 2, 3], ">f4")
    data += b"LOOKUP_TABLE hot 2\n" + (b"0 0 0 1\n1 0 0 1\n" if is_text else bytes(8) + b"\n")
    data += b"FIELD FieldData 2\nname 1 3 string\n" + texts(["a", "b c", "d"]) + b"cold 1 3 float\n" + numbers([4, 5, 6], ">f4")
    (tmp_path / "a.vtk").write_bytes(data)
    found = gvpipe.read(tmp_path / "a.vtk")
    assert found.not_carried == ("field data 'TIME'", "lookup table 'hot'", "text array 'author'", "text array 'name'")
    assert np.array_equal(found.attributes["heat"].values[:, 0], [1, 2, 3])
    assert np.array_equal(found.attributes["cold"].values[:, 0], [4, 5, 6])


def test_texts_that_end_behind_the_file(tmp_path: Path) -> None:
    head = b"# vtk DataFile Version 5.1\ntitle\nBINARY\nDATASET POLYDATA\nFIELD FieldData 1\nauthor 1 1 string\n"
    for text in (b"\x80", b"\xff" + b"a" * 8, b"", bytes(8)):
        (tmp_path / "a.vtk").write_bytes(head + text)
        with pytest.raises(InputError, match="cut short|no points"):
            gvpipe.read(tmp_path / "a.vtk")


def _piece(data: str = "", points: str = "0 0 0 1 0 0 0 1 0") -> str:
    def numbers(name: str, kind: str, text: str, width: int = 1) -> str:
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">{text}</DataArray>'

    cells = numbers("connectivity", "Int32", "0 1 2") + numbers("offsets", "Int32", "3") + numbers("types", "UInt8", "5")
    return (
        f'<Piece NumberOfPoints="3" NumberOfCells="1"><PointData>{data}</PointData>'
        f"<Points>{numbers('p', 'Float32', points, 3)}</Points><Cells>{cells}</Cells></Piece>"
    )


def test_xml_data_of_other_kinds(tmp_path: Path) -> None:
    heat = '<DataArray type="Float32" Name="heat" format="ascii">1 2 3</DataArray>'
    tag = '<Array type="String" Name="tag" format="ascii">97 0 98 0 99 0</Array>'
    whole = '<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">2</DataArray></FieldData>'
    body = whole + _piece(heat + tag) + _piece("", "0 0 1 1 0 1 0 1 1")
    (tmp_path / "a.vtu").write_text(
        f'<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>{body}</UnstructuredGrid></VTKFile>'
    )
    found = gvpipe.read(tmp_path / "a.vtu")
    assert set(found.not_carried) == {"field data 'TimeValue'", "text array 'tag'", "numbers 'heat' of some pieces"}


def test_blocks_without_elements_of_exodus(tmp_path: Path) -> None:
    """A block without elements has no list of nodes, as in the pieces of parallel runs."""
    from scipy.io import netcdf_file

    with netcdf_file(tmp_path / "a.e", "w", version=2) as file:
        for name, size in {"nodes": 5, "blocks": 3, "one": 1, "two": 2, "corners": 3, "attributes": 1}.items():
            file.createDimension(name, size)
        for axis, values in {"x": [0, 1, 0, 1, 2], "y": [0, 0, 1, 1, 2], "z": [0, 0, 0, 0, 0]}.items():
            file.createVariable(f"coord{axis}", "d", ("nodes",))[:] = values
        file.createVariable("eb_prop1", "i", ("blocks",))[:] = [10, 20, 30]
        for number, rows in ((1, "one"), (3, "two")):
            cells: Any = file.createVariable(f"connect{number}", "i", (rows, "corners"))
            cells[:] = [[1, 2, 3]] if number == 1 else [[2, 4, 3], [4, 5, 3]]
            cells.elem_type = "TRI3"
        file.createVariable("attrib3", "d", ("two", "attributes"))[:] = 0.5
    found = gvpipe.read(tmp_path / "a.e")
    assert found.faces.tolist() == [[0, 1, 2], [1, 3, 2], [3, 4, 2]]
    assert [part.name for part in found.parts] == ["block 10", "block 30"]
    assert found.not_carried == ("attributes of block 30",)


def test_ids_of_64_bits_stay_apart(tmp_path: Path) -> None:
    ids = '<DataArray type="Int64" Name="GlobalIds" format="ascii">90000000001 90000000002 90000000003</DataArray>'
    (tmp_path / "a.vtu").write_text(
        f'<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>{_piece(ids)}</UnstructuredGrid></VTKFile>'
    )
    found = gvpipe.read(tmp_path / "a.vtu")
    values = np.asarray(found.attributes["GlobalIds"].values)
    assert values.dtype == np.int64 and values.ravel().tolist() == [90000000001, 90000000002, 90000000003]
    gvpipe.encode(found, tmp_path / "a.mp4", "pca")
    assert np.array_equal(np.asarray(gvpipe.open(tmp_path / "a.mp4").attributes["GlobalIds"].values).ravel(), values.ravel())


def test_times_that_a_list_tells(tmp_path: Path) -> None:
    whole = '<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{}</DataArray></FieldData>'
    for step in (0, 1):
        body = whole.format(step) + _piece(points=f"0 0 {step} 1 0 {step} 0 1 {step}")
        text = f'<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>{body}</UnstructuredGrid></VTKFile>'
        (tmp_path / f"a_{step}.vtu").write_text(text)
    rows = "".join(f'<DataSet timestep="{step}" file="a_{step}.vtu"/>' for step in (0, 1))
    (tmp_path / "a.pvd").write_text(f'<VTKFile type="Collection" version="0.1"><Collection>{rows}</Collection></VTKFile>')
    assert gvpipe.read(tmp_path / "a.pvd").not_carried == ()
    assert gvpipe.read(str(tmp_path / "a_%d.vtu")).not_carried == ()
    assert gvpipe.read(tmp_path / "a_0.vtu").not_carried == ("field data 'TimeValue'",)


def test_what_vtkhdf_has_beside(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Type"], root.attrs["Version"] = np.bytes_("PartitionedDataSetCollection"), (2, 3)
        image = root.create_group("img")
        image.attrs["Type"] = np.bytes_("ImageData")
        mesh = root.create_group("mesh")
        mesh.attrs["Type"], mesh.attrs["Version"] = np.bytes_("UnstructuredGrid"), (2, 3)
        for name, values in {
            "NumberOfPoints": [3], "NumberOfCells": [1], "NumberOfConnectivityIds": [3], "Types": [5],
            "Offsets": [0, 3], "Connectivity": [0, 1, 2],
        }.items():  # fmt: skip
            mesh[name] = np.array(values, np.uint8 if name == "Types" else np.int64)
        mesh["Points"] = np.eye(3, dtype=np.float32)
        mesh.create_group("PointData")["tag"] = np.array([b"a", b"b", b"c"])
        mesh.create_group("FieldData")["run"] = np.arange(2)
    found = gvpipe.read(tmp_path / "a.vtkhdf")
    assert set(found.not_carried) == {"block 'img' of ImageData", "field data 'run'", "text array 'tag'"}


def test_lookup_tables_of_later_frames(tmp_path: Path) -> None:
    head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 {}\nPOLYGONS 1 4\n3 0 1 2\n"
    for step in (0, 1):
        more = "POINT_DATA 3\nLOOKUP_TABLE hot 1\n0 0 0 1\n" if step else ""
        (tmp_path / f"a{step}.vtk").write_text(head.format(step) + more)
    assert gvpipe.read(tmp_path).not_carried == ("lookup table 'hot'",)
