"""Frames of codecs without pictures, by the player in Node: Python's positions, bit for bit, at every level of detail."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from folders import DATA, GOLDEN, SAMPLES
from pages import BUNDLE
from sequences import awkward, held, patched, waving

import gvpipe
from gvcodecs.mcgv.header import Header
from gvpipe.coding.codec import LevelReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.media.video import VideoReader
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.player import _Level

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
REAL = ("samba", "chicken", "cow", "kaykit_spin", "fox_run")
WRONG: dict[str, dict[str, Any]] = {  # values of header fields
    "laplacian": {"operator": "x", "anchors": 0, "edge_power": 3, "anchor_choice": [], "steps": [0.0], "segments": 99},
    "pca": {"predictor": "x", "beta": 7, "steps": [0.0], "segments": 99},
    "pdct": {"clips": 99, "base": [0, 0, 0, 0]},
}
WALK = {"codec": "laplacian", "delta_prediction": "rigid", "anchor_choice": "walk", "anchors": 40}
MOST = 6  # frames that are compared of a file


def load(jobs: Sequence[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    """What `run_frames.mjs` makes of the jobs, triangles and frames as arrays."""
    (folder / "jobs.json").write_text(json.dumps(jobs))
    script = Path(__file__).with_name("run_frames.mjs")
    done = subprocess.run(["node", script, BUNDLE / "geometry-video.js", folder], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    data = (folder / "frames.bin").read_bytes()
    results: list[dict[str, Any]] = json.loads((folder / "results.json").read_text())
    for each in results:
        if "error" not in each:
            first, last = each["indices"]
            each["indices"] = np.frombuffer(data[first:last], "<u4").reshape(-1, 3)
            each["frames"] = [np.frombuffer(data[a:b], "<f4").reshape(-1, 3) for a, b in each["frames"]]
    return results


def pictures(bitstream: Bitstream, path: Path) -> dict[str, Any]:
    """The part of a job that tells of the pictures, whose luma goes into a file; nothing if there are none that are read."""
    if "transform" not in bitstream.header:
        return {}
    header = Header.of(bitstream)
    size = (header.width, 3 * header.height)
    reader = VideoReader(bitstream.pictures, header.profile, *size)
    planes = np.concatenate([planes for _, planes in reader.read(0, reader.n_frames)])
    reader.close()
    path.write_bytes(np.ascontiguousarray(planes[:, : size[1], : size[0]]).tobytes())
    return {"planes": str(path), "size": size}


def check(paths: Sequence[Path], folder: Path) -> None:
    """Triangles and positions of every level are Python's."""
    jobs = []
    for path in paths:
        with gvpipe.open(path) as video:
            chosen = np.random.default_rng(3).permutation(len(video))[:MOST].tolist()
            luma = pictures(video.bitstream, folder / f"{path.stem}.luma")
            jobs += [{"path": str(path), "level": level, "frames": chosen, **luma} for level in range(len(video.levels))]
    for job, found in zip(jobs, load(jobs, folder), strict=True):
        where = f"{Path(job['path']).name}, level {job['level']}"
        assert "error" not in found, f"{where}: {found['error']}"
        with gvpipe.open(job["path"]) as video:
            shown = video.level(job["level"])
            if job["level"]:  # in the player, coarser levels have no asset, so nothing sorts or splits them
                reader = cast(LevelReader, video._reader)
                shown = MeshSequence(_Level(video, job["level"]), reader.level_faces(job["level"]))
            assert found["levels"] == video.levels, where
            assert np.array_equal(found["indices"], shown.faces), where
            for k, positions in zip(job["frames"], found["frames"], strict=True):
                assert np.array_equal(positions, shown.read(k, k + 1)[0]), f"{where}, frame {k}"
            low, high = (np.array([float(each) for each in found["bounds"][side]]) for side in ("min", "max"))
            inside = (shown.read(0, 1)[0] >= low) & (shown.read(0, 1)[0] <= high)
            assert inside.all(), where


