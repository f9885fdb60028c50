"""Processor time and memory against vertices and against frames, from a scale report alone, log axes.

A grey line is the sum of a fixed cost and one that grows as vertices times frames do (`gvpipe.benchmark.growth`). Dotted:
memory of 300 MB and six times the longest segment's positions as float32.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.benchmark.growth import fit_line
from gvpipe.benchmark.pictures import draw_pictures
from gvpipe.benchmark.scale_report import ScalePoint, ScaleReport

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = {"vertices": "frames", "frames": "vertices"}  # what grows, and what stays
PANELS = {
    "encode_cpu_s": "encode, processor time, s",
    "decode_cpu_s": "decode, processor time, s",
    "encode_peak_mb": "encode, peak MB",
    "decode_peak_mb": "decode, peak MB",
}
SIZE = (12.0, 9.0)  # inches
GREY = "0.6"
FIXED_MB, PER_SEGMENT = 300.0, 6.0  # memory


def draw(report: ScaleReport, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw ``scale-vertices.png`` and ``scale-frames.png`` into ``folder``, and return their paths.

    Raises:
        InputError: matplotlib is not installed, or the report has no row of two sizes.
        OutputError: a file cannot be written.
    """
    rows = {grows: row_of(report.scale, grows) for grows in ROWS}
    return draw_pictures(folder, {f"scale-{grows}": partial(_draw_row, grows, row) for grows, row in rows.items() if row})


def row_of(points: Iterable[ScalePoint], grows: str) -> list[ScalePoint]:
    """The points of the row in which ``grows`` (vertices or frames) takes most values, in that order."""
    stays = ROWS[grows]
    by_other: dict[int, list[ScalePoint]] = defaultdict(list)
    for point in points:
        by_other[getattr(point, stays)].append(point)
    longest = max(by_other.values(), key=lambda row: len({getattr(point, grows) for point in row}), default=[])
    is_row = len({getattr(point, grows) for point in longest}) > 1
    return sorted(longest, key=lambda point: int(getattr(point, grows))) if is_row else []


def _draw_row(grows: str, row: list[ScalePoint]) -> Figure:
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    colours = colormaps["tab10"]
    figure = Figure(figsize=SIZE, layout="constrained")
    codecs = list(dict.fromkeys(point.codec for point in row))
    for panel, (key, title) in zip(figure.subplots(2, 2).flat, PANELS.items(), strict=True):
        for i, codec in enumerate(codecs):
            known = [(getattr(p, grows), getattr(p, key)) for p in row if p.codec == codec and getattr(p, key)]
            if not known:
                continue
            x, y = zip(*known, strict=True)
            panel.plot(x, y, marker="o", color=colours(i % 10), label=codec)
            line = fit_line([p for p in row if p.codec == codec], key) if key.endswith("_s") else None
            if line:
                sizes = np.geomspace(x[0], x[-1])
                costs = line.fixed + line.slope * sizes * getattr(row[0], ROWS[grows])
                panel.plot(sizes, costs, color=GREY, linewidth=0.8, zorder=1)
        if key.endswith("_mb"):
            bound = [(getattr(p, grows), FIXED_MB + PER_SEGMENT * p.segment_mb) for p in row if p.codec == codecs[0]]
            panel.plot(*zip(*bound, strict=True), linestyle=":", color=GREY)
        panel.set(xscale="log", yscale="log", xlabel=f"{grows}, {getattr(row[0], ROWS[grows])} {ROWS[grows]}", ylabel=title)
        panel.grid(True, which="both", alpha=0.25)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=len(codecs), fontsize="small")
    return figure
