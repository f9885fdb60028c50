"""XDMF as meshio, ParaView and FEniCS write it: references, functions, collections of collections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.io.simulation.xdmf_functions import evaluate

MESH = (
    '<Grid Name="mesh" GridType="Uniform"><Topology TopologyType="Triangle" NumberOfElements="2">'
    '<DataItem Dimensions="2 3" NumberType="Int" Format="XML">0 1 2 1 3 2</DataItem></Topology>'
    '<Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="XML">0 0 0 1 0 0 0 1 0 1 1 0</DataItem></Geometry></Grid>'
)
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)


def written(path: Path, body: str, space: str = "http://www.w3.org/2003/XInclude") -> Path:
    path.write_text(f'<Xdmf xmlns:ns0="{space}" Version="3.0"><Domain>{body}</Domain></Xdmf>')
    return path


def series(step: str, steps: int = 3) -> str:
    grids = "".join(step.replace("TIME", str(k)) for k in range(steps))
    return f'<Grid Name="s" GridType="Collection" CollectionType="Temporal">{grids}</Grid>'


@pytest.mark.parametrize("space", ["http://www.w3.org/2003/XInclude", "https://www.w3.org/2001/XInclude"])
@pytest.mark.parametrize(
    "pointers",
    [
        ["//Grid[@Name=&quot;mesh&quot;]/*[self::Topology or self::Geometry]"],
        ["//Grid[@Name='mesh']/Topology", "//Grid[@Name='mesh']/Geometry"],
        ["/Xdmf/Domain/Grid[2]/*[self::Topology or self::Geometry]"],
    ],
)
def test_grids_that_include_others(tmp_path: Path, space: str, pointers: list[str]) -> None:
    """As meshio's TimeSeriesWriter: steps have numbers alone, and the mesh stands behind them."""
    included = "".join(f'<ns0:include xpointer="xpointer({each})" />' for each in pointers)
    step = (
        f'<Grid>{included}<Time Value="TIME" /><Attribute Name="T" AttributeType="Scalar" Center="Node">'
        '<DataItem Dimensions="4" Format="XML">0 1 2 TIME</DataItem></Attribute></Grid>'
    )
    found = gvpipe.read(written(tmp_path / "a.xdmf", series(step) + MESH, space))
    assert found.shape == (3, 4, 3) and np.array_equal(found[1], POINTS) and found.fps == 1
    assert found.fields["T"][2].tolist() == [0, 1, 2, 2]


def test_references_and_functions(tmp_path: Path) -> None:
    items = '<DataItem Name="base" Dimensions="4" Format="XML">1 2 3 4</DataItem>'
    here = '<DataItem Reference="XML">/Xdmf/Domain/DataItem[@Name="base"]</DataItem>'
    moving = '<DataItem Dimensions="4" Format="XML">0 0 0 TIME</DataItem>'
    step = (
        '<Grid><Topology Reference="XML">//Grid[@Name="mesh"]/Topology</Topology>'
        '<Geometry Reference="XML">//Grid[@Name="mesh"]/Geometry</Geometry><Time Value="TIME" />'
        '<Attribute Name="sum"><DataItem ItemType="Function" Function="$0 + 2*($1 - 1)" Dimensions="4">'
        f"{here}{moving}</DataItem></Attribute>"
        '<Attribute Name="v" AttributeType="Vector">'
        '<DataItem ItemType="Function" Function="JOIN($0 ; $1, $1)" Dimensions="4 3">'
        f"{here}{moving}</DataItem></Attribute></Grid>"
    )
    found = gvpipe.read(written(tmp_path / "a.xdmf", items + MESH + series(step)))
    assert found.fields["sum"][2].tolist() == [-1, 0, 1, 6] and found.fields["v"][2].tolist()[3] == [4, 2, 2]
    for text in ("$2", "__import__('os')", "$0 ** 9", "JOIN", "(" * 400 + "$0", "$0.real", "'a'"):
        with pytest.raises(ValueError, match="a DataItem's function is"):
            evaluate(text, [np.ones(2), np.ones(2)])


def test_spatial_collections_are_blocks(tmp_path: Path) -> None:
    other = MESH.replace('Name="mesh"', 'Name="lid"').replace("0 0 0 1 0 0", "0 0 5 1 0 TIME")
    step = f'<Grid GridType="Collection" CollectionType="Spatial">{MESH}{other}<Time Value="TIME" /></Grid>'
    found = gvpipe.read(written(tmp_path / "a.xdmf", series(step)))
    assert [part.name for part in found.parts] == ["mesh", "lid"] and found.shape == (3, 8, 3)
    assert found[2][5].tolist() == [1, 0, 2]
    alone = f'<Grid GridType="Collection" CollectionType="Spatial">{MESH}{other.replace("TIME", "7")}</Grid>'
    assert gvpipe.read(written(tmp_path / "b.xdmf", alone)).shape == (1, 8, 3)


