"""The choice of a codec: the smallest file that meets the target, and a true account of why."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import Finished
from sequences import waving

import gvpipe
from gvpipe.coding.codec import Codec
from gvpipe.coding.quality_scale import error_of
from gvpipe.coding.registry import codec_class
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control import size_estimates
from gvpipe.rate_control.codec_choice import choose_codec
from gvpipe.rate_control.purposes import PURPOSES, candidates, describe
from gvpipe.rate_control.targets import Target

Run = Callable[..., Finished]


def candidates_for(purpose: str | None = None, **settings: Any) -> list[Codec]:
    """What ``auto`` chooses from."""
    found = candidates("auto", purpose, lambda name, own: codec_class(name)(**own, **settings))
    assert isinstance(found, list)
    return found


def best_alone(sequence: MeshSequence, folder: Path, **target: Any) -> dict[str, gvpipe.Info]:
    """What each candidate makes of the target; those that cannot meet it left out."""
    found = {}
    for codec in candidates_for():
        name = describe(codec)
        try:
            gvpipe.encode(sequence, folder / f"{name}.mp4", codec, **target)
        except InputError:
            continue
        found[name] = gvpipe.info(folder / f"{name}.mp4")
    return found


@pytest.mark.parametrize(
    "target",
    [
        pytest.param(target, marks=pytest.mark.slow)
        for target in ({"target_kg": 0.5}, {"target_rmse": 2e-3}, {"max_error": "1%"})
    ],
    ids=str,
)
def test_the_smallest_is_chosen(target: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By estimates from the whole sequence, and from a part of it."""
    sequence = waving(16, 30)
    alone = best_alone(sequence, tmp_path, **target)
    for sample in (100, 12):
        monkeypatch.setattr(size_estimates, "SAMPLE", sample)
        report = gvpipe.encode(sequence, tmp_path / "auto.mp4", "auto", **target)
        smallest = min(info.bytes for info in alone.values())
        assert report.bytes <= 1.02 * smallest
        assert report.codec == gvpipe.info(tmp_path / "auto.mp4").codec
        assert report.reason.startswith(f"{report.codec} ") and f" {report.bytes} bytes; " in report.reason
        assert all(describe(codec) in report.reason.partition("estimates")[2] for codec in candidates_for())
        tried = {trial["codec"] for trial in report.tried}
        assert report.codec in tried and "pdct" not in tried


@pytest.mark.slow
def test_for_bits_the_smallest_error_is_chosen(tmp_path: Path) -> None:
    sequence = waving(16, 30)
    report = gvpipe.encode(sequence, tmp_path / "auto.mp4", "auto", target_bpvf=4.0)
    assert 0.97 * 4 <= report.bpvf <= 4
    errors = {}
    for name in best_alone(sequence, tmp_path, target_bpvf=4.0):
        errors[name] = gvpipe.compare(sequence, gvpipe.decode(tmp_path / f"{name}.mp4")).kg or 0.0
    assert (gvpipe.compare(sequence, gvpipe.decode(tmp_path / "auto.mp4")).kg or 0.0) <= 1.02 * min(errors.values())


@pytest.mark.parametrize("quality", [None, pytest.param(50.0, marks=pytest.mark.slow)])
def test_without_a_target_it_is_the_error_of_the_quality(quality: float | None, tmp_path: Path) -> None:
    """So that the default codec and ``auto`` compare at a glance."""
    sequence = waving(14, 20)
    settings: dict[str, Any] = {} if quality is None else {"quality": quality}
    gvpipe.encode(sequence, tmp_path / "a.mp4", "auto", **settings)
    kg = gvpipe.compare(sequence, gvpipe.decode(tmp_path / "a.mp4")).kg
    allowed = error_of(quality or 75)
    assert kg is not None and 0.97 * allowed <= kg <= allowed


def test_purposes_have_their_candidates() -> None:
    names = {purpose: {describe(codec) for codec in candidates_for(purpose)} for purpose in PURPOSES}
    assert names["web"] == {"mcgv"}
    assert names["stream"] == {"mcgv", "pdct"}
    assert names["archive"] == {describe(codec) for codec in candidates_for()}
    assert names["archive"] >= {"mcgv", "mcgv transform=klt", "pca", "laplacian", "pdct"}
    assert {codec.quality for codec in candidates_for("stream", quality=40)} == {40}


@pytest.mark.slow
def test_files_serve_their_purpose(run: Run, tmp_path: Path) -> None:
    sequence = waving(10, 40)
    gvpipe.write(sequence, tmp_path / "w.npz")
    web = run("encode", tmp_path / "w.npz", tmp_path / "web.mp4", "--for", "web")
    assert web.status == 0 and "allowed" in web.out
    assert gvpipe.export_html(tmp_path / "web.mp4", tmp_path / "w.html").converted == ""
    report = gvpipe.encode(sequence, tmp_path / "s.mp4", purpose="stream")
    assert report.codec in ("mcgv", "pdct") and (report.settings.get("gop"), report.settings.get("clip")) != (32, 0)
    gvpipe.encode(sequence, tmp_path / "s.mp4", "mcgv", purpose="stream")
    assert gvpipe.open(tmp_path / "s.mp4").bitstream.codec == "mcgv"
    assert gvpipe.encode(sequence, tmp_path / "s.mp4", "mcgv", purpose="stream").settings["gop"] == 16
    assert gvpipe.encode(sequence, tmp_path / "s.mp4", "mcgv", purpose="stream", gop=8).settings["gop"] == 8
    assert gvpipe.encode(sequence, tmp_path / "s.mp4", "pca", purpose="archive").codec == "pca"


