"""A row of pictures in files, one for each frame."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gvpipe.asset.grey import eight_bits
from gvpipe.asset.material import MAX_SIDE, image_size
from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.io.pictures import read_picture

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


class BytesPictures:
    """Pictures whose files are in memory (`Pictures`).

    Args:
        files: media type and bytes, one for each frame.
        start: number of the first frame, for messages.

    Raises:
        InputError: one is no picture, or has another size than the first; the message names the frame.
    """

    def __init__(self, files: Sequence[tuple[str, bytes]], start: int = 0) -> None:
        self._files = list(files)
        sizes = [image_size(data) for _, data in self._files]
        for frame, size in enumerate(sizes):
            if size is None or size != sizes[0]:
                found = "is no picture that can be opened" if size is None else f"has {size[0]}x{size[1]} pixels"
                raise InputError(f"the picture of frame {start + frame} {found}; {ONE_SIZE}")
        assert sizes[0] is not None
        self._size = sizes[0]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._size

    def __len__(self) -> int:
        return len(self._files)

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`."""
        return self._files[frame]

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`; alpha is left out."""
        return _pixels(self._files[frame][1], Path(f"the picture of frame {frame}"), self._size)


def _size(path: Path, frame: int) -> tuple[int, int]:
    """A picture's size, from its head; raises `InputError` that names the frame."""
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
            return np.asarray(eight_bits(opened).convert("RGB"))
    except InputError:
        raise
    except Exception as exc:  # damaged files raise nearly anything inside Pillow
        raise InputError(f"{path} cannot be decoded ({exc}); export the picture again") from exc
