"""Rate-distortion plots from a bench report alone: one picture per sequence, KG, rmse and STED against bits, log axes.

Other codecs' results are drawn beside ours, dashed, from a CSV file with a header. Its columns are ``seq``, ``codec``,
``bpvf``, ``kg`` and ``rmse_rel`` (rmse as a part of frame 0's diagonal). Rows without a number are left out.
"""

from __future__ import annotations

import csv
import os
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gvpipe.benchmark.pictures import draw_pictures
from gvpipe.benchmark.report import BenchReport, Curve
from gvpipe.foundation.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = {"kg": "KG error, %", "rmse_diag": "rmse, part of the diagonal", "sted": "STED"}
PEER_COLUMNS = {"kg": "kg", "rmse_diag": "rmse_rel"}
SIZE = (15.0, 6.0)  # inches
LEGEND_COLUMNS = 6
MARKERS = "os^"  # of the first ten codecs, of the next

Peers = dict[str, dict[str, list[dict[str, float]]]]  # sequence -> codec -> points


def draw(report: BenchReport, folder: str | os.PathLike[str], peers: Peers | None = None) -> list[Path]:
    """Draw a PNG file per sequence into ``folder``, which is made if need be, and return their paths.

    Raises:
        InputError: matplotlib is not installed, or the report has no curve.
        OutputError: a file cannot be written.
    """
    by_sequence: dict[str, list[Curve]] = defaultdict(list)
    for curve in report.curves:
        by_sequence[curve.sequence].append(curve)
    drawn = {name: partial(_draw_sequence, name, curves, (peers or {}).get(name, {})) for name, curves in by_sequence.items()}
    return draw_pictures(folder, drawn)


def read_peers(path: str | os.PathLike[str]) -> Peers:
    """Read other codecs' results.

    Raises:
        InputError: the file cannot be read, or lacks a column.
    """
    peers: Peers = defaultdict(lambda: defaultdict(list))
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = csv.DictReader(file)
            missing = {"seq", "codec", "bpvf", *PEER_COLUMNS.values()} - set(rows.fieldnames or ())
            if missing:
                raise InputError(f"{path}: no column {', '.join(sorted(missing))}; a CSV file with a header is needed")
            for row in rows:
                point = {key: _number(row[column]) for key, column in {"bpvf": "bpvf", **PEER_COLUMNS}.items()}
                peers[row["seq"]][row["codec"]].append({key: value for key, value in point.items() if value is not None})
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path") from exc
    except (csv.Error, UnicodeDecodeError) as exc:
        raise InputError(f"{path} is not a CSV file in UTF-8 ({exc})") from exc
    return peers


def _draw_sequence(name: str, curves: list[Curve], peers: dict[str, list[dict[str, float]]]) -> Figure:
    from matplotlib import colormaps
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    ours, theirs = colormaps["tab10"], colormaps["tab20c"]
    lines: list[tuple[str, list[dict[str, Any]], dict[str, Any]]] = []
    for i, curve in enumerate(curves):
        marker = MARKERS[i // 10 % len(MARKERS)]
        lines.append((curve.codec, curve.points, {"color": ours(i % 10), "marker": marker, "linewidth": 2.0, "zorder": 3}))
    for i, (codec, points) in enumerate(peers.items()):
        style = {"color": theirs(i % 20), "marker": "x", "linestyle": "--", "linewidth": 1.0, "markersize": 4}
        lines.append((codec, points, style))
    figure = Figure(figsize=SIZE, layout="constrained")
    labelled: dict[str, Any] = {}
    for panel, (measure, title) in zip(figure.subplots(1, len(AXES)), AXES.items(), strict=True):
        for codec, points, style in lines:
            drawn = sorted((p["bpvf"], p[measure]) for p in points if p.get("bpvf") and p.get(measure))
            if drawn:  # others have no place on logarithmic axes
                labelled[codec] = panel.plot(*zip(*drawn, strict=True), **style)[0]
        panel.set(xscale="log", yscale="log", xlabel="bits per vertex and frame, whole file", ylabel=title)
        panel.grid(True, which="both", alpha=0.25)
        panel.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
    figure.legend(list(labelled.values()), list(labelled), loc="outside lower center", ncols=LEGEND_COLUMNS, fontsize="small")
    figure.suptitle(f"{name}: {curves[0].vertices} vertices, {curves[0].frames} frames")
    return figure


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if 0 < value < float("inf") else None