def encoded(sequence: MeshSequence, path: Path, **settings: Any) -> Path:
    gvpipe.encode(sequence, path, **{"codec": "pca", **settings})
    return path


@pytest.mark.parametrize("codec", ["laplacian", "pca", "pdct"])
def test_golden_files(codec: str, tmp_path: Path) -> None:
    check(sorted(GOLDEN.glob(f"{codec}-*.mp4")), tmp_path)


def test_seams_repeated_frames_segments_and_corrections(tmp_path: Path) -> None:
    check(
        [
            encoded(patched(), tmp_path / "seams.mp4"),
            encoded(patched(still=0.5), tmp_path / "still.mp4", reorder=True, segment=5, predictor="lsp"),
            encoded(patched(still=1.0), tmp_path / "rest.mp4"),
            encoded(held(waving(10, 12), [2, *[1] * 10, 7]), tmp_path / "held.mp4"),
            encoded(waving(14, 30), tmp_path / "segments.mp4", segment=11, max_error=0.001),
        ],
        tmp_path,
    )


def test_laplacians(tmp_path: Path) -> None:
    """Operators, predictions and anchors; hubs, still points, seams, repeated frames, segments and corrections."""
    check(
        [
            encoded(patched(still=0.5), tmp_path / "still.mp4", codec="laplacian", reorder=True, segment=5),
            encoded(patched(still=1.0), tmp_path / "rest.mp4", codec="laplacian"),
            encoded(held(waving(10, 12), [2, *[1] * 10, 7]), tmp_path / "held.mp4", **WALK),
            encoded(waving(14, 30), tmp_path / "segments.mp4", codec="laplacian", segment=11, max_error=0.001, edge_power=1.3),
            encoded(wheel(), tmp_path / "hub.mp4", codec="laplacian", operator="cotangent", anchor_ratio=1.37),
            encoded(
                awkward()["loose soup"], tmp_path / "soup.mp4", codec="laplacian", operator="tutte", delta_prediction="none"
            ),
        ],
        tmp_path,
    )


def test_clips(tmp_path: Path) -> None:
    """Of `pdct`: clusters of one member or none, long ones, fine low frequencies, flat triangles, values with many raw bits."""
    check(
        [
            encoded(patched(), tmp_path / "seams.mp4", codec="pdct", clusters=1),
            encoded(patched(still=0.5), tmp_path / "still.mp4", codec="pdct", reorder=True, segment=5, quality=100),
            encoded(patched(still=1.0), tmp_path / "rest.mp4", codec="pdct"),
            encoded(held(waving(10, 12), [2, *[1] * 10, 7]), tmp_path / "held.mp4", codec="pdct", fineness=8),
            encoded(waving(14, 30), tmp_path / "clips.mp4", codec="pdct", clip=11, max_error=0.001, clusters=500),
        ],
        tmp_path,
    )


def wheel() -> MeshSequence:
    """A hub with 150 neighbours, more than rows keep."""
    spokes = np.arange(1, 151)
    angle = 2 * np.pi * spokes / 150
    rim = np.stack([np.cos(angle), np.sin(angle), np.sin(9 * angle)], axis=1)
    points = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    faces = np.stack([np.zeros(150, int), spokes, np.roll(spokes, -1)], axis=1).astype(np.int32)
    return MeshSequence(np.stack([points, points * np.float32(1.1), points + np.float32(0.2) * points[:, :1]]), faces)


@pytest.mark.slow
@pytest.mark.parametrize("operator", ["mean-value", "cotangent", "tutte"])
def test_laplacians_of_awkward_inputs(operator: str, tmp_path: Path) -> None:
    files = {f"{name}.mp4": each for name, each in awkward().items()}
    check([encoded(each, tmp_path / name, codec="laplacian", operator=operator) for name, each in files.items()], tmp_path)


