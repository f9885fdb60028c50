"""Images as the texels that kernels read: decoded, in linear light, each with its mip levels.

Texels are 16-bit, so that dark sRGB steps, 1/3295 of full light, stay apart. A level is the box-filtered half of the one
before; where a side is odd, three texels with changing weights become one, so that nothing shifts. In an image with alpha,
colours are averaged with alpha as weight: what cannot be seen leaves no fringe.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from gvpipe.asset.grey import grey_levels
from gvpipe.asset.material import Image
from gvpipe.asset.moving import Pictures
from gvpipe.foundation.arrays import Array, Float32, Int32, Int64
from gvpipe.foundation.errors import GvpipeError
from gvpipe.rasterizer.colours import to_linear

MAX_PIXELS = 1 << 26  # of an image that is decoded, and of all texels: 8192 x 8192
MAX_SIDE = 4096  # texels along an axis; a larger image is halved until it fits
MAX_LEVELS = 13  # log2 of MAX_SIDE, and one
FULL = 65535


class Texels(NamedTuple):
    """Images of which kernels read single texels.

    Args:
        numbers: ``(N, 4) uint16``, RGBA, rows from the top, level after level, image after image.
        levels: ``(I, MAX_LEVELS, 3) int64``, first texel, width and height of each level.
        counts: ``(I,) int32``, levels of each image.
    """

    numbers: Array
    levels: Int64
    counts: Int32


NO_TEXELS = Texels(np.zeros((0, 4), np.uint16), np.zeros((0, MAX_LEVELS, 3), np.int64), np.zeros(0, np.int32))


def largest_side(images: Iterable[Image]) -> int:
    """The side, texels, that images are halved to, so that all of them together have at most `MAX_PIXELS`."""
    sizes = [image.size or (1, 1) for image in images]
    side = MAX_SIDE
    while side > 1 and sum(w * h * min(1.0, side / max(w, h)) ** 2 for w, h in sizes) > MAX_PIXELS:
        side //= 2
    return side


def decode_image(image: Image, side: int = MAX_SIDE) -> Array | str:
    """Return pixels ``(h, w, 4) uint8`` or ``uint16``, RGBA, at most ``side`` along an axis, or a text: why not.

    Of a moving image these are those of frame 0.
    """
    from PIL import Image as Pillow

    if image.pictures is not None:
        try:
            return decode_frame(image.pictures, 0, side)
        except GvpipeError as exc:
            return f"cannot be decoded ({exc})"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, whose pixels are counted instead
            opened = Pillow.open(io.BytesIO(image.data))
            opened.draft("RGB", (side, side))  # a JPEG decodes no more pixels than that needs
            width, height = opened.size
            if width * height > MAX_PIXELS:
                return f"has {width} x {height} pixels; at most {MAX_PIXELS} are drawn"
            grey = grey_levels(opened)
            if grey is not None:
                return _halved_to_fit(np.dstack([grey, grey, grey, np.full_like(grey, FULL)]), side)
            return _halved_to_fit(np.asarray(opened.convert("RGBA")), side)
    except Exception:  # damaged files raise nearly anything inside Pillow
        return f"({image.media_type}) cannot be decoded"


def decode_frame(pictures: Pictures, frame: int, side: int = MAX_SIDE) -> Array:
    """The same of a frame's picture; raises as `Pictures.pixels`."""
    pixels = pictures.pixels(frame)
    opaque = np.full((*pixels.shape[:2], 1), np.iinfo(pixels.dtype).max, pixels.dtype)
    return _halved_to_fit(np.concatenate([pixels, opaque], axis=2), side)


class MovingTexels:
    """Texels of moving images, changed in place from frame to frame.

    Args:
        texels: of all images, those of frame 0.
        moving: pictures of those that move, by their number in ``texels``, and whether they are sRGB.
        side: largest side, texels.
    """

    def __init__(self, texels: Texels, moving: dict[int, tuple[Pictures, bool]], side: int) -> None:
        self._texels, self._moving, self._side = texels, moving, side
        self._frame = 0

    def show(self, frame: int) -> None:
        """Have the texels of a frame; raises as `Pictures.pixels`."""
        if frame == self._frame or not self._moving:
            return
        for number, (pictures, is_srgb) in self._moving.items():
            packed = pack([decode_frame(pictures, frame, self._side)], [is_srgb])
            start = int(self._texels.levels[number, 0, 0])
            self._texels.numbers[start : start + len(packed.numbers)] = packed.numbers
        self._frame = frame


def pack(pixels: list[Array], is_srgb: list[bool]) -> Texels:
    """Return images ``(h, w, 4)`` of 8 or 16 bits with their levels; sRGB ones become linear light."""
    if not pixels:
        return NO_TEXELS
    rows: list[Array] = []
    levels = np.zeros((len(pixels), MAX_LEVELS, 3), np.int64)
    counts = np.zeros(len(pixels), np.int32)
    start = 0
    for number, (image, srgb) in enumerate(zip(pixels, is_srgb, strict=True)):
        level = _linear(image, srgb)
        while True:
            height, width = level.shape[:2]
            levels[number, counts[number]] = start, width, height
            counts[number] += 1
            rows.append(np.rint(FULL * level).astype(np.uint16).reshape(-1, 4))
            start += width * height
            if max(width, height) == 1:
                break
            level = _halved(level)
    return Texels(np.concatenate(rows), levels, counts)


def _linear(image: Array, is_srgb: bool) -> Float32:
    """``(h, w, 4)``, 0..1."""
    largest = np.iinfo(image.dtype).max
    scale = np.arange(largest + 1) / largest
    colour = (to_linear(scale) if is_srgb else scale).astype(np.float32)
    result = colour[image]
    result[:, :, 3] = scale.astype(np.float32)[image[:, :, 3]]
    return np.asarray(result)


def _halved_to_fit(pixels: Array, side: int) -> Array:
    while max(pixels.shape[:2]) > side:
        pixels = np.rint(_halved(pixels.astype(np.float32))).astype(pixels.dtype)
    return pixels


def _halved(level: Float32) -> Float32:
    """The next level: half as many texels along each axis, rounded down, one at least; alpha weighs colours."""
    weight = level[:, :, 3:]
    if weight.min() < weight.max():
        weight = weight + np.float32(1e-4) * max(1.0, float(weight.max()))
        sums = _halved_along(_halved_along(np.concatenate([level[:, :, :3] * weight, weight], axis=2), 0), 1)
        alpha = _halved_along(_halved_along(level[:, :, 3:], 0), 1)
        return np.concatenate([sums[:, :, :3] / sums[:, :, 3:], alpha], axis=2)
    return _halved_along(_halved_along(level, 0), 1)


def _halved_along(level: Float32, axis: int) -> Float32:
    """One axis of the same: the mean over boxes of n / (n // 2) texels."""
    level = np.moveaxis(level, axis, 0)
    n = len(level)
    half = n // 2
    if half == 0:
        return np.moveaxis(level, 0, axis)
    if n % 2 == 0:
        return np.moveaxis((level[0::2] + level[1::2]) * np.float32(0.5), 0, axis)
    step = np.arange(half, dtype=np.float32).reshape(-1, 1, 1)
    sums: Float32 = (half - step) * level[0:-1:2] + half * level[1::2] + (step + 1) * level[2::2]
    result = (sums / n).astype(np.float32)
    return np.moveaxis(result, 0, axis)
