"""Volumes where nobody asked: carried if they are small, left out else; both are said."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
from folders import ROOT

import gvpipe
from gvpipe.asset.metadata import losses_of
from gvpipe.asset_coding.volume_choice import VolumeChoice, times_the_surface
from gvpipe.container.mp4 import read_file

SAMPLE: Any = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")


def block(folder: Path, sizes: tuple[int, int, int]) -> Path:
    """The sample's block of three frames, as a list of files."""
    listed = ""
    for k, frame in enumerate(SAMPLE["frames"](sizes, 3)):
        (folder / f"{k}.vtu").write_bytes(SAMPLE["vtu"](frame, SAMPLE["hexahedra"](sizes)))
        listed += f'<DataSet timestep="{k}" file="{k}.vtu"/>'
    (folder / "block.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    return folder / "block.pvd"


def inside(path: Path) -> int:
    """Bytes of a file's volume."""
    return sum(len(data) for name, data in read_file(path).sections.items() if name.startswith("volume"))


def test_a_thin_block_is_carried(tmp_path: Path, run: Any) -> None:
    source, target = block(tmp_path, (40, 3, 3)), tmp_path / "a.mp4"
    report = gvpipe.encode(source, target, "pca")
    (note,) = [each for each in report.notes if "inside" in each]
    assert note.startswith("what lies inside is carried, since it takes ") and note.endswith("; --no-volume leaves it out")
    assert 0 < inside(target) < (report.bytes - inside(target)) / 3
    assert not any(name.startswith("volume cells") for name in report.not_carried)
    video = gvpipe.open(target).sequence()
    assert video.volume is not None and len(video.volume.cells.types) == 39 * 2 * 2
    done = run("encode", source, target, "--codec", "pca", "--no-volume")
    assert "--volume carries volume cells" in done.err and inside(target) == 0
    assert {"inner points (38)", "volume cells (156)"} <= set(losses_of(gvpipe.open(target).metadata))


def test_a_thicker_block_is_left_out(tmp_path: Path) -> None:
    """Coded, since it might be small, and then left out; what is said of it stands in the file, too."""
    source, target = block(tmp_path, (9, 8, 5)), tmp_path / "a.mp4"
    report = gvpipe.encode(source, target, "pca")
    assert sum("what lies inside is left out, since it would take" in each for each in report.notes) == 1
    assert {"inner points (126)", "volume cells (224)"} <= set(report.not_carried) and inside(target) == 0
    assert "volume cells (224)" in losses_of(gvpipe.open(target).metadata)
    assert gvpipe.encode(source, target, "pca", volume=True).bytes > report.bytes and inside(target)


def test_numbers_are_counted_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many inner points nothing is coded."""
    from gvpipe.asset_coding import encoder

    monkeypatch.setattr(encoder, "VolumeCoder", None)
    source = block(tmp_path, (13, 12, 11))
    times = times_the_surface(gvpipe.read(source))
    assert times is not None and times > 1
    report = gvpipe.encode(source, tmp_path / "a.mp4", "pca")
    assert any(f"it has {times:.1f} times the surface's numbers; --volume carries it" in each for each in report.notes)


def test_what_is_given_in_memory_is_carried(tmp_path: Path) -> None:
    source = block(tmp_path, (5, 4, 4))
    sequence = gvpipe.read(source, volume=True)
    assert not any("inside" in each for each in gvpipe.encode(sequence, tmp_path / "a.mp4", "pca").notes)
    assert inside(tmp_path / "a.mp4")
    gvpipe.encode(tmp_path / "a.mp4", tmp_path / "b.mp4", "pca")
    assert inside(tmp_path / "b.mp4")
    report = gvpipe.encode(sequence, tmp_path / "b.mp4", "pca", volume=False)
    assert not inside(tmp_path / "b.mp4") and "volume cells (36)" in report.not_carried


def test_convert_carries_what_the_output_holds(tmp_path: Path, run: Any) -> None:
    source = block(tmp_path, (5, 4, 4))
    run("convert", source, tmp_path / "a.pvd")
    assert gvpipe.read(tmp_path / "a.pvd", volume=True).volume is not None
    run("convert", source, tmp_path / "b.pvd", "--no-volume")
    assert gvpipe.read(tmp_path / "b.pvd", volume=True).volume is None
    done = run("convert", source, tmp_path / "c" / "%02d.obj")
    assert "volume cells (36)" in done.err and "the volume's" not in done.err
    surface = run("convert", tmp_path / "b.pvd", tmp_path / "d.pvd")
    assert "volume" not in surface.err


def test_a_third_of_all_other_bytes() -> None:
    assert VolumeChoice(33, 100).is_carried and not VolumeChoice(34, 100).is_carried
    assert gvpipe.read(ROOT / "samples" / "flag.npz").not_carried == ()
    assert times_the_surface(gvpipe.read(ROOT / "samples" / "flag.npz")) is None