def test_trajectory_images(tmp_path: Path) -> None:
    """Of `mcgv`: golden files, each placement, segments, outliers, still points, repeated frames, corrections."""
    klt = {"codec": "mcgv", "transform": "klt"}
    names = sorted(GOLDEN.glob("mcgv-*-klt.mp4"))
    check(
        [
            *names,
            encoded(patched(), tmp_path / "charts.mp4", **klt, placement="charts", quality=100),
            encoded(patched(still=0.5), tmp_path / "still.mp4", **klt, placement="tiles", segment=5),
            encoded(held(waving(14, 20), [2, *[1] * 18, 3]), tmp_path / "held.mp4", **klt, placement="halves", max_error=0.001),
        ],
        tmp_path,
    )


@pytest.mark.slow
def test_awkward_clips(tmp_path: Path) -> None:
    check([encoded(each, tmp_path / f"{name}.mp4", codec="pdct") for name, each in awkward().items()], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("predictor", ["kalman", "navg", "lsp", "rbf"])
def test_awkward_inputs(predictor: str, tmp_path: Path) -> None:
    check([encoded(each, tmp_path / f"{name}.mp4", predictor=predictor) for name, each in awkward().items()], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("codec", ["pca", "pdct"])
@pytest.mark.parametrize("sample", ["creature", "flag"])
def test_samples(sample: str, codec: str, tmp_path: Path) -> None:
    gvpipe.encode(SAMPLES / f"{sample}.npz", tmp_path / "x.mp4", codec)
    check([tmp_path / "x.mp4"], tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(not DATA.exists(), reason="no ../shared/data")
@pytest.mark.parametrize(
    ("codec", "name"),
    [*((codec, name) for codec in ("pca", "pdct") for name in REAL), ("laplacian", "samba"), ("laplacian", "cow")],
)
def test_real_sequences(codec: str, name: str, tmp_path: Path) -> None:
    gvpipe.encode(DATA / f"{name}.npz", tmp_path / "x.mp4", codec)
    check([tmp_path / "x.mp4"], tmp_path)


@pytest.mark.parametrize(("codec", "wrong"), WRONG.items())
def test_damage_is_told_in_a_line(codec: str, wrong: dict[str, Any], tmp_path: Path) -> None:
    """Each section cut, changed or missing: an error, or frames that are finite."""
    bitstream = read_file(encoded(patched(still=0.5), tmp_path / "a.mp4", codec=codec))
    jobs = []
    for name, data in bitstream.sections.items():
        for kind, changed in {"cut": data[:-3], "changed": data[:9] + bytes(len(data) - 9), "empty": b""}.items():
            path = tmp_path / f"{name}-{kind}.mp4"
            write_file(dataclasses.replace(bitstream, sections={**bitstream.sections, name: changed}), path)
            jobs.append({"path": str(path), "level": 0, "frames": [0]})
    for key, value in wrong.items():
        write_file(dataclasses.replace(bitstream, header={**bitstream.header, key: value}), tmp_path / f"{key}.mp4")
        jobs.append({"path": str(tmp_path / f"{key}.mp4"), "level": 0, "frames": [0]})
    jobs.append({"path": str(tmp_path / "a.mp4"), "level": 9, "frames": [0]})
    found = load(jobs, tmp_path)
    errors = [each["error"] for each in found if "error" in each]
    assert len(errors) >= 0.7 * len(jobs)
    assert all(error.startswith(("corrupt: ", "unsupported: ")) and "\n" not in error for error in errors), errors
    assert errors[-1] == f"unsupported: level 9: there are levels 0..{1 if codec == 'pca' else 0}"
    assert all(np.isfinite(each["frames"]).all() for each in found if "frames" in each)


def test_the_bare_layout_names_the_remedy(tmp_path: Path) -> None:
    gvpipe.encode(patched(), tmp_path / "a.mp4", "pca", bare=True)
    (found,) = load([{"path": str(tmp_path / "a.mp4"), "level": 0, "frames": [0]}], tmp_path)
    assert found["error"] == "unsupported: it has the bare layout, of data sets; gvpipe restream makes a file of it that plays"
