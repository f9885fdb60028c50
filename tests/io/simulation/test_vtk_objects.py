"""VTK's own objects and readers, where the package vtk is installed; else what is said of it."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError

HAS_VTK = importlib.util.find_spec("vtkmodules") is not None
needs_vtk = [pytest.mark.slow, pytest.mark.skipif(not HAS_VTK, reason="vtk is not there: pip install 'gvpipe[vtk-full]'")]
HEAD = "FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"


def foam(folder: Path) -> Path:
    """Two cubes in a row, one pressure for each at three times, as OpenFOAM writes them."""
    folder.mkdir()

    def write(path: str, kind: str, text: str) -> None:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(HEAD.format(kind=kind, name=Path(path).name) + text)

    def at(x: int, y: int, z: int) -> int:
        return (2 * z + y) * 3 + x

    faces = [[at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)]]
    owners = [0]
    for x in (0, 1):
        faces += [
            [at(x, 0, 0), at(x + 1, 0, 0), at(x + 1, 0, 1), at(x, 0, 1)],
            [at(x, 1, 0), at(x, 1, 1), at(x + 1, 1, 1), at(x + 1, 1, 0)],
            [at(x, 0, 0), at(x, 1, 0), at(x + 1, 1, 0), at(x + 1, 0, 0)],
            [at(x, 0, 1), at(x + 1, 0, 1), at(x + 1, 1, 1), at(x, 1, 1)],
        ]
        owners += [x] * 4
    faces += [[at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)], [at(2, 0, 0), at(2, 1, 0), at(2, 1, 1), at(2, 0, 1)]]
    owners += [0, 1]
    points = [f"({x} {y} {z})" for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)]
    mesh = "constant/polyMesh/"
    write(f"{mesh}points", "vectorField", f"{len(points)}\n(\n" + "\n".join(points) + "\n)\n")
    write(f"{mesh}faces", "faceList", f"{len(faces)}\n(\n" + "\n".join(f"4({' '.join(map(str, f))})" for f in faces) + "\n)\n")
    write(f"{mesh}owner", "labelList", f"{len(owners)}\n(\n" + "\n".join(map(str, owners)) + "\n)\n")
    write(f"{mesh}neighbour", "labelList", "1\n(\n1\n)\n")
    write(f"{mesh}boundary", "polyBoundaryMesh", "1\n(\nwalls\n{ type wall; nFaces 10; startFace 1; }\n)\n")
    write("system/controlDict", "dictionary", "startTime 0;\nendTime 2;\ndeltaT 1;\nwriteInterval 1;\n")
    for time in (0, 1, 2):
        numbers = f"internalField nonuniform List<scalar>\n2\n(\n{time}\n{time + 1}\n)\n;\n"
        write(
            f"{time}/p",
            "volScalarField",
            f"dimensions [0 2 -2 0 0 0 0];\n{numbers}boundaryField {{ walls {{ type zeroGradient; }} }}\n",
        )
    (folder / "case.foam").touch()
    return folder / "case.foam"


@pytest.mark.skipif(HAS_VTK, reason="vtk is there")
def test_what_only_vtk_reads_names_the_extra(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="gvpipe\\[vtk-full\\]"):
        gvpipe.read(foam(tmp_path / "a"))
    with pytest.raises(InputError, match="no such file"):
        gvpipe.read(tmp_path / "none.foam")


@pytest.mark.parametrize("given", [3, [1, 2]])
def test_what_is_no_data_set(given: Any) -> None:
    with pytest.raises(TypeError, match="VTK data sets"):
        gvpipe.from_vtk(given)
    with pytest.raises(InputError, match="no time steps"):
        gvpipe.from_vtk([])


class TestVtk:
    """With the package itself."""

    pytestmark = needs_vtk

    def cube(self, shift: float, kind: str) -> Any:
        """A block of 2 x 2 x 2 cells with numbers of points and cells."""
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkImageData
        from vtkmodules.vtkFiltersCore import vtkAppendFilter
        from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter

        image = vtkImageData()
        image.SetDimensions(3, 3, 3)
        image.SetOrigin(shift, 0, 0)
        for group, count in ((image.GetPointData(), 27), (image.GetCellData(), 8)):
            array = numpy_to_vtk(shift + np.arange(float(count)), deep=True)
            array.SetName("heat" if count == 27 else "load")
            group.AddArray(array)
        if kind == "image":
            return image
        made = vtkAppendFilter() if kind == "grid" else vtkGeometryFilter()
        made.SetInputData(image)
        made.Update()
        return made.GetOutput()

    @pytest.mark.parametrize("kind", ["image", "grid", "surface"])
    def test_data_objects(self, kind: str) -> None:
        found = gvpipe.from_vtk([self.cube(k, kind) for k in range(3)], times=[0, 0.5, 1])
        assert found.shape == (3, 26, 3) and found.fps == 2 and len(found.faces) == 48
        assert np.array_equal(found[2] - found[0], np.tile(np.array([2, 0, 0], np.float32), (26, 1)))
        assert set(found.fields) == {"heat", "load"} and found.fields["load"].domain == "triangle"
        assert ("volume cells (8)" in found.not_carried) == (kind != "surface")
        with pytest.raises(InputError, match="2 times for 1 data sets"):
            gvpipe.from_vtk(self.cube(0, kind), times=[0, 1])

    def test_blocks(self) -> None:
        from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkMultiBlockDataSet, vtkTable

        blocks = vtkMultiBlockDataSet()
        for k, name in enumerate(("lid", "body")):
            blocks.SetBlock(k, self.cube(3 * k, "grid"))
            blocks.GetMetaData(k).Set(vtkCompositeDataSet.NAME(), name)
        found = gvpipe.from_vtk(blocks)
        assert [part.name for part in found.parts] == ["lid", "body"] and found.n_vertices == 52
        with pytest.raises(InputError, match="vtkTable"):
            gvpipe.from_vtk(vtkTable())

    def test_readers_and_files(self, tmp_path: Path) -> None:
        from vtkmodules.vtkIOGeometry import vtkOpenFOAMReader

        path = foam(tmp_path / "a")
        reader = vtkOpenFOAMReader()
        reader.SetFileName(str(path))
        for found in (gvpipe.read(path), gvpipe.from_vtk(reader)):
            assert found.shape == (3, 12, 3) and found.fps == 1 and len(found.faces) == 20
            assert sorted(set(found.fields["cell_p"][2].tolist())) == [2, 3]
        (path.parent / "constant/polyMesh/points").unlink()
        with pytest.raises(InputError, match=r"case.foam: frame 0 cannot be read"):
            gvpipe.read(path)

    def test_times_that_data_sets_tell(self) -> None:
        """``TimeValue`` of field data, of a block too, or VTK's own time of a step; none where they do not differ."""
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkMultiBlockDataSet

        def timed(time: float, way: str) -> Any:
            made = self.cube(0, "grid")
            if way == "step":
                made.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), time)
                return made
            array = numpy_to_vtk(np.array([time]), deep=True)
            array.SetName("TimeValue")
            made.GetFieldData().AddArray(array)
            if way == "block":
                blocks = vtkMultiBlockDataSet()
                blocks.SetBlock(0, made)
                return blocks
            return made

        for way in ("field", "block", "step"):
            found = gvpipe.from_vtk([timed(time, way) for time in (1.0, 1.25, 1.5)])
            assert found.fps == 4 and np.array_equal(found.times, [1, 1.25, 1.5]), way
            assert not any("TimeValue" in name for name in found.not_carried)
        assert gvpipe.from_vtk([timed(3.0, "field")] * 3).times[0] == 0
        assert gvpipe.from_vtk([timed(1.0, "field"), self.cube(0, "grid")]).times[0] == 0
        given = gvpipe.from_vtk([timed(time, "field") for time in (1.0, 2.0)], times=[0, 0.1])
        assert given.fps == pytest.approx(10)

    def test_numbers_of_parts_are_parts(self, tmp_path: Path) -> None:
        """What gvpipe writes, read by VTK's own reader."""
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        one = gvpipe.from_vtk(self.cube(0, "grid"))
        parts = (gvpipe.Part("lid", (0, 26), (0, 20)), gvpipe.Part("Körper", (0, 26), (20, 48)))
        gvpipe.write(gvpipe.MeshSequence(one[:], one.faces, parts=parts), tmp_path / "a.vtu")
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(tmp_path / "a.vtu"))
        reader.Update()
        found = gvpipe.from_vtk(reader.GetOutput())
        assert [(part.name, part.triangles) for part in found.parts] == [("lid", (0, 20)), ("Körper", (20, 48))]
        assert not found.fields and not found.attributes and not any("part" in name for name in found.not_carried)

    def test_structured_grids(self) -> None:
        """Of CGNS files, for one; their number of points is asked in another way."""
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkStructuredGrid

        grid, points = vtkStructuredGrid(), vtkPoints()
        for k in range(27):
            points.InsertNextPoint(k % 3, k // 3 % 3, k // 9)
        grid.SetDimensions(3, 3, 3)
        grid.SetPoints(points)
        assert gvpipe.from_vtk(grid).n_vertices == 26

    def test_polyhedra_have_a_surface(self) -> None:
        from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
        from vtkmodules.vtkCommonDataModel import VTK_POLYHEDRON, vtkUnstructuredGrid

        grid, points, stream = vtkUnstructuredGrid(), vtkPoints(), vtkIdList()
        for point in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]:
            points.InsertNextPoint(point)
        for number in [4, 3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3]:
            stream.InsertNextId(number)
        grid.SetPoints(points)
        grid.InsertNextCell(VTK_POLYHEDRON, stream)
        found = gvpipe.from_vtk(grid)
        assert len(found.faces) == 4 and found.not_carried == ("polyhedra but for their surface",)

    def test_pyvista_s_blocks_have_their_names(self) -> None:
        pyvista = pytest.importorskip("pyvista")
        blocks = pyvista.MultiBlock({"plate": pyvista.Plane(), "ball": pyvista.Sphere()})
        assert [part.name for part in gvpipe.from_pyvista(blocks).parts] == ["plate", "ball"]
