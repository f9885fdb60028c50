"""VTK and its kin: what a step has beside its surface and its numbers is named."""

from __future__ import annotations

import struct
from pathlib import Path

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
