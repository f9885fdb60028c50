"""The recipes of docs/notebooks.md run as they stand, where their packages are installed."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from folders import DOCS
from sequences import waving

import gvpipe

PAGE = (DOCS / "notebooks.md").read_text("utf-8")
CLOTH = """<mujoco><worldbody>
  <geom type="sphere" size=".1" pos="0 0 .2"/>
  <flexcomp name="cloth" type="grid" dim="2" count="8 8 1" spacing=".05 .05 .05" pos="0 0 .35" mass=".2" radius=".005">
    <edge equality="true"/><contact selfcollide="none"/>
  </flexcomp>
</worldbody></mujoco>"""
ARM = """<mujoco>
  <worldbody><body name="upper" pos="0 0 1">
    <joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>
    <body name="lower" pos=".3 0 0">
      <joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>
    </body>
  </body></worldbody>
  <deformable>
    <skin name="arm" vertex="0 -.05 0  0 .05 0  .3 -.05 0  .3 .05 0  .6 -.05 0  .6 .05 0" face="0 2 1  1 2 3  2 4 3  3 4 5">
      <bone body="upper" bindpos="0 0 1" bindquat="1 0 0 0" vertid="0 1 2 3" vertweight="1 1 .5 .5"/>
      <bone body="lower" bindpos=".3 0 1" bindquat="1 0 0 0" vertid="2 3 4 5" vertweight=".5 .5 1 1"/>
    </skin>
  </deformable>
</mujoco>"""


class Tensor:
    """As much of a tensor as the recipes use."""

    def __init__(self, values: Any) -> None:
        self._values = np.asarray(values, np.float32)

    def detach(self) -> Tensor:
        return self

    def cpu(self) -> Tensor:
        return self

    def numpy(self) -> Any:
        return self._values

    def norm(self, dim: int) -> Tensor:
        return Tensor(np.linalg.norm(self._values, axis=dim))

    @property
    def grad(self) -> Tensor:
        return self


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _run(heading: str, number: int = 0, **names: Any) -> dict[str, Any]:
    """Run a block of code under a heading, of long loops a tenth; the names that it leaves."""
    (section,) = re.findall(rf"^##+ {heading}\n(.*?)(?=^## |^### |\Z)", PAGE, re.DOTALL | re.MULTILINE)
    code = re.findall(r"```python\n(.*?)```", section, re.DOTALL)[number]
    code = re.sub(r"range\((\d+)00\)", r"range(\g<1>0)", code)
    names = {"gvpipe": gvpipe, **names}
    exec(compile(code, f"{heading} of notebooks.md", "exec"), names)
    return names


def test_a_loop(folder: Path) -> None:
    sheet = waving(3, 20)
    simulation = SimpleNamespace(positions=sheet[0], stress=sheet[0][:, 2], steps=0)

    def step() -> None:
        simulation.steps += 1
        simulation.positions = sheet[simulation.steps % 20]
        simulation.stress = simulation.positions[:, 2]

    simulation.step = step
    _run("Recording a loop", simulation=simulation, faces=sheet.faces)
    assert simulation.steps == 60 and 'field="stress"' in (folder / "run.html").read_text("utf-8")


def test_mujoco_cloth(folder: Path) -> None:
    pytest.importorskip("mujoco")
    (folder / "cloth.xml").write_text(CLOTH)
    names = _run("MuJoCo")
    with gvpipe.open("cloth.mp4") as video:
        assert (len(video), video.shape[1], video.metadata.up_axis) == (25, 64, "z")
        assert video[24] == pytest.approx(names["data"].flexvert_xpos, abs=0.01)
        assert video[24][:, 2].min() < video[0][:, 2].min() - 0.05


def test_mujoco_skin(folder: Path) -> None:
    pytest.importorskip("mujoco")
    (folder / "skin.xml").write_text(ARM)
    names = _run("MuJoCo", 1)
    with gvpipe.open("skin.mp4") as video:
        assert video.shape == (25, 6, 3)
        assert video[24] == pytest.approx(np.reshape(names["scene"].skinvert, (-1, 3)), abs=0.02)
        assert np.abs(video[24] - video[0]).max() > 0.1


def test_rigid_bodies(folder: Path) -> None:
    _run("Robots and other rigid bodies")
    assert 'up="z"' in (folder / "robot.html").read_text("utf-8")


def test_pyvista(folder: Path) -> None:
    pytest.importorskip("pyvista")
    _run("PyVista")
    with gvpipe.open("ball.mp4") as video:
        assert len(video) == 30 and np.ptp(video[29][:, 2]) < 0.5 * np.ptp(video[0][:, 2])


def test_body_models(folder: Path) -> None:
    pytest.importorskip("anywidget")
    sheet = waving(4, 8)

    class Model:
        faces = sheet.faces.astype(np.int64)

        def __call__(self, **_: Any) -> Any:
            return SimpleNamespace(vertices=Tensor(sheet[:]))

    _run("SMPL and other body models", model=Model(), shape=0, poses=0, turns=0)


def test_tensors(folder: Path) -> None:
    sheet = waving(3, 20)
    _run("PyTorch and JAX", faces=sheet.faces, vertices=Tensor(sheet[3]), optimise=lambda _: 0.0)
    assert (folder / "fit.html").exists()
