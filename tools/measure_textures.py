"""Measure moving textures: bytes, PSNR in the texels that are seen, CPU time, by quality and codec, as a Markdown table.

The pictures are made: 40 of 1024 x 1024 pixels, waves of colour on round charts that cover a quarter, black beside them.

    python tools/measure_textures.py [--size PIXELS] [--frames N]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from gvpipe.foundation.arrays import Bool, UInt8
from gvpipe.media.picture_reader import PictureReader, take_apart
from gvpipe.media.picture_video import ENCODERS, encode_pictures
from gvpipe.media.texel_fill import TexelFill

CHARTS = 30
SEED = 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--frames", type=int, default=40)
    options = parser.parse_args()
    used = charts(options.size)
    rows = [picture(frame, used) for frame in range(options.frames)]
    print(f"{options.frames} pictures of {options.size} x {options.size}, {100 * used.mean():.0f} % used\n")
    print(
        "| codec | quality | filled | kB | PSNR, dB | CPU s to code | CPU ms a picture to decode |\n| --- " + "| --- " * 6 + "|"
    )
    for codec in ENCODERS:
        for quality in (50, 75, 90):
            for is_filled in (True, False) if codec == "h264" else (True,):
                measure(rows, used, codec, quality, is_filled)


def measure(rows: list[UInt8], used: Bool, codec: str, quality: int, is_filled: bool) -> None:
    """Print a row of the table."""
    size, start = (used.shape[1], used.shape[0]), time.process_time()
    fill = TexelFill(used)
    video = encode_pictures((fill(each) if is_filled else each for each in rows), size, 30, codec, quality)
    coded = time.process_time()
    reader = PictureReader(lambda: take_apart(video), size, len(rows))
    errors = [np.mean((reader.pixels(k).astype(float) - rows[k])[used] ** 2) for k in range(len(rows))]
    decoded = time.process_time() - coded
    psnr = 10 * np.log10(255**2 / np.mean(errors))
    cells = (codec, quality, "yes" if is_filled else "no", f"{len(video) / 1e3:.0f}", f"{psnr:.1f}", f"{coded - start:.1f}")
    print("| " + " | ".join(map(str, cells)) + f" | {1e3 * decoded / len(rows):.0f} |")


def charts(size: int) -> Bool:
    """Round charts."""
    rng, (y, x) = np.random.default_rng(SEED), np.mgrid[:size, :size]
    used = np.zeros((size, size), bool)
    for _ in range(CHARTS):
        row, column = rng.integers(0, size, 2)
        used |= (y - row) ** 2 + (x - column) ** 2 < rng.integers(size // 100, size // 11) ** 2
    return used


def picture(frame: int, used: Bool) -> UInt8:
    """Waves of colour, black where nothing is seen."""
    y, x = np.mgrid[: used.shape[0], : used.shape[1]]
    waves = 100 * np.sin(x / 15 + frame / 5), 100 * np.cos(y / 11), 60 * np.sin((x + y) / 30 - frame / 9)
    pixels: UInt8 = np.clip(128 + np.stack(waves, axis=-1), 0, 255).astype(np.uint8)
    pixels[~used] = 0
    return pixels


if __name__ == "__main__":
    main()
