"""Pictures to files: PNG one, GIF and MP4 several, painted one at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np

from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.progress import Progress

STILL = ".png"  # the format of one picture
GIF_FPS = 50.0  # browsers slow down GIFs that are faster
PALETTE_FRAMES = 6  # pictures that a GIF's one palette is made from


class Pictures(Protocol):
    """What is written: pictures ``(H, W, 3) uint8``, sRGB, painted when they are asked for."""

    @property
    def fps(self) -> float: ...

    def __len__(self) -> int: ...

    def __getitem__(self, k: int, /) -> UInt8: ...


def _painted(pictures: Pictures, progress: Progress | None, step: int = 1) -> Iterator[UInt8]:
    for k in range(0, len(pictures), step):
        yield pictures[k]
        if progress:
            progress("render", min(1.0, (k + step) / len(pictures)))


def _write_png(pictures: Pictures, path: Path, progress: Progress | None) -> None:
    from PIL import Image

    for picture in _painted(pictures, progress):
        Image.fromarray(picture).save(path, "PNG", optimize=True)


def _write_gif(pictures: Pictures, path: Path, progress: Progress | None) -> None:
    from PIL import Image

    step = math.ceil(pictures.fps / GIF_FPS)
    count = len(range(0, len(pictures), step))
    # GIF counts in hundredths of a second: every picture ends at the hundredth nearest to its time
    ends = np.rint(np.arange(1, count + 1) * step * 100 / pictures.fps).astype(int)
    durations = np.maximum(np.diff(ends, prepend=0), 1) * 10
    some = np.unique(np.linspace(0, len(pictures) - 1, PALETTE_FRAMES).round().astype(int)).tolist()
    palette = Image.fromarray(np.concatenate([pictures[k] for k in some])).quantize(256, Image.Quantize.MEDIANCUT)
    images = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in _painted(pictures, progress, step)
    )
    first = next(images)
    first.save(path, "GIF", save_all=True, append_images=images, duration=durations.tolist(), loop=0, disposal=1)


def _write_mp4(pictures: Pictures, path: Path, progress: Progress | None) -> None:
    from gvpipe.media.film import write_film

    write_film(path, _painted(pictures, progress), pictures.fps)


WRITERS: dict[str, Callable[[Pictures, Path, Progress | None], None]] = {
    STILL: _write_png,
    ".gif": _write_gif,
    ".mp4": _write_mp4,
}
