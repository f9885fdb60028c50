"""Rows of pictures, one for each frame, by what names them: files in a folder or of a pattern, or a video."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gvpipe.asset.moving import Pictures, SomePictures
from gvpipe.foundation.errors import InputError
from gvpipe.io.fetching import fetch
from gvpipe.io.frames.discovery import find_files
from gvpipe.io.picture_files import FilePictures
from gvpipe.media.picture_reader import PictureReader, take_apart_file
from gvpipe.media.picture_video import check_count, copy_pictures

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff", ".gif")
VIDEOS = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi")


class VideoPictures(PictureReader):
    """Pictures of a video file (`Pictures`), which may be taken as they are coded.

    Args:
        path: of the file.

    Raises:
        InputError: it is no video, or of a codec that is not read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        coded, size, self._codec = take_apart_file(path)
        super().__init__(lambda: coded, size, len(coded.packets), name=path.name)

    @property
    def codec(self) -> str:
        """The track's codec: ``"h264"``, ``"hevc"``, ``"av1"`` or ``"vp9"``."""
        return self._codec

    def track(self, fps: float) -> bytes:
        """Its coded pictures as an MP4 file of one track; raises `InputError`."""
        return copy_pictures(self._path, os.fspath(self._path), fps, len(self))


def open_pictures(path: str | os.PathLike[str], n_frames: int, frames: tuple[int, int | None] | None = None) -> Pictures:
    """Return the pictures of a folder, glob, pattern, list in a pattern's place, or video, one for each frame.

    Args:
        path: what names them.
        n_frames: frames of the mesh.
        frames: which of a longer film these are: the first, and the one after the last.

    Raises:
        InputError: no pictures, gaps, other sizes, or another number of them than there are frames.
    """
    name = os.fspath(path)
    start = frames[0] if frames else 0
    if Path(name).suffix.lower() in VIDEOS and not os.path.isdir(name):
        fetch(Path(name))
        video = VideoPictures(Path(name))
        return _of_frames(video, len(video), n_frames, start, name)
    files = find_files(name, PICTURES, "picture")
    chosen = files[start : start + n_frames] if frames and len(files) != n_frames else files
    if len(chosen) != n_frames:
        raise InputError(
            f"{name} has {len(chosen)} pictures, the mesh has {n_frames} frames; give one picture for each frame"
            + (f": there is none of frame {start + len(chosen)}" if len(chosen) < n_frames else "")
        )
    for each in chosen:
        fetch(each)
    return FilePictures(chosen, start)


def _of_frames(pictures: Any, count: int, n_frames: int, start: int, name: str) -> Pictures:
    if start and count >= start + n_frames and count != n_frames:
        return SomePictures(pictures, start, start + n_frames)
    check_count(count, n_frames, name)
    made: Pictures = pictures
    return made
