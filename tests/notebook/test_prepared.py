"""What is shown in a notebook: as it is, or encoded within the error that is said."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import SAMPLES
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.notebook import prepared
from gvpipe.notebook.pick import read_pick
from gvpipe.notebook.prepared import prepare
from gvpipe.web.page_view import view_of_shots


def test_a_video_is_shown_as_it_is(video: Path) -> None:
    player = gvpipe.open(video)
    for given in (video, str(video), player, player.sequence()):
        shown = prepare(given, "0.1%")
        assert shown.data() == video.read_bytes() and not shown.note and not shown.is_large


def test_a_sequence_is_encoded_once_within_its_error(tmp_path: Path) -> None:
    sequence = waving(10, 30)
    height = sequence[:][:, :, 2]
    sequence = gvpipe.MeshSequence(sequence[:], sequence.faces, 30.0, fields={"height": height}, name="sheet")
    stages: list[str] = []
    for error in ("1%", "0.01%", 0.02):
        shown = prepare(sequence, error, lambda stage, _: stages.append(stage))
        largest = gvpipe.compare(sequence, shown.player)
        bound = error if isinstance(error, float) else float(error[:-1]) / 100
        assert (largest.max if isinstance(error, float) else largest.max_diag or 0.0) <= bound
        assert shown.name == "sheet" and list(shown.player.fields) == ["height"]
        (told,) = re.findall(
            r"encoded by pca in [\d.]+ s: \d+ kB; vertices move by at most ([\d.e-]+) % of the diagonal", shown.note
        )
        assert float(told) / 100 == pytest.approx(largest.max_diag, rel=0.05)
    assert stages
    stages.clear()
    assert prepare(sequence, "1%", lambda stage, _: stages.append(stage)) is prepare(sequence, "1%") and not stages
    assert prepared.is_ready(sequence, "1%") and not prepared.is_ready(sequence, "2%")


def test_what_changed_beside_a_video_is_encoded(video: Path) -> None:
    from dataclasses import replace

    opened = gvpipe.open(video).sequence()
    sped = replace(opened, fields={"speed": np.zeros(opened.shape[:2], np.float32) + np.arange(72, dtype=np.float32)})
    assert list(prepare(sped, "0.1%").player.fields or prepare(sped, "0.1%").player.attributes) == ["speed"]


def test_files_of_frames_are_read(sequence: gvpipe.MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / "frames.npz")
    assert gvpipe.compare(sequence, prepare(tmp_path / "frames.npz", "0.1%").player).max_diag == pytest.approx(0, abs=1e-3)


def test_layouts_that_pages_cannot_play_are_changed(video: Path, tmp_path: Path) -> None:
    gvpipe.encode(gvpipe.decode(video), tmp_path / "bare.mp4", "pca", bare=True)
    data = prepare(tmp_path / "bare.mp4", "0.1%").data()
    (tmp_path / "whole.mp4").write_bytes(data)
    assert gvpipe.open(tmp_path / "whole.mp4").bitstream.layout == "plain"


def test_large_files_get_the_stream_layout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gvpipe.encode(waving(10, 30), tmp_path / "plain.mp4", "pca", segment=10)
    monkeypatch.setattr(prepared, "MOST_AT_ONCE", 1000)
    shown = prepare(tmp_path / "plain.mp4", "0.1%")
    assert shown.is_large and shown.data() != (tmp_path / "plain.mp4").read_bytes()
    (tmp_path / "sent.mp4").write_bytes(shown.data())
    assert gvpipe.open(tmp_path / "sent.mp4").bitstream.layout == "stream"


def test_temporary_files_go_with_what_they_are_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import tempfile

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    shown = prepare(waving(6, 4), "1%")
    assert len(list(tmp_path.iterdir())) == 1
    del shown
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_shown(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="a Player, a MeshSequence or a Capture is needed"):
        prepare(3, "0.1%")
    with pytest.raises(InputError, match="no such file"):
        prepare(tmp_path / "none.mp4", "0.1%")
    with pytest.raises(SettingError, match="max error is '1 mile'"):
        prepare(waving(6, 4), "1 mile")


def test_a_pick_has_the_values_of_the_file(tmp_path: Path) -> None:
    sheet = waving(6, 4)
    fields = {"height": sheet[:][:, :, 2], "way": sheet[:] * 2, "flux": np.random.default_rng(0).random((4, len(sheet.faces)))}
    sequence = gvpipe.MeshSequence(np.add(sheet[:], [1e6, 0, 0]), sheet.faces, fields=fields)
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca")
    player = gvpipe.open(tmp_path / "a.mp4")
    pick = read_pick(prepare(player, 1.0), {"vertex": 7, "triangle": 3, "frame": 2, "part": None})
    assert pick and (pick.vertex, pick.triangle, pick.frame, pick.part) == (7, 3, 2, None)
    assert pick.position == pytest.approx(sequence.read_absolute(2, 3)[0, 7], abs=0.05) and pick.position[0] > 9e5
    assert pick.values["height"] == player.fields["height"][2][7] and pick.values["flux"] == player.fields["flux"][2][3]
    assert np.array_equal(pick.values["way"], player.fields["way"][2][7])


@pytest.mark.parametrize(
    "message",
    [{}, {"vertex": 72, "frame": 0}, {"vertex": -1, "frame": 0}, {"vertex": 0, "frame": 11}, {"vertex": "0", "frame": 0},
     {"vertex": 0, "frame": 0, "triangle": 128}, {"vertex": 0.5, "frame": 0}, {"vertex": 0}],
)  # fmt: skip
def test_picks_of_what_is_not_there_are_ignored(message: dict[str, Any], video: Path) -> None:
    assert read_pick(prepare(video, 1.0), message) is None


def test_a_capture_is_encoded_and_picked_by_its_shots(tmp_path: Path) -> None:
    capture = gvpipe.read_capture(SAMPLES / "splash")
    for given in (SAMPLES / "splash", capture):
        shown = prepare(given, "0.5%")
        assert shown.n_frames == 12 and shown.row is not None and shown.row.lengths == capture.lengths
        assert re.fullmatch(r"encoded by pca in [\d.]+ s: \d+ kB in 8 shots; vertices move by at most 0.5%", shown.note)
    assert prepare(capture, "0.5%") is shown
    assert shown.described().startswith("Capture") and "12 frames in 8 shots" in shown.described()
    last = capture.shots[-1].n_vertices - 1
    assert read_pick(shown, {"vertex": last, "frame": 12}) is None
    pick = read_pick(shown, {"vertex": last, "frame": 11})
    assert pick and pick.frame == 11 and np.linalg.norm(pick.position - capture.shots[-1][0], axis=1).min() < 0.01
    (tmp_path / "splash.mp4").write_bytes(shown.data())
    for opened in (tmp_path / "splash.mp4", gvpipe.open_capture(tmp_path / "splash.mp4")):
        assert prepare(opened, "0.5%").data() == shown.data() and not prepare(opened, "0.5%").note
    assert '<td style="text-align:left">8</td>' in gvpipe.open_capture(tmp_path / "splash.mp4")._repr_html_()


def test_how_a_capture_opens_is_looked_up_in_its_shots() -> None:
    capture = gvpipe.read_capture(SAMPLES / "splash")
    view = view_of_shots(prepare(capture, "0.5%").shots, None, None, None, speed=2.0)
    assert view.speed == 2.0 and view.field is None
    with pytest.raises(InputError, match="field 'stress' asked for; there are none"):
        view_of_shots(prepare(capture, "0.5%").shots, "stress", None, None)
