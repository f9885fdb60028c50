"""The legend of a picture whose colours mean numbers: a colour bar with its ticks, what they count, and the unit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from gvpipe.foundation.arrays import Float64, UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.rasterizer.colours import BACKGROUND

SMALLEST = (160, 120)  # pixels, of a picture with a legend
INK = (60, 60, 60)
MOST_TICKS = 6
WIDEST_TIME = "t = -1.23457e-05 s"
LONGEST_TITLE = 24  # characters of a line


def paint_legend(size: tuple[int, int], titles: Sequence[str], ticks: Mapping[float, str], colours: Float64) -> UInt8:
    """Return a colour bar with its numbers: ``(H, w, 3) uint8``, the left edge of a picture of ``size`` (width, height).

    Args:
        titles: lines above the bar.
        ticks: labels by their part, 0..1, of the bar's length from below.
        colours: ``(n, 3)`` sRGB, 0..1, of the bar from below, in even steps.

    Raises:
        InputError: the picture is too small for it.
    """
    from PIL import Image, ImageDraw, ImageFont

    width, height = size
    text = _text_height(size)
    if width < SMALLEST[0] or height < SMALLEST[1]:
        raise InputError(f"a picture of {width}x{height}; with a legend, {SMALLEST[0]}x{SMALLEST[1]} pixels are the least")
    font = ImageFont.load_default(text)
    lines = [title if len(title) <= LONGEST_TITLE else title[: LONGEST_TITLE - 1] + "…" for title in titles]
    bar = 8 * text  # pixels, its length
    top = height - 2 * text - bar
    widest = max(map(font.getlength, lines)), 1.6 * text + max(map(font.getlength, ticks.values()))
    image = Image.new("RGB", (round(max(widest)) + 2 * text, height), tuple(round(255 * channel) for channel in BACKGROUND))
    draw = ImageDraw.Draw(image)
    for line, title in enumerate(lines):
        draw.text((text, top + (1.3 * (line + 2 - len(lines)) - 3.4) * text), title, fill=INK, font=font)
    steps = np.linspace(len(colours) - 1, 0, bar)
    rows = np.stack([np.interp(steps, np.arange(len(colours)), channel) for channel in colours.T], axis=1)
    for row, colour in enumerate(np.rint(255 * rows).astype(int).tolist()):
        draw.line([(text, top + row), (2 * text - 1, top + row)], fill=tuple(colour))
    for part, label in ticks.items():
        draw.text((2.6 * text, top + (1 - part) * (bar - 1)), label, fill=INK, font=font, anchor="lm")
    return np.asarray(image)


def widen_for_time(legend: UInt8, size: tuple[int, int]) -> UInt8:
    """Return a legend ``(H, w, 3)`` with room for what `write_time` writes; ``size`` as for `paint_legend`."""
    from PIL import ImageFont

    text = _text_height(size)
    width = math.ceil(ImageFont.load_default(text).getlength(WIDEST_TIME)) + 2 * text
    room = np.broadcast_to(legend[:, :1], (len(legend), max(width - legend.shape[1], 0), 3))
    return np.concatenate([legend, room], axis=1)


def write_time(legend: UInt8, size: tuple[int, int], time: float) -> UInt8:
    """Return a legend that `widen_for_time` made with a time, seconds, at its top."""
    from PIL import Image, ImageDraw, ImageFont

    text = _text_height(size)
    image = Image.fromarray(legend)
    ImageDraw.Draw(image).text((text, text), f"t = {time:.6g} s", fill=INK, font=ImageFont.load_default(text))
    return np.asarray(image)


def _text_height(size: tuple[int, int]) -> int:
    """Pixels."""
    return max(9, min(size[1] // 28, size[0] // 38))


def round_ticks(low: float, high: float) -> dict[float, str]:
    """Labels of round numbers, at most `MOST_TICKS`, by their part of the way from ``low`` to ``high``.

    Examples:
        >>> round_ticks(0, 246)
        {0.0: '0', 0.2032520325203252: '50', 0.4065040650406504: '100', 0.6097560975609756: '150', 0.8130081300813008: '200'}
    """
    extent = high - low
    smallest = extent / MOST_TICKS
    if not (math.isfinite(extent) and smallest > 1e-9 * max(abs(low), abs(high)) and smallest > 1e-300):
        return {0.0: f"{low:.6g}"} if low == high else {0.0: f"{low:.6g}", 1.0: f"{high:.6g}"}
    scale = 10.0 ** math.floor(math.log10(smallest))
    step = next(scale * factor for factor in (1, 2, 5, 10) if scale * factor >= smallest * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    digits = max(6, 2 + math.ceil(math.log10(max(abs(low), abs(high)) / step)))
    return {
        min(max((number * step - low) / extent, 0.0), 1.0): f"{number * step:.{digits}g}" for number in range(first, last + 1)
    }


def log_ticks(low: float, high: float) -> dict[float, str]:
    """Labels of powers of ten, at most `MOST_TICKS`, by their part of the way from ``low`` to ``high`` on a log scale.

    Between ends so near that fewer than two lie there, 2 and 5 times a power count too, or else the ends.

    Args:
        low, high: above 0.

    Examples:
        >>> log_ticks(0.1, 1000)
        {0.0: '0.1', 0.25: '1', 0.5: '10', 0.75: '100', 1.0: '1000'}
        >>> list(log_ticks(3, 30).values())
        ['5', '10', '20']
    """
    first, last = math.log10(low), math.log10(high)
    if not high > low:
        return {0.0: f"{low:.6g}"}
    powers = range(math.ceil(first - 1e-9), math.floor(last + 1e-9) + 1)
    places = [float(power) for power in powers][:: math.ceil(max(len(powers), 1) / MOST_TICKS)]
    if len(places) < 2:
        steps = (power + math.log10(factor) for power in range(math.floor(first), math.ceil(last)) for factor in (1, 2, 5))
        places = [place for place in steps if first - 1e-9 <= place <= last + 1e-9]
    if len(places) < 2:
        return {0.0: f"{low:.6g}", 1.0: f"{high:.6g}"}
    return {min(max((place - first) / (last - first), 0.0), 1.0): f"{10.0**place:.6g}" for place in places}
