"""The plug-in of ParaView, run by its own Python where that is installed (Debian's package ``paraview``)."""

from __future__ import annotations

import json
import os
import runpy
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from doc_pictures import keep
from folders import ROOT

import gvpipe

PLUGIN = ROOT / "integrations" / "paraview" / "gvpipe_reader.py"
OPEN = f"""
import json, sys
import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy
simple.LoadPlugin({str(PLUGIN)!r}, ns=globals())
path, out = sys.argv[1:]
"""
READ = f"""{OPEN}
reader = simple.OpenDataFile(path)
told = {{"times": list(reader.TimestepValues), "frames": []}}
for time in told["times"]:
    reader.UpdatePipeline(time)
    data = servermanager.Fetch(reader)
    def numbers(group):
        return {{group.GetArrayName(k): vtk_to_numpy(group.GetArray(k)).tolist() for k in range(group.GetNumberOfArrays())}}
    names = data.GetFieldData().GetAbstractArray("part_names")
    told["frames"].append({{
        "kind": data.GetClassName(), "cells": data.GetNumberOfCells(),
        "points": vtk_to_numpy(data.GetPoints().GetData()).tolist(),
        "point": numbers(data.GetPointData()), "cell": numbers(data.GetCellData()),
        "parts": [names.GetValue(k) for k in range(names.GetNumberOfValues())] if names else [],
    }})
open(out, "w").write(json.dumps(told))
"""
WRITE = f"""{OPEN}
reader = simple.OpenDataFile(path)
simple.SaveData(out, proxy=reader, MaxError=0.001)
"""


DRAW = f"""{OPEN}
reader = simple.OpenDataFile(path)
view = simple.CreateRenderView(ViewSize=[480, 320], OrientationAxesVisibility=0)
shown = simple.Show(reader, view, Representation="Surface With Edges")
view.ViewTime = reader.TimestepValues[20]
simple.ColorBy(shown, ("POINTS", "strain"))
shown.RescaleTransferFunctionToDataRange(True, False)
shown.SetScalarBarVisibility(view, True)
simple.ResetCamera(view)
simple.SaveScreenshot(out, view, ImageResolution=[480, 320])
"""


def missing() -> str:
    """Why ParaView cannot run the plug-in, "" if it can."""
    if shutil.which("pvpython") is None:
        return "no pvpython; apt-get install paraview"
    code = "import sys; print(*sys.version_info[:2])"
    own, theirs = (subprocess.run([p, "-c", code], capture_output=True, text=True) for p in (sys.executable, "pvpython"))
    return "" if own.stdout == theirs.stdout else f"ParaView has Python {theirs.stdout.strip()}, this is {own.stdout.strip()}"


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A module path with all that is installed here but VTK, which ParaView has of its own."""
    if reason := missing():
        pytest.skip(reason)
    folder = tmp_path_factory.mktemp("packages")
    for each in Path(sysconfig.get_path("purelib")).iterdir():
        if not each.name.startswith(("vtk", "pyvista")):
            (folder / each.name).symlink_to(each)
    return os.pathsep.join(map(str, (folder, ROOT, ROOT / "codecs", PLUGIN.parent / "debian12")))


def run(packages: str, script: str, path: Path, out: Path, *before: str) -> None:
    environment = {**os.environ, "PYTHONPATH": packages}
    code = out.with_suffix(".py")
    code.write_text(script)
    ended = subprocess.run([*before, "pvpython", code, path, out], env=environment, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0 and out.exists(), ended.stdout + ended.stderr


def read(packages: str, path: Path) -> Any:
    run(packages, READ, path, path.with_suffix(".json"))
    return json.loads(path.with_suffix(".json").read_text())


@pytest.mark.slow
class TestParaView:
    """With the program itself."""

    def test_time_steps_of_a_capture(self, packages: str, tmp_path: Path) -> None:
        """Frames, fields and parts of both shots, on one clock."""
        first = scene(3)
        last = gvpipe.MeshSequence(first[:2][:, :49], first.faces[:72], first.fps)
        gvpipe.encode(gvpipe.Capture([first, last]), tmp_path / "a.mp4")
        told = read(packages, tmp_path / "a.mp4")
        assert np.allclose(told["times"], 0.5 + np.arange(5) / 24)
        with gvpipe.open_capture(tmp_path / "a.mp4") as video:
            for k, frame in enumerate(told["frames"]):
                assert np.array_equal(np.array(frame["points"], np.float32), video[k])
                assert frame["kind"] == "vtkPolyData" and frame["cells"] == len(video.frame(k).faces)
                for name, field in video.frame(k).fields.items():
                    found = frame["point" if field.domain == "vertex" else "cell"][name]
                    assert np.array_equal(np.array(found, field.dtype), field[0])
            assert told["frames"][2]["parts"] == [part.name for part in first.parts]
            assert np.bincount(told["frames"][2]["cell"]["part"]).tolist() == [72, 72]

    def test_volume(self, packages: str, tmp_path: Path) -> None:
        sample = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")
        nodes = sample["hexahedra"]((4, 3, 3))
        for k, frame in enumerate(sample["frames"]((4, 3, 3), 2)):
            (tmp_path / f"{k}.vtu").write_bytes(sample["vtu"](frame, nodes))
        gvpipe.encode(str(tmp_path / "%d.vtu"), tmp_path / "a.mp4", volume=True, max_error=1e-4)
        (frame, _) = read(packages, tmp_path / "a.mp4")["frames"]
        assert frame["kind"] == "vtkUnstructuredGrid" and frame["cells"] == len(nodes)
        assert len(frame["points"]) == nodes.max() + 1 and len(frame["point"]["temperature"]) == nodes.max() + 1

    def test_writer(self, packages: str, tmp_path: Path) -> None:
        """All time steps of what is shown, within the bound, with fields and parts."""
        gvpipe.encode(scene(3), tmp_path / "a.mp4")
        run(packages, WRITE, tmp_path / "a.mp4", tmp_path / "b.mp4")
        with gvpipe.open(tmp_path / "a.mp4") as source, gvpipe.open(tmp_path / "b.mp4") as found:
            assert len(found) == 3 and found.fps == source.fps and {"stress", "flow", "state"} <= set(found.fields)
            assert [part.name for part in found.parts] == [part.name for part in source.parts]
            errors = gvpipe.compare(source, found)
            assert errors.max <= 0.001

    @pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="no xvfb-run; apt-get install xvfb")
    def test_picture_of_the_documentation(self, packages: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
        gvpipe.encode(gvpipe.read(ROOT / "samples" / "flag.npz"), tmp_path / "flag.mp4")
        run(packages, DRAW, tmp_path / "flag.mp4", tmp_path / "flag.png", "xvfb-run", "-a")
        keep(tmp_path / "flag.png", "paraview", request)
