"""Khronos's glTF validator finds no error in what is written."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from changing import sheet
from folders import DATA, GOLDEN, ROOT
from sequences import wrinkled

import gvpipe

VALIDATOR = ROOT / "tests" / "web" / "npm" / "node_modules" / "gltf-validator"
SOURCES = (
    "gltf/CesiumMan_Binary/CesiumMan.glb",
    "gltf/CesiumMilkTruck_Binary/CesiumMilkTruck.glb",
    "usd/arm_blendshapes/arm.blendshapes.usda",
    "abc/Bottle_multi/Bottle.abc",
    "fbx/maya_blend_inbetween/maya_blend_inbetween_7500_binary.fbx",
    "sim/can_vtkhdf/can-vtu.hdf",
)

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not VALIDATOR.exists(), reason="no gltf-validator; npm ci in tests/web/npm"
)


def reports(*files: Path) -> list[dict[str, Any]]:
    """What the validator says of each file."""
    command = ["node", str(ROOT / "tests" / "validate_gltf.mjs"), str(VALIDATOR), *map(str, files)]
    found: list[dict[str, Any]] = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return found


def faults(report: dict[str, Any]) -> list[str]:
    """Errors (severity 0) and warnings (1) of a report."""
    messages = report["issues"]["messages"]
    return [f"{each['code']} at {each.get('pointer')}: {each['message']}" for each in messages if each["severity"] < 2]


def test_a_damaged_file_has_errors(tmp_path: Path) -> None:
    gvpipe.write(scene(), tmp_path / "a.glb")
    data = (tmp_path / "a.glb").read_bytes()
    (tmp_path / "b.glb").write_bytes(data.replace(b'"VEC3"', b'"VEC2"'))
    (report,) = reports(tmp_path / "b.glb")
    assert report["issues"]["numErrors"] and faults(report)


def test_no_error_in_captures(tmp_path: Path) -> None:
    points = [np.repeat(sheet(side, 0)[0][None], count, axis=0) for side, count in ((4, 2), (5, 1))]
    points[0][1] += 1
    shots = [gvpipe.MeshSequence(each, sheet(side, 0)[1]) for each, side in zip(points, (4, 5), strict=True)]
    gvpipe.write(gvpipe.Capture(shots), tmp_path / "a.glb")
    (report,) = reports(tmp_path / "a.glb")
    assert not faults(report) and report["info"]["animationCount"] == 1


def test_no_error_in_animations_and_single_frames(tmp_path: Path) -> None:
    """Of a scene with everything, of what a video of it decodes to, and of its frames one by one."""
    source = scene()
    gvpipe.encode(source, tmp_path / "a.mp4", "pca")
    gvpipe.write(source, tmp_path / "source.glb")
    gvpipe.write(gvpipe.decode(tmp_path / "a.mp4"), tmp_path / "decoded.glb")
    gvpipe.write(source.part(0, 2), tmp_path / "frames" / "%02d.glb")
    files = [tmp_path / "source.glb", tmp_path / "decoded.glb", *sorted((tmp_path / "frames").glob("*.glb"))]
    found = reports(*files)
    assert len(found) == 4 and [report["info"]["animationCount"] for report in found] == [1, 1, 0, 0]
    assert [faults(report) for report in found] == [[]] * 4


@pytest.mark.parametrize("source", SOURCES)
def test_no_error_of_real_assets(tmp_path: Path, source: str) -> None:
    if not (DATA / "assets" / source).exists():
        pytest.skip("the shared data are not there")
    read = gvpipe.read(DATA / "assets" / source)
    gvpipe.write(read.part(0, min(len(read), 6)), tmp_path / "a.glb")
    (report,) = reports(tmp_path / "a.glb")
    assert faults(report) == []


def test_no_error_of_skeletons(tmp_path: Path) -> None:
    """Of a scene with parts, materials and pictures, and of a video without pictures."""
    source = scene()
    gvpipe.write(source, tmp_path / "scene.glb", skin=gvpipe.skin(source))
    with gvpipe.open(GOLDEN / "mcgv-1-rigid.mp4") as video:
        gvpipe.write(video.sequence(), tmp_path / "video.glb", skin=video.skin())
    waves = wrinkled()
    gvpipe.write(waves, tmp_path / "shapes.glb", skin=gvpipe.skin(waves, joints=2, target_kg=0.2))
    gvpipe.write(source, tmp_path / "draco.glb", skin=gvpipe.skin(source), compress="draco")  # whose data it does not look at
    found = reports(*(tmp_path / f"{name}.glb" for name in ("scene", "video", "shapes", "draco")))
    assert [faults(report) for report in found] == [[], [], [], []]
    assert found[2]["info"]["hasMorphTargets"] and all(report["info"]["hasSkins"] for report in found)
