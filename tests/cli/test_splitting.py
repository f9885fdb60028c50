"""``--split``: inputs whose topology changes become several files, all of them or none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from changing import SIZES, SPANS, sheet, write_abc, write_objs, write_usd

import gvpipe
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError, OutputError, TopologyChange
from gvpipe.io.runs import find_runs
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]
FAST = ("--set", "preset=ultrafast", "--set", "clusters=3", "--set", "gop=4")


@pytest.fixture(params=["obj", "usd", "abc"])
def changing(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """An input of three topologies."""
    source = tmp_path / "in"
    source.mkdir()
    if request.param == "obj":
        return write_objs(source)
    return write_usd(source / "a.usda") if request.param == "usd" else write_abc(source / "a.abc")


def test_each_run_is_a_file(run: Run, changing: Path, tmp_path: Path) -> None:
    ended = run("convert", changing, tmp_path / "out.npz", "--split", "--fps", 24, "--json")
    assert ended.status == 0, ended.err
    files = json.loads(ended.out)["files"]
    assert [Path(each["output"]).name for each in files] == [f"out-{number:03d}.npz" for number in range(3)]
    assert [(each["start"], each["stop"]) for each in files] == SPANS
    for each in files:
        found = gvpipe.read(each["output"])
        assert found.fps == 24 and found.n_frames == each["frames"]
        for i, frame in enumerate(range(each["start"], each["stop"])):
            points, faces = sheet(SIZES[frame], frame)
            assert np.abs(found.read(i, i + 1)[0] - points).max() < 1e-6 and len(found.faces) == len(faces)
        if changing.suffix == ".usda":
            heat = found.fields.get("heat") or found.attributes["heat"]
            assert np.asarray(heat[0]).size in (1, found.n_vertices)


def test_without_it_the_change_is_said(run: Run, changing: Path, tmp_path: Path) -> None:
    ended = run("encode", changing, tmp_path / "a.mp4")
    assert ended.status == 0 and "change 2 times, first at frame 3; the file is a capture of 3 shots" in ended.err
    later = gvpipe.read(changing, frames=(3, 5))
    assert later.n_vertices == 49 and np.abs(later.read(1, 2)[0] - sheet(7, 4)[0]).max() < 1e-6
    with pytest.raises(TopologyChange, match="--frames 4:5 or --frames 5:") as caught:
        gvpipe.read(changing, frames=(4, None)).read(0, 2)
    assert caught.value.frame == 5


def test_geometry_videos(run: Run, tmp_path: Path) -> None:
    source = write_objs(tmp_path / "in")
    ended = run("encode", source, tmp_path / "a.mp4", "--split", *FAST, "--json", "--frames", "1:5")
    files = json.loads(ended.out)["files"]
    assert ended.status == 0 and [(each["start"], each["stop"], each["vertices"]) for each in files] == [(1, 3, 25), (3, 5, 49)]
    assert sorted(path.name for path in tmp_path.glob("*.mp4")) == ["a-000.mp4", "a-001.mp4"]
    assert [len(gvpipe.open(each["output"])) for each in files] == [2, 2]
    ended = run("encode", source, tmp_path / "b.mp4", "--split", *FAST, "--frames", ":3")
    assert f"frames 0:3 (3 frames, 25 vertices) -> {tmp_path / 'b.mp4'}" in ended.out  # one run: the name as it was given


def test_frames_keep_their_numbers(run: Run, tmp_path: Path) -> None:
    source = write_objs(tmp_path / "in")
    assert run("convert", source, tmp_path / "out" / "%02d.ply", "--split").status == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [f"{frame:02d}.ply" for frame in range(6)]
    assert gvpipe.read(tmp_path / "out" / "05.ply").n_vertices == 16


def test_all_or_nothing(run: Run, tmp_path: Path) -> None:
    source = write_objs(tmp_path / "in")
    (tmp_path / "in" / "f_05.obj").write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    before = sorted(tmp_path.iterdir())
    ended = run("encode", source, tmp_path / "a.mp4", "--split", *FAST)
    assert ended.status == 1 and "f_05.obj" in ended.err and sorted(tmp_path.iterdir()) == before
    (tmp_path / "b-001.npz").mkdir()
    ended = run("convert", source, tmp_path / "b.npz", "--split", "--frames", ":5")
    assert ended.status == 1 and "is a folder" in ended.err and not (tmp_path / "b-000.npz").exists()
    assert run("encode", source, "-", "--split").status == 2
    assert run("convert", source, tmp_path / "c.npz", "--split", "--stop", 3).status == 2
    with pytest.raises(OutputError), atomic_files(tmp_path / "in" / "f_00.obj" / "x") as folder:
        (folder / "a").write_text("")


def test_a_later_change_may_be_met_first() -> None:
    """Readers that compare a few frames before all do so."""
    frames = np.repeat([0, 1, 2], [4, 3, 2])

    def read(span: tuple[int, int | None] | None) -> MeshSequence:
        start, stop = (0, len(frames)) if span is None else (span[0], span[1] or len(frames))
        for frame in (stop - 1, (start + stop) // 2, *range(start, stop)):
            if frames[frame] != frames[start]:
                raise TopologyChange.at("it changes", frame, start)
        return MeshSequence(np.zeros((stop - start, 3, 3), np.float32), np.array([[0, 1, 2]]))

    assert [(run.start, run.stop) for run in find_runs(read)] == [(0, 4), (4, 7), (7, 9)]
    assert [(run.start, run.stop) for run in find_runs(read, (2, 6))] == [(2, 4), (4, 6)]

    def broken(span: tuple[int, int | None] | None) -> MeshSequence:
        raise TopologyChange.at("it changes", 0)

    with pytest.raises(InputError, match="it changes"):
        find_runs(broken)


@pytest.mark.parametrize("has_times", [False, True])
def test_one_list_of_all_pieces(tmp_path: Path, run: Any, has_times: bool) -> None:
    """Beside the .pvd of each run, one lists all frames with their times."""
    folder = tmp_path / "in"
    folder.mkdir()
    times = [0.0, 0.5, 2.0, 2.5, 7.0]
    listed = ""
    for frame, time in enumerate(times):
        faces = np.array([[0, 1, 2], [1, 3, 2]] if frame < 2 else [[0, 1, 2]], np.int32)
        points = np.array([[0, 0, frame], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
        gvpipe.write(gvpipe.MeshSequence(points[None], faces, 1.0), folder / f"a{frame}.vtp")
        listed += f'<DataSet timestep="{time}" file="a{frame}.vtp"/>'
    (folder / "a.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    source = folder / "a.pvd" if has_times else folder
    ended = run("convert", source, tmp_path / "out.pvd", "--split", "--json")
    assert ended.status == 0 and json.loads(ended.out)["list"] == str(tmp_path / "out.pvd")
    assert sorted(path.name for path in tmp_path.glob("*.pvd")) == ["out-000.pvd", "out-001.pvd", "out.pvd"]
    found = ElementTree.parse(tmp_path / "out.pvd").findall("Collection/DataSet")
    expected = times if has_times else [frame / 30 for frame in range(5)]
    assert [float(each.get("timestep", "")) for each in found] == pytest.approx(expected)
    assert all((tmp_path / each.get("file", "")).is_file() for each in found)
    again = run("convert", tmp_path / "out.pvd", tmp_path / "again.pvd", "--split")
    assert again.status == 0 and "again.pvd lists the frames of all files" in again.out
    assert run("convert", source, tmp_path / "one.pvd", "--split", "--frames", ":2").status == 0
    assert (tmp_path / "one.pvd").is_file() and not (tmp_path / "one-000.pvd").exists()
