"""Rows of pictures, one for each frame: files in a folder or of a pattern, or a video."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.material import MAX_SIDE, image_size
from gvpipe.asset.moving import Pictures
from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.io.fetching import fetch
from gvpipe.io.frames.discovery import find_files
from gvpipe.io.pictures import read_picture
from gvpipe.media.picture_reader import PictureReader, take_apart_file
from gvpipe.media.picture_video import check_count, copy_pictures

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff", ".gif")
VIDEOS = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi")
ONE_SIZE = "all pictures of a moving texture need one size"


class FilePictures:
    """Pictures in files (`Pictures`).

    Args:
        paths: one for each frame.
        start: number of the first frame, for messages.

    Raises:
        InputError: a file that is not there, is no picture, or has another size than the first; the message names the frame.
    """

    def __init__(self, paths: Sequence[Path], start: int = 0) -> None:
        self._paths = list(paths)
        sizes: dict[Path, tuple[int, int]] = {}
        for frame, path in enumerate(self._paths):
            if path not in sizes:
                sizes[path] = _size(path, start + frame)
            if sizes[path] != sizes[self._paths[0]]:
                (width, height), (first_width, first_height) = sizes[path], sizes[self._paths[0]]
                raise InputError(
                    f"{path} (frame {start + frame}) has {width}x{height} pixels, {self._paths[0].name} has "
                    f"{first_width}x{first_height}; {ONE_SIZE}"
                )
        self._size = sizes[self._paths[0]]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._size

    def __len__(self) -> int:
        return len(self._paths)

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`: the file as it is."""
        image = read_picture(self._paths[frame])
        return image.media_type, image.data

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`; alpha is left out."""
        return _pixels(self.file(frame)[1], self._paths[frame], self._size)

    @property
    def has_alpha(self) -> bool:
        """Whether the first picture is see-through somewhere."""
        from PIL import Image

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(self._paths[0]) as opened:
                return opened.has_transparency_data and bool(np.asarray(opened.convert("RGBA"))[:, :, 3].min() < 255)


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
        """Of the track: ``"h264"``, ``"hevc"``, ``"av1"`` or ``"vp9"``."""
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
    from gvpipe.asset.moving import SomePictures

    if start and count >= start + n_frames and count != n_frames:
        return SomePictures(pictures, start, start + n_frames)
    check_count(count, n_frames, name)
    made: Pictures = pictures
    return made


def _size(path: Path, frame: int) -> tuple[int, int]:
    """Of a picture, from its head; raises `InputError` that names the frame."""
    try:
        with open(path, "rb") as file:
            size = image_size(file.read())
    except OSError as exc:
        raise InputError(f"{path} (frame {frame}) cannot be read: {exc.strerror or exc}; check the file") from exc
    if size is None or max(size) > MAX_SIDE:
        what = "is no picture that can be opened" if size is None else f"has more than {MAX_SIDE} pixels a side"
        raise InputError(f"{path} (frame {frame}) {what}; export it as PNG or JPEG")
    return size


def _pixels(data: bytes, path: Path, size: tuple[int, int]) -> UInt8:
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, whose side is checked instead
            opened = Image.open(io.BytesIO(data))
            if opened.size != size:
                raise InputError(
                    f"{path} has {opened.width}x{opened.height} pixels now, and had {size[0]}x{size[1]}; read it again"
                )
            if opened.mode.startswith("I;16"):
                grey = (np.asarray(opened, np.uint16) >> 8).astype(np.uint8)
                return np.ascontiguousarray(np.repeat(grey[:, :, None], 3, axis=2))
            return np.asarray(opened.convert("RGB"))
    except InputError:
        raise
    except Exception as exc:  # damaged files raise nearly anything inside Pillow
        raise InputError(f"{path} cannot be decoded ({exc}); export the picture again") from exc