def test_what_does_not_serve_is_refused(run: Run, tmp_path: Path) -> None:
    gvpipe.write(waving(8, 6), tmp_path / "w.npz")
    wrong = {
        ("stream", "--codec=pca"): "readers cannot start at once with codec pca",
        ("stream", "--codec=mcgv", "--set=transform=klt"): "mcgv with transform klt; for stream take transform none",
        ("web", "--set=image=jpeg"): "mcgv with image jpeg; for web take image h264",
        ("web", "--set=profile=precise"): "for web take profile web",
        ("stream", "--codec=laplacian"): "take mcgv or pdct",
    }
    for options, message in wrong.items():
        ended = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--for", *options)
        assert ended.status == 1 and ended.err.count("\n") == 1 and message in ended.err
    assert run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--for=print").status == 2
    with pytest.raises(SettingError, match="purpose is 'wbe'; one of web, archive, stream is needed"):
        gvpipe.encode(waving(8, 6), tmp_path / "w.mp4", purpose="wbe")
    with pytest.raises(SettingError, match="browsers do not play mcgv with profile precise"):
        gvpipe.encode(waving(8, 6), tmp_path / "w.mp4", codec_class("mcgv")(profile="precise"), purpose="web")
    assert not (tmp_path / "w.mp4").exists()


@pytest.mark.slow
def test_codecs_that_cannot_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three need more bits even at quality 0, in the estimate and in the whole."""
    published, jpeg = (codec_class("mcgv")(prediction="affine", image=image) for image in ("h264", "jpeg"))
    for sample in (100, 6):
        monkeypatch.setattr(size_estimates, "SAMPLE", sample)
        given = [published, codec_class("pca")(), jpeg, codec_class("pdct")()]
        report = gvpipe.encode(waving(16, 12), tmp_path / "a.mp4", given, target_bpvf=10.0)
        assert report.codec == "pca" and {trial["codec"] for trial in report.tried} == {"pca"}
    report = gvpipe.encode(waving(16, 12), tmp_path / "a.mp4", [published, jpeg], target_kg=1.0)
    settings = [trial["settings"] for trial in report.tried]
    assert {"prediction": "affine"} in settings and {"prediction": "affine", "image": "jpeg"} in settings
    with pytest.raises(InputError, match="no codec meets the target: no quality of codec mcgv"):
        choose_codec([published], waving(16, 12), Target("bpvf", 10.0))


@pytest.mark.slow
def test_settings_are_those_that_all_have(run: Run, tmp_path: Path) -> None:
    gvpipe.write(waving(10, 8), tmp_path / "w.npz")
    ended = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec", "auto", "--set", "clusters=3")
    assert ended.status == 1 and "clusters" in ended.err
    ended = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec=auto", "--reorder", "--segment=5", "--target-kg=1")
    assert ended.status == 0 and "estimates" in ended.out and " reorder=True segment=5 at quality " in ended.out
    report = gvpipe.encode(waving(10, 8), tmp_path / "v.mp4", "auto", target_kg=1.0, reorder=True, segment=5)
    assert report.settings["reorder"] is True
    assert report.settings == dataclasses.asdict(codec_class(report.codec)(**report.settings))
    both = run("encode", tmp_path / "w.npz", tmp_path / "x.mp4", "--target-kg=1", "--max-error=1%")
    assert both.status == 2
    with pytest.raises(SettingError, match="above 0"):
        gvpipe.encode(waving(10, 8), tmp_path / "v.mp4", "auto", target_kg=-1.0)


@pytest.mark.parametrize("target", [{"max_error": "1%"}, {"target_kg": 1.0}, {"target_bpvf": 74.0}], ids=str)
def test_an_estimate_of_its_own_decides_whether_a_codec_is_tried(target: dict[str, Any], tmp_path: Path) -> None:
    """It is told what is of use. With a target error, the first encode shows that the file is large; it is given up."""
    told: list[float] = []
    pdct: Any = codec_class("pdct")

    def guessing(guess: float) -> Codec:
        class Guessing(pdct):  # type: ignore[misc]  # its bitstreams are pdct's
            def _estimate(self, sequence: MeshSequence, most: float, report: Any, memo: Any) -> float:
                told.append(most)
                return guess

        made: Codec = Guessing()
        return made

    for guess in (1.0, 1e9):
        given = [codec_class("pca")(), codec_class("laplacian")(), guessing(guess)]
        report = gvpipe.encode(waving(8, 6), tmp_path / "a.mp4", given, **target)
        is_tried = "pdct" in {trial["codec"] for trial in report.tried}
        assert is_tried == (guess == 1.0 and "target_kg" not in target)
        smallest = min(trial["bytes"] for trial in report.tried if trial["codec"] == "pca")
        assert report.codec in ("pca", "laplacian") and 0.5 * smallest < told[-1] < 1.5 * smallest


@pytest.mark.parametrize("bare", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sizes_are_those_of_the_layout_that_is_written(bare: bool, tmp_path: Path) -> None:
    report = gvpipe.encode(waving(8, 6), tmp_path / "a.mp4", "auto", bare=bare, max_error="1%")
    assert (tmp_path / "a.mp4").stat().st_size in {trial["bytes"] for trial in report.tried}
