"""Ghost cells and points that pieces share; times that files tell; meshes that a field moves."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import waving

import gvpipe
import gvpipe.model.warp
from gvpipe.asset.field import Field
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.io.simulation.times import time_steps
from gvpipe.model.sequence import MeshSequence

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
HEXAHEDRON = [0, 1, 3, 2, 4, 5, 7, 6]


def piece(path: Path, shift: float, ids: list[int], ghosts: str = "", points: str = "", time: str = "") -> None:
    """A cube, with a number for each of its points."""
    numbers = " ".join(map(str, (CUBE + np.array([shift, 0, 0])).ravel()))
    path.write_text(
        f'<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>{time}<Piece NumberOfPoints="8" NumberOfCells="1">'
        f'<PointData><DataArray type="Int64" Name="GlobalNodeIds" format="ascii">{" ".join(map(str, ids))}</DataArray>{points}'
        f"</PointData><CellData>{ghosts}</CellData>"
        f'<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">{numbers}</DataArray></Points><Cells>'
        f'<DataArray type="Int64" Name="connectivity" format="ascii">{" ".join(map(str, HEXAHEDRON))}</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">8</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">12</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>'
    )


def two_pieces(folder: Path, second: list[int], ghosts: str = "") -> MeshSequence:
    piece(folder / "a.vtu", 0, list(range(8)), ghosts.replace("FLAG", "0"))
    piece(folder / "b.vtu", 1, second, ghosts.replace("FLAG", "1"))
    (folder / "all.pvtu").write_text(
        '<VTKFile type="PUnstructuredGrid" version="1.0"><PUnstructuredGrid GhostLevel="1"><Piece Source="a.vtu"/>'
        '<Piece Source="b.vtu"/></PUnstructuredGrid></VTKFile>'
    )
    return gvpipe.read(folder / "all.pvtu")


def test_points_of_one_number_are_one(tmp_path: Path) -> None:
    """No wall stands between two cubes whose points have the same numbers there."""
    apart = two_pieces(tmp_path, list(range(8, 16)))
    assert apart.n_vertices == 16 and len(apart.faces) == 24
    joined = two_pieces(tmp_path, [1, 8, 3, 9, 5, 10, 7, 11])
    assert joined.n_vertices == 12 and len(joined.faces) == 20
    assert sorted(np.asarray(joined.attributes["GlobalNodeIds"]).ravel().tolist()) == list(range(12))
    elsewhere = two_pieces(tmp_path, list(range(8)))  # blocks that are numbered each from 0
    assert elsewhere.n_vertices == 16 and len(elsewhere.faces) == 24


def test_ghost_cells_are_left_out(tmp_path: Path) -> None:
    ghosts = '<DataArray type="UInt8" Name="vtkGhostType" format="ascii">FLAG</DataArray>'
    found = two_pieces(tmp_path, list(range(8, 16)), ghosts)
    assert found.n_vertices == 8 and found.read(0, 1)[0, :, 0].max() == 1 and "1 ghost cells are left out" in found.notes
    assert "vtkGhostType" not in found.attributes
    hidden = '<DataArray type="UInt8" Name="vtkGhostType" format="ascii">2 0 0 0 0 0 0 0</DataArray>'
    piece(tmp_path / "c.vtu", 0, list(range(8)), points=hidden)
    with pytest.raises(InputError, match="no surface"):
        gvpipe.read(tmp_path / "c.vtu")
    piece(tmp_path / "d.vtu", 0, list(range(8)), ghosts.replace("FLAG", "1 0"))
    with pytest.raises(InputError, match="vtkGhostType"):
        gvpipe.read(tmp_path / "d.vtu")


def test_files_tell_their_times(tmp_path: Path) -> None:
    whole = '<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{}</DataArray></FieldData>'
    for step in range(3):
        piece(tmp_path / f"s{step}.vtu", step, list(range(8)), time=whole.format(3 + step / 4))
    found = gvpipe.read(tmp_path)
    assert found.fps == 4 and found.metadata.start_time == 3 and not found.metadata.times
    assert gvpipe.read(tmp_path, fps=8).fps == 8
    piece(tmp_path / "s3.vtu", 3, list(range(8)))
    assert gvpipe.read(tmp_path).fps == 30  # one that tells none


@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_legacy_files_tell_their_times(form: str, tmp_path: Path) -> None:
    for step in range(3):
        time = f"{step / 2}\n".encode() if form == "ASCII" else np.array([step / 2], ">f8").tobytes() + b"\n"
        points = np.array([[0, 0, step], [1, 0, 0], [0, 1, 0]])
        body = "\n".join(" ".join(map(str, row)) for row in points).encode() + b"\n"
        cell = b"3 0 1 2\n"
        if form == "BINARY":
            body, cell = points.astype(">f4").tobytes() + b"\n", np.array([3, 0, 1, 2], ">i4").tobytes() + b"\n"
        (tmp_path / f"s{step}.vtk").write_bytes(
            f"# vtk DataFile Version 3.0\nt\n{form}\nDATASET POLYDATA\nFIELD FieldData 1\nTimeValue 1 1 double\n".encode()
            + time + b"POINTS 3 float\n" + body + b"POLYGONS 1 4\n" + cell
        )  # fmt: skip
    found = gvpipe.read(tmp_path)
    assert found.fps == 2 and found.not_carried == () and found[2][0, 2] == 2


def test_rates_that_a_person_can_watch() -> None:
    """A crash of 20,000 steps a second is a film of 25 frames a second, and its times are kept to the last digit."""
    frames = np.arange(5, dtype=np.float64)
    times = frames * 5.0058e-5 + 0.1
    shown = time_steps(times, 5, None)
    assert shown.fps == 25 and "--real-time" in shown.notes[0]
    assert np.array_equal(np.array(shown.times), times)
    real = time_steps(times, 5, None, real_time=True)
    assert real.fps == pytest.approx(1 / 5.0058e-5, rel=1e-3) and not real.notes
    assert time_steps(frames * 60, 5, None).fps == 25  # a step a minute
    assert time_steps(frames * 60, 5, None, real_time=True).fps == pytest.approx(1 / 60)
    assert time_steps(frames / 24, 5, None).fps == 24
    assert time_steps(times, 5, 60).fps == 60


def moved() -> MeshSequence:
    """A mesh that stands still, and by how much it should move."""
    waves = waving(4, 5)
    first = waves.read(0, 1)[0]
    still = np.broadcast_to(first, (5, 16, 3)).copy()
    fields = {"Displacement": Field(waves.read(0, 5) - first), "heat": Field(np.zeros((5, 16)))}
    return replace(waves, positions=still, fields=fields)


@pytest.mark.slow
def test_warp(tmp_path: Path, run: Any) -> None:
    given, waves = moved(), waving(4, 5)
    gvpipe.write(given, tmp_path / "in.npz")
    found = gvpipe.read(tmp_path / "in.npz", warp="Displacement")
    assert np.allclose(found[:], waves[:], atol=1e-6) and "Displacement" in found.fields
    twice = gvpipe.read(tmp_path / "in.npz", warp="Displacement:2")
    assert np.allclose(twice[3] - given[3], 2 * (waves[3] - given[3]), atol=1e-6)
    assert any("--warp Displacement" in note for note in gvpipe.read(tmp_path / "in.npz").notes)
    assert not any("--warp" in note for note in found.notes)
    ended = run(
        "encode", tmp_path / "in.npz", tmp_path / "a.mp4", "--warp", "Displacement:0.5", "--max-error", "0.001", "--json"
    )
    assert ended.status == 0 and "positions are moved by 0.5 times 'Displacement'" in json.loads(ended.out)["notes"]
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    assert np.abs(decoded[3] - given[3] - 0.5 * (waves[3] - given[3])).max() < 2e-3
    gvpipe.encode(given, tmp_path / "b.mp4", warp="Displacement")
    assert np.ptp(gvpipe.decode(tmp_path / "b.mp4")[:], axis=0).max() > 0.1
    for text, kind, message in (
        ("heat", InputError, "no vectors 'heat'"),
        ("", SettingError, "warp is ''"),
        ("Displacement:inf", SettingError, "warp is"),
    ):
        with pytest.raises(kind, match=message):
            gvpipe.read(tmp_path / "in.npz", warp=text)
    assert run("convert", tmp_path / "in.npz", tmp_path / "c.npz", "--warp", "Displacement").status == 0
    assert np.allclose(gvpipe.read(tmp_path / "c.npz")[:], waves[:], atol=1e-6)


def test_points_that_part_later_stay_one(tmp_path: Path) -> None:
    """What is one point in the first step is one in all, so that rounding changes no topology."""
    folder = tmp_path / "in"
    folder.mkdir()
    for step, shift in enumerate((1.0, 1.00004)):
        piece(folder / f"a{step}.vtu", 0, list(range(8)))
        piece(folder / f"b{step}.vtu", shift, [1, 8, 3, 9, 5, 10, 7, 11])
    rows = "".join(
        f'<DataSet timestep="{step}" part="{k}" file="in/{name}{step}.vtu"/>' for step in (0, 1) for k, name in enumerate("ab")
    )
    (tmp_path / "a.pvd").write_text(f'<VTKFile type="Collection"><Collection>{rows}</Collection></VTKFile>')
    assert gvpipe.read(tmp_path / "a.pvd")[:].shape == (2, 12, 3)


def test_times_follow_the_frames(tmp_path: Path, run: Any) -> None:
    waves = waving(4, 5)
    metadata = replace(waves.metadata, start_time=0.0, times=(0, 100, 250, 300, 301.5))
    gvpipe.write(replace(waves, metadata=metadata), tmp_path / "in.npz")
    some = gvpipe.read(tmp_path / "in.npz", frames=(1, 4))
    assert (some.metadata.times, some.metadata.start_time) == ((100, 250, 300), 100)
    assert run("encode", tmp_path / "in.npz", tmp_path / "a.mp4").status == 0
    assert run("decode", tmp_path / "a.mp4", tmp_path / "b.pvd", "--frames", "2:").status == 0
    text = (tmp_path / "b.pvd").read_text()
    assert [word.split('"')[1] for word in text.split("timestep=")[1:]] == ["250", "300", "301.5"]
    assert time_steps(np.array([0, np.nan, 2]), 3, None).notes[0].startswith("the time of frame 1 is nan")


def test_a_moved_mesh_has_no_old_normals(tmp_path: Path) -> None:
    given = moved()
    given = replace(given, attributes={"normal": np.tile(np.array([[0, 0, 1]], np.float32), (16, 1))})
    given = replace(given, fields={**given.fields, "Displacement:2": given.fields["Displacement"]})
    found = gvpipe.model.warp.warped(given, "Displacement:2")
    assert "normal" not in found.attributes and any("'normal'" in note for note in found.notes)
    assert np.allclose(found[3] - given[3], given.fields["Displacement"][3])  # the whole name first
    wrong: Any = 3
    with pytest.raises(TypeError, match="warp is 3"):
        gvpipe.encode(given, tmp_path / "a.mp4", warp=wrong)


def test_whole_numbers_come_back_exactly(tmp_path: Path, run: Any) -> None:
    """Floats that count or name something stay what they are, but where a bound is asked for."""
    waves = waving(4, 5)
    ids = np.repeat(np.arange(16, dtype=np.float32) * 1000, 1)
    steps = np.arange(5, dtype=np.float32)[:, None] * np.ones(16, np.float32)
    given = replace(
        waves,
        attributes={"rank": ids, "heat": ids + np.float32(0.25)},
        fields={"load": Field(steps), "stress": Field(steps / 3), "kept": Field(steps * 7)},
    )
    gvpipe.write(given, tmp_path / "in.npz")
    ended = run("encode", tmp_path / "in.npz", tmp_path / "a.mp4", "--field", "kept=50%", "--json")
    (note,) = (each for each in json.loads(ended.out)["notes"] if "whole numbers" in each)
    assert "'rank', 'load' (" in note and "stress" not in note
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert np.array_equal(np.asarray(video.attributes["rank"]).ravel(), ids)
        assert not np.array_equal(np.asarray(video.attributes["heat"]).ravel(), ids + np.float32(0.25))
        assert np.array_equal(video.fields["load"][:], steps)
    errors = gvpipe.compare(tmp_path / "in.npz", tmp_path / "a.mp4")
    assert errors.fields["load"]["max"] == 0 and errors.fields["stress"]["max"] and "np." not in repr(errors)
