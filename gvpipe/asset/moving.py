"""Moving images: one picture for each frame of a film, all of one size, read when it is asked for."""

from __future__ import annotations

import io
from typing import Any, Protocol

import numpy as np

from gvpipe.foundation.arrays import Array, UInt8
from gvpipe.foundation.errors import InputError

PNG = "image/png"


class Pictures(Protocol):
    """A row of pictures; its length is the number of frames."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        ...

    def __len__(self) -> int: ...

    def file(self, frame: int) -> tuple[str, bytes]:
        """Media type and bytes of the picture of a frame; raises `InputError` or `FormatError` if it cannot be read."""
        ...

    def pixels(self, frame: int) -> UInt8:
        """The picture of a frame, ``(height, width, 3) uint8``, RGB, rows from the top; raises as `file`."""
        ...


class SomePictures:
    """Pictures of the frames ``start`` to ``stop`` of others."""

    def __init__(self, pictures: Pictures, start: int, stop: int) -> None:
        self._pictures, self._frames = pictures, range(start, stop)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._pictures.size

    def __len__(self) -> int:
        return len(self._frames)

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`."""
        return self._pictures.file(self._frames[frame])

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`."""
        return self._pictures.pixels(self._frames[frame])


class ArrayPictures:
    """Pictures in an array, or in anything that has a shape and gives frames by their number.

    Args:
        pixels: ``(F, height, width, 3) uint8``, RGB, rows from the top.

    Raises:
        InputError: another shape or type.
    """

    def __init__(self, pixels: Any) -> None:
        shape = tuple(getattr(pixels, "shape", ()))
        if len(shape) != 4 or shape[3] != 3 or min(shape) < 1 or np.dtype(getattr(pixels, "dtype", "O")) != np.uint8:
            raise InputError(
                f"a moving image is {getattr(pixels, 'dtype', type(pixels).__name__)} of shape {shape}; "
                "(frames, height, width, 3) uint8 is needed"
            )
        self._pixels = pixels

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return int(self._pixels.shape[2]), int(self._pixels.shape[1])

    def __len__(self) -> int:
        return int(self._pixels.shape[0])

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`: a PNG."""
        return PNG, png_of(self.pixels(frame))

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`."""
        return np.asarray(self._pixels[frame], np.uint8)


def as_pictures(given: Any) -> Pictures:
    """Pictures as they are, or those of an array; raises `InputError` for what is neither."""
    if all(hasattr(given, name) for name in ("size", "file", "pixels", "__len__")):
        pictures: Pictures = given
        return pictures
    return ArrayPictures(given)


def png_of(pixels: Array) -> bytes:
    """A PNG of ``(height, width, 3) uint8``."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", compress_level=4)
    return file.getvalue()
