"""A comparison in a notebook: its numbers, and the error of every frame as a line."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

WIDTH, HEIGHT = 480, 110  # of the plot, pixels
LINES = (("max", "#c2482f"), ("rmse", "#2f6fb3"))  # by frame, and their colours
PERCENT = ("rmse_diag", "max_diag")  # parts of the diagonal, shown as percent of it
SHOWN = {
    "rmse_diag": "root mean square error, % of the diagonal",
    "max_diag": "largest error, % of the diagonal",
    "kg": "KG error, %",
    "da": "DA error, %",
    "sted": "STED error",
    "hausdorff": "Hausdorff distance, model units",
}
OF_METRICS = {
    "psnr": "signal-to-noise ratio of vertices, dB",
    "dame": "dihedral angle mesh error, radians",
    "fmpd": "fast mesh perceptual distance",
    "mesh": "root mean square distance over the area, model units",
    "d1": "D1, dB",
    "d2": "D2, dB",
}
OF_SURFACES = {
    "rms_diag": "root mean square distance of the surfaces, % of the diagonal",
    "p99_diag": "99 % of distances are below, % of the diagonal",
    "max_diag": "largest distance, % of the diagonal",
}


def comparison_html(numbers: Mapping[str, Any]) -> str:
    """A table of a comparison's numbers that have a meaning, and a plot of the errors over the frames."""
    rows = []
    for name, words in SHOWN.items():
        value = numbers[name]
        if value is not None:
            rows.append((words, f"{100 * value if name in PERCENT else value:.4g}"))
    surface = numbers.get("surface")
    if surface:
        rows += [(words, f"{100 * surface[name]:.4g}") for name, words in OF_SURFACES.items() if surface[name] is not None]
    for name, metric in numbers["metrics"].items():
        if metric["value"] is not None:
            rows.append((OF_METRICS[name], f"{metric['value']:.4g}"))
    for kind in ("attributes", "fields", "volume"):
        for name, errors in numbers[kind].items():
            rows.append((f"{name}: largest error", f"{errors['max']:.4g}" if errors.get("max") is not None else "none"))
    for name, ratios in numbers["textures"].items():
        if ratios["rgb_psnr"] is not None:
            rows.append((f"colours of {name}: signal-to-noise ratio, dB", f"{ratios['rgb_psnr']:.4g}"))
    cell = '<td style="text-align: left">{}</td>'
    table = "".join(f"<tr>{cell.format(html.escape(words))}{cell.format(value)}</tr>" for words, value in rows)
    frames = numbers["frames"]
    if surface and not frames:  # vertices do not correspond
        frames = [{"max": frame["max"], "rmse": frame["rms"]} for frame in surface["frames"]]
    plot = _plot(frames)
    return f"<div><table>{table}</table>{plot}</div>"


def _plot(frames: Sequence[dict[str, float]]) -> str:
    """Errors by frame, in model units from 0 on."""
    most = max(frame["max"] for frame in frames) or 1.0
    lines, words = [], []
    for name, colour in LINES:
        points = [
            f"{WIDTH * k / max(1, len(frames) - 1):.1f},{HEIGHT * (1 - frame[name] / most):.1f}"
            for k, frame in enumerate(frames)
        ]
        lines.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        words.append(f'<span style="color: {colour}">{name}</span>')
    label = f"errors of frames 0 to {len(frames) - 1}, at most {most:.3g} model units"
    picture = f'<svg viewBox="0 -2 {WIDTH} {HEIGHT + 4}" width="{WIDTH}" height="{HEIGHT + 4}" role="img" aria-label="{label}">'
    return f"{picture}{''.join(lines)}</svg><div>{' and '.join(words)}: {label}</div>"
