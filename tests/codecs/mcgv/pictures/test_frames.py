"""A frame costs its group of pictures, or its one picture, and the group is kept for the next frame."""

from __future__ import annotations

from pathlib import Path

import pytest
from sequences import waving

import gvpipe
from gvpipe.media.video import VideoReader


@pytest.mark.parametrize(("settings", "wanted"), [({"gop": 8}, [2, 0, 4]), ({"image": "jpeg"}, [17, 18, 20, 3, 39])])
def test_frames_decode_no_more_than_their_group(
    settings: dict[str, object], wanted: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gvpipe.encode(waving(8, 40), tmp_path / "a.mp4", **settings)  # type: ignore[arg-type]
    decoded: list[int] = []
    plain = VideoReader._decode

    def counted(self: VideoReader, group: int) -> object:
        if self._cached[0] != group:
            decoded.append(group)
        return plain(self, group)

    monkeypatch.setattr(VideoReader, "_decode", counted)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert decoded == []
        for k in (17, 18, 20, 3, 39):
            assert video[k].shape == (64, 3)
    assert decoded == wanted


@pytest.mark.parametrize("prediction", ["affine", "blended"])
def test_the_player_fetches_whole_groups_of_pictures(prediction: str, tmp_path: Path) -> None:
    gvpipe.encode(waving(8, 40), tmp_path / "a.mp4", gop=8, prediction=prediction)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        video[17]
        assert list(video._cache._groups) == [(16, 24)]
