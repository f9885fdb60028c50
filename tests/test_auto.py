"""The choice of a codec: the smallest file that meets the target, and a true account of why."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Finished
from sequences import waving

import gvpipe
from gvpipe import auto
from gvpipe.auto import DEFAULT, choose_codec
from gvpipe.codec import codec_class, codec_ids
from gvpipe.errors import InputError, SettingError
from gvpipe.rate import Target
from gvpipe.sequence import MeshSequence

Run = Callable[..., Finished]


def best_alone(sequence: MeshSequence, folder: Path, **target: float | str) -> dict[str, gvpipe.Info]:
    """What each codec makes of the target; those that cannot meet it left out."""
    found = {}
    for codec in codec_ids():
        try:
            gvpipe.encode(sequence, folder / f"{codec}.mp4", codec, **target)  # type: ignore[arg-type]
        except InputError:
            continue
        found[codec] = gvpipe.info(folder / f"{codec}.mp4")
    return found


@pytest.mark.parametrize("target", [{"target_kg": 0.5}, {"target_rmse": 2e-3}, {"max_error": "1%"}], ids=str)
@pytest.mark.parametrize("sample", [100, 12], ids=["whole", "estimated"])
def test_the_smallest_is_chosen(
    target: dict[str, float | str], sample: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(auto, "SAMPLE", sample)
    sequence = waving(16, 30)
    alone = best_alone(sequence, tmp_path, **target)
    report = gvpipe.encode(sequence, tmp_path / "auto.mp4", "auto", **target)  # type: ignore[arg-type]
    smallest = min(info.bytes for info in alone.values())
    assert report.bytes <= 1.02 * smallest
    assert report.codec == min(alone, key=lambda name: alone[name].bytes) == gvpipe.info(tmp_path / "auto.mp4").codec
    assert report.reason.startswith(f"{report.codec} {report.bytes} bytes")
    assert ("estimates" in report.reason) == (sample < 30)
    tried = {trial["codec"] for trial in report.tried}
    assert report.codec in tried and len(tried) >= 2
    assert all(codec in report.reason for codec in tried)


def test_for_bits_the_smallest_error_is_chosen(tmp_path: Path) -> None:
    sequence = waving(16, 30)
    report = gvpipe.encode(sequence, tmp_path / "auto.mp4", "auto", target_bpvf=5.0)
    assert 0.97 * 5 <= report.bpvf <= 5
    errors = {}
    for codec in best_alone(sequence, tmp_path, target_bpvf=5.0):
        errors[codec] = gvpipe.compare(sequence, gvpipe.decode(tmp_path / f"{codec}.mp4")).kg or 0.0
    assert report.codec == min(errors, key=lambda name: errors[name])


def test_without_a_target_it_is_the_default(tmp_path: Path) -> None:
    sequence = waving(14, 20)
    gvpipe.encode(sequence, tmp_path / "a.mp4", "auto")
    kg = gvpipe.compare(sequence, gvpipe.decode(tmp_path / "a.mp4")).kg
    assert kg is not None and 0.97 * DEFAULT.value <= kg <= DEFAULT.value


def test_codecs_that_cannot_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`mcgv` ends before so small an error, in the estimate and in the whole."""
    candidates = [codec_class("mcgv")(), codec_class("pdct")(), codec_class("mcgv")(image="jpeg")]
    for sample in (100, 6):
        monkeypatch.setattr(auto, "SAMPLE", sample)
        report = gvpipe.encode(waving(16, 12), tmp_path / "a.mp4", candidates, target_kg=0.02)
        assert report.codec == "pdct" and {trial["codec"] for trial in report.tried} == {"pdct"}
    with pytest.raises(InputError, match="no codec meets the target: no quality of codec mcgv"):
        choose_codec(candidates[:1], waving(16, 12), Target("kg", 1e-3))


def test_settings_are_those_that_all_have(run: Run, tmp_path: Path) -> None:
    gvpipe.write(waving(10, 8), tmp_path / "w.npz")
    ended = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec", "auto", "--set", "clusters=3")
    assert ended.status == 1 and "clusters" in ended.err
    ended = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec=auto", "--reorder", "--segment=5", "--target-kg=1")
    assert ended.status == 0 and "beside it" in ended.out and " at quality " in ended.out
    report = gvpipe.encode(waving(10, 8), tmp_path / "v.mp4", "auto", target_kg=1.0, reorder=True, segment=5)
    assert report.settings["reorder"] is True
    assert report.settings == dataclasses.asdict(codec_class(report.codec)(**report.settings))
    both = run("encode", tmp_path / "w.npz", tmp_path / "x.mp4", "--target-kg=1", "--max-error=1%")
    assert both.status == 2
    with pytest.raises(SettingError, match="above 0"):
        gvpipe.encode(waving(10, 8), tmp_path / "v.mp4", "auto", target_kg=-1.0)