def test_references_that_lead_nowhere(tmp_path: Path) -> None:
    for body, message in (
        ('<Grid><Topology Reference="XML">/Xdmf/Domain/none</Topology></Grid>', "refers to '/Xdmf/Domain/none'"),
        ('<Topology Reference="XML">/Xdmf/Domain/Topology</Topology><Grid><Topology Reference="XML">/Xdmf/Domain/Topology'
         "</Topology></Grid>", "more than 20 times"),
        ('<Grid Name="a"><ns0:include xpointer="xpointer(//Grid[[)"/></Grid>', "grid 'a' has no Topology"),
        (f'{MESH.replace(">0 0 0 1 0 0 0 1 0 1 1 0", " Reference=&quot;XML&quot;>x")}'.replace("&quot;", '"'), "refers to 'x'"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            gvpipe.read(written(tmp_path / "a.xdmf", body))


def test_collections_of_other_meshes_are_blocks(tmp_path: Path) -> None:
    """Numbers stay with the mesh that they are of, whichever order collections have; names that are there twice are said."""

    def numbered(grid: str, name: str, value: str) -> str:
        number = f'<Attribute Name="{name}"><DataItem Dimensions="4" Format="XML">{value} 0 0 TIME</DataItem></Attribute>'
        return grid.replace("</Grid>", f"{number}</Grid>")

    far = MESH.replace('Name="mesh"', 'Name="far"').replace("0 0 0 1 0 0", "9 0 0 8 0 0")

    def spatial(*grids: str) -> str:
        return f'<Grid GridType="Collection" CollectionType="Spatial">{"".join(grids)}<Time Value="TIME" /></Grid>'

    one = series(spatial(numbered(MESH, "T", "1"), numbered(far, "T", "2")))
    two = series(spatial(numbered(far, "p", "4"), numbered(MESH, "p", "3")))
    found = gvpipe.read(written(tmp_path / "a.xdmf", one + two))
    assert [part.name for part in found.parts] == ["mesh", "far"] and found.shape == (3, 8, 3)
    assert found.fields["T"][1][[0, 4]].tolist() == [1, 2] and found.fields["p"][1][[0, 4]].tolist() == [3, 4]
    apart = series(numbered(MESH, "T", "1")) + series(numbered(far, "T", "2"))
    found = gvpipe.read(written(tmp_path / "b.xdmf", apart))
    assert found.shape == (3, 8, 3) and found.fields["T"][2][[0, 4]].tolist() == [1, 2]
    twice = series(numbered(MESH, "T", "1")) + series(numbered(MESH, "T", "2"))
    found = gvpipe.read(written(tmp_path / "c.xdmf", twice))
    assert found.shape == (3, 4, 3) and any("'T'" in name for name in found.not_carried)


def test_times_of_grids_that_are_referred_to(tmp_path: Path) -> None:
    grids = "".join(MESH.replace('"mesh"', f'"g{k}"').replace("</Grid>", f'<Time Value="{k / 4}" /></Grid>') for k in range(3))
    steps = "".join(f'<Grid Reference="XML">/Xdmf/Domain/Grid[@Name="g{k}"]</Grid>' for k in range(3))
    body = f'<Grid Name="s" GridType="Collection" CollectionType="Temporal">{steps}</Grid>{grids}'
    assert gvpipe.read(written(tmp_path / "a.xdmf", body)).fps == 4


def test_files_that_would_take_for_ever(tmp_path: Path) -> None:
    """Paths, grids and functions whose work grows with a power of their size are refused at once."""
    deep = "<X>" * 150 + "</X>" * 150
    path = f'<Attribute Name="T"><DataItem Reference="XML">{"//*" * 8}[@Name="no"]</DataItem></Attribute>'
    tree = "".join(
        f'<Grid Name="c{k}" GridType="Collection" CollectionType="Spatial">'
        + f'<Grid Reference="XML">/Xdmf/Domain/Grid[@Name="c{k + 1}"]</Grid>' * 12
        + "</Grid>"
        for k in range(8)
    )
    tree += '<Grid Name="c8" GridType="Collection" CollectionType="Spatial" />'
    items = '<DataItem Name="f0" Dimensions="2" Format="XML">1 2</DataItem>' + "".join(
        f'<DataItem Name="f{k + 1}" ItemType="Function" Function="JOIN({";".join(f"${i}" for i in range(10))})">'
        + f'<DataItem Reference="XML">/Xdmf/Domain/DataItem[@Name="f{k}"]</DataItem>' * 10
        + "</DataItem>"
        for k in range(10)
    )
    last = '<Attribute Name="T"><DataItem Reference="XML">/Xdmf/Domain/DataItem[@Name="f10"]</DataItem></Attribute>'
    for body, message in (
        (deep + MESH.replace("</Grid>", f"{path}</Grid>"), "which is not in the file"),
        (tree, "more than 10000 grids"),
        (items + MESH.replace("</Grid>", f"{last}</Grid>"), "nested more than"),
    ):
        with pytest.raises(InputError, match=message):
            gvpipe.read(written(tmp_path / "a.xdmf", body))
    for arrays in ([np.ones((3, 1)), np.ones((1, 3))], [np.ones(3), np.ones((3, 3))]):
        with pytest.raises(ValueError, match="a DataItem's function is"):
            evaluate("$0 + $1", arrays)
    assert evaluate("$0 + $1 - 300", [np.array([200], np.uint8), np.array([200], np.uint8)]).tolist() == [100]
