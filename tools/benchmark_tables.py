"""Writes the tables of the benchmark pages from the results in ``docs/benchmarks``.

    python tools/benchmark_tables.py                    # the tables between markers, in all pages
    python tools/benchmark_tables.py plots              # the pictures of docs/scale.md and docs/curves.md
    python tools/benchmark_tables.py points FILE.json   # every point of one file, to standard output

A table stands between ``<!-- table: NAME -->`` and ``<!-- end -->``, NAME one of `TABLES`. Results have the shape that
`gvpipe bench --json` writes (`gvpipe.benchmark.report.BenchReport`). A file may add to it: ``targets`` (encodes to a given
error). What is null was not recorded. The folder ``curves`` has what ``tools/measure_curves.py`` writes. The folder ``scale``
has what `gvpipe bench --scale` writes (`gvpipe.benchmark.scale_report.ScaleReport`), and ``plan.json`` of
``tools/measure_plan.py``. The folder ``reproduction`` has what `gvpipe reproduce` writes
(`gvpipe.benchmark.reproduction.reproduce.Reproduction`).
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from gvpipe.benchmark.growth import exponents, fit_line
from gvpipe.benchmark.leaderboard import differences, leaders, matrix, points_by, rates
from gvpipe.benchmark.plots import draw as draw_curves
from gvpipe.benchmark.report import BenchReport
from gvpipe.benchmark.reproduction.claims import FAILS, HOLDS, NOT_RUN
from gvpipe.benchmark.reproduction.reproduce import table as reproduction_table
from gvpipe.benchmark.scale import FEW_FRAMES
from gvpipe.benchmark.scale_plots import draw, row_of
from gvpipe.benchmark.scale_report import ScalePoint, ScaleReport
from gvpipe.benchmark.scale_report import table as scale_table
from gvpipe.benchmark.tables import tables

DOCS = Path(__file__).parents[1] / "docs"
PAGES = (
    DOCS / "benchmarks.md",
    DOCS / "curves.md",
    DOCS / "reproduction.md",
    DOCS / "scale.md",
    DOCS / "codecs" / "mcgv.md",
)
QUALITY, BOUND = "quality-75", "bound-0.1-percent"  # files of results
MEASURED = {"kg": "KG", "sted": "STED", "max": "largest error"}  # of the leaderboard
MARKED = re.compile(r"(<!-- table: ([\w.-]+) -->\n).*?(<!-- end -->)", re.DOTALL)
NAMES = {
    "mcgv:prediction=affine": "`mcgv` affine",
    "mcgv:image=jpeg": "`mcgv` JPEG",
    "mcgv:prediction=blended": "`mcgv` blended",
    "mcgv:prediction=blended:transform=klt": "`mcgv` klt",
}  # others: their own
SYSTEMS = (
    *("mcgv", "mcgv:prediction=affine", "mcgv:prediction=affine:image=jpeg", "pca", "laplacian", "pdct"),
    *("pca:predictor=rbf", "pca:predictor=navg", "laplacian:operator=mean-value:delta_prediction=rigid", "pdct:clusters=40"),
    *("afxic", "awc", "coddyac", "cpca", "d3dmc", "dynapack", "dynapack:predictor=replica", "dynapack:predictor=space"),
    *("famc", "gv", "gv:prediction=none", "kglpc", "kglpc:taps=0", "maverg", "pcaanim", "rlpca", "rt", "tls"),
)  # codecs of docs/reproduction.md
SCALES = ("mcgv", "mcgv-affine", "pca", "laplacian", "pdct")  # files of scale/
COSTS = {"encode_cpu_s": "encode", "decode_cpu_s": "decode"}
CAPTURE = 20_000, 10 * 3600 * 30  # vertices, and frames: ten hours at 30 frames a second
DEFAULT, PUBLISHED, ANCHOR = "mcgv", "mcgv:prediction=affine", "pca"

Points = list[dict[str, Any]]


def load(name: str) -> dict[str, Any]:
    """A file of results by its name, without folder and extension."""
    values: dict[str, Any] = json.loads((DOCS / "benchmarks" / f"{name}.json").read_text("utf-8"))
    return values


def curves_of(results: dict[str, Any]) -> dict[str, dict[str, Points]]:
    """Points by sequence and codec."""
    found: dict[str, dict[str, Points]] = {}
    for curve in results["curves"]:
        found.setdefault(curve["sequence"], {})[curve["codec"]] = curve["points"]
    return found


def default_against_published() -> list[str]:
    """Bytes and errors of both at one quality, their quotient, and the default's rate at a target error."""
    results = load(QUALITY)
    targets = {target["sequence"]: target for target in results["targets"]}
    heads = ("default, bytes", "KG", "published, bytes", "KG", "part", "default at KG 0.1, bpvf (encodes)")
    rows, logarithms = [], []
    for sequence, codecs in curves_of(results).items():
        (ours,), (theirs,), target = codecs[DEFAULT], codecs[PUBLISHED], targets[sequence]
        part = ours["bytes"] / theirs["bytes"]
        logarithms.append(math.log(part))
        files = (f"{ours['bytes']}", f"{ours['kg']:.3f}", f"{theirs['bytes']}", f"{theirs['kg']:.3f}")
        rows.append((sequence, *files, f"{100 * part:.0f} %", f"{target['bpvf']:.3f} ({target['encodes']})"))
    mean = math.exp(sum(logarithms) / len(logarithms))
    return table(("sequence", *heads), [*rows, ("geometric mean", *"----", f"{100 * mean:.0f} %", "-")])


def errors_at_quality() -> list[str]:
    """KG errors of all codecs at one quality."""
    found = curves_of(load(QUALITY))
    rows = [(name, *(f"{points[0]['kg']:.3f}" for points in codecs.values())) for name, codecs in found.items()]
    return table(("sequence", *heads_of(found)), rows)


def curves() -> dict[str, dict[str, Points]]:
    """Points by sequence and codec, of all files of ``curves``."""
    return points_by([curve for report in curve_reports() for curve in report.curves])


def curve_reports() -> list[BenchReport]:
    """What ``tools/measure_curves.py`` wrote."""
    return [BenchReport.read(path) for path in curve_files()]


def curve_files() -> list[Path]:
    """The results that ``tools/measure_curves.py`` wrote."""
    return sorted((DOCS / "benchmarks" / "curves").glob("*.json"))


def curves_plot() -> list[str]:
    """The element that ``docs/curves.js`` fills, with the addresses of its results on the site."""
    files = [path.relative_to(DOCS).as_posix() for path in curve_files()]
    text = "The plot is on the site of this documentation. Elsewhere the pictures below have the curves."
    return [
        f'<div id="curves" data-files="{" ".join(files)}">{text}</div>',
        '<script type="module" src="../curves.js"></script>',
    ]


def rates_at_bound() -> list[str]:
    """Rates at a bound on every vertex, and the three best of other compressors."""
    results = load(BOUND)
    rows, logarithms = [], []
    for sequence, codecs in curves_of(results).items():
        rates = {codec: points[0]["bpvf"] for codec, points in codecs.items()}
        peers = sorted(results["peers"][sequence].items(), key=lambda item: item[1])[:3]
        part = min(rates.values()) / peers[0][1]
        logarithms.append(math.log(part))
        others = ", ".join(f"{name} {rate:.2f}" for name, rate in peers)
        rows.append((sequence, *(f"{rate:.3f}" for rate in rates.values()), others, f"{100 * part:.0f} %"))
    mean = math.exp(sum(logarithms) / len(logarithms))
    heads = ("sequence", *heads_of(curves_of(results)), "others, best first", "best of ours to best of others")
    return table(heads, [*rows, ("geometric mean", *"---", f"{100 * mean:.0f} %")])


def scale_report() -> ScaleReport:
    """The scale reports of all codecs as one."""
    reports = [ScaleReport.read(DOCS / "benchmarks" / "scale" / f"{name}.json") for name in SCALES]
    points = [point for report in reports for point in report.scale]
    return ScaleReport(reports[0].gvpipe, reports[0].machine, reports[0].command, points)


def growth() -> list[str]:
    """For each codec, how time grows in either row, and what the largest size takes."""
    heads = ["codec", "row", "largest size"]
    heads += [f"{name}, s" for name in COSTS.values()] + [f"{name}, exponents" for name in COSTS.values()]
    heads += [f"{name}, million vertex-frames a second" for name in COSTS.values()]
    rows = []
    for grows in ("vertices", "frames"):
        row = row_of(scale_report().scale, grows)
        for codec in dict.fromkeys(point.codec for point in row):
            own = [point for point in row if point.codec == codec and point.encode_cpu_s]
            own = [point for point in own if grows == "vertices" or point.frames != FEW_FRAMES]  # that one is of the other row
            last = own[-1]
            powers = (", ".join(f"{power:.2f}" for power in exponents(own, key)) for key in COSTS)
            lines = (_spell_line(own, key.replace("_cpu", "")) for key in COSTS)
            rates = (number(rate_of(last, key), ".2f") for key in COSTS)
            rows.append((name_of(codec), grows, f"{last.vertices:,} x {last.frames:,}", *lines, *powers, *rates))
    return table(heads, rows)


def _spell_line(points: list[ScalePoint], key: str) -> str:
    """The time of a row as what is fixed, and what a million vertex-frames add."""
    line = fit_line(points, key)
    return f"{line.fixed:.2f} + {1e6 * line.slope:.2f} n, within {line.factor:.2f}" if line else "-"


def memory() -> list[str]:
    """Peak memory at the largest sizes, beside 300 MB and six times the longest segment."""
    heads = ("codec", "vertices x frames", "segment, frames", "encode, MB", "decode, MB", "300 MB + 6 x segment")
    rows = []
    for grows in ("vertices", "frames"):
        row = row_of(scale_report().scale, grows)
        for codec in dict.fromkeys(point.codec for point in row):
            last = [point for point in row if point.codec == codec and point.encode_peak_mb][-1]
            size = f"{last.vertices:,} x {last.frames:,}"
            peaks = (number(last.encode_peak_mb, ",.0f"), number(last.decode_peak_mb, ",.0f"))
            rows.append((name_of(codec), size, f"{last.segment_frames}", *peaks, f"{300 + 6 * last.segment_mb:,.0f}"))
    return table(heads, rows)


def rate_of(point: ScalePoint, key: str) -> float | None:
    """Million vertex-frames a second of processor time."""
    seconds = getattr(point, key)
    return point.vertices * point.frames / 1e6 / seconds if seconds else None


def plan() -> list[str]:
    """What a million short sequences and a capture of ten hours come to, by the rates of real sequences."""
    results = load("scale/plan")["results"]
    rows = []
    for what, kind, count in (
        ("10^6 sequences of 16 frames, as the ten", "short", 1e6 / len(results)),
        ("10 hours, 20,000 vertices, 30 frames a second", "whole", 0.0),
    ):
        own = [result[kind] for result in results]
        times = count or CAPTURE[0] * CAPTURE[1] / sum(one["vertices"] * one["frames"] for one in own)
        raw = 12 * times * sum(one["vertices"] * one["frames"] for one in own)
        hours = [times * sum(one[key] for one in own) / 3600 for key in COSTS]
        size = times * sum(one["bytes"] for one in own)
        rows.append((what, f"{raw / 1e9:,.0f} GB", f"{size / 1e9:.2f} GB", *(f"{hour:,.1f}" for hour in hours)))
    return table(("what", "float32", "files", "encode, core hours", "decode, core hours"), rows)


def cluster() -> list[str]:
    """Seconds of each way to encode a sequence, and whether its bytes are the first one's."""
    rows = [
        (run["what"], f"{run['seconds']:.1f}", f"{run['cpu_seconds']:.1f}", "yes" if run["same_bytes"] else "no")
        for run in load("scale/cluster")["runs"]
    ]
    return table(("run", "seconds", "processor time, s", "same bytes"), rows)


def reproduced(paper: str) -> list[str]:
    """The claims of a paper, and what was measured."""
    return reproduction_table(load("reproduction/reproduction")["papers"][paper]).splitlines()


def reproduced_states() -> list[str]:
    """How many claims of each paper hold."""
    rows = []
    for paper, claims in load("reproduction/reproduction")["papers"].items():
        states = [claim["state"] for claim in claims]
        rows.append((f"`{paper}`", str(len(states)), *(str(states.count(state)) for state in (HOLDS, FAILS, NOT_RUN))))
    return table(("paper", "claims", HOLDS, FAILS, NOT_RUN), rows)


def baselines() -> list[str]:
    """Bytes, rates and errors of all codecs at one quality."""
    rows = []
    for curve in BenchReport.read(DOCS / "benchmarks" / "reproduction" / "curves.json").curves:
        if curve.codec in SYSTEMS:
            point = min(curve.points, key=lambda one: abs(one["quality"] - 75))
            if point["quality"] != 75:
                continue
            cells = (f"{point['bytes']}", f"{point['bpvf']:.3f}", f"{point['kg']:.3f}", number(point["sted"], ".4f"))
            rows.append((curve.sequence, curve.codec, *cells))
    rows.sort(key=lambda row: (row[0], float(row[3])))
    return table(("sequence", "codec", "bytes", "bpvf", "KG", "STED"), [(row[0], f"`{row[1]}`", *row[2:]) for row in rows])


def name_of(codec: str) -> str:
    """A codec's name in tables."""
    return NAMES.get(codec, f"`{codec}`")


TABLES: dict[str, Callable[[], list[str]]] = {
    "default-against-published": default_against_published,
    "errors-at-quality-75": errors_at_quality,
    "rates-at-bound": rates_at_bound,
    "curves-plot": curves_plot,
    "curves-leaders": lambda: leaders(curves(), ANCHOR, MEASURED),
    "curves-rates-kg-1": lambda: rates(curves(), ANCHOR, "kg", 1.0),
    "curves-rates-kg-0.1": lambda: rates(curves(), ANCHOR, "kg", 0.1),
    "curves-differences-kg": lambda: differences(curves(), ANCHOR, "kg"),
    "curves-differences-sted": lambda: differences(curves(), ANCHOR, "sted"),
    "curves-matrix-kg": lambda: matrix(curves(), ANCHOR, "kg"),
    "reproduction-states": reproduced_states,
    "reproduction-mcgv": lambda: reproduced("mcgv"),
    "reproduction-pca": lambda: reproduced("pca"),
    "reproduction-laplacian": lambda: reproduced("laplacian"),
    "reproduction-pdct": lambda: reproduced("pdct"),
    "reproduction-baselines": lambda: reproduced("baselines"),
    "reproduction-systems": baselines,
    "scale-growth": growth,
    "scale-memory": memory,
    "scale-points": lambda: scale_table(scale_report().scale).splitlines(),
    "scale-cluster": cluster,
    "scale-plan": plan,
}


def heads_of(found: dict[str, dict[str, Points]]) -> list[str]:
    """Column heads of the codecs."""
    return [name_of(codec) for codec in next(iter(found.values()))]


def number(value: float | None, form: str, unit: str = "") -> str:
    """A number as text, "-" where there is none."""
    return "-" if value is None else f"{value:{form}}{unit}"


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [f"| {' | '.join(cells)} |" for cells in (heads, *rows)]
    return [lines[0], "|---" * (lines[0].count(" | ") + 1) + "|", *lines[1:]]


def fill(page: str) -> str:
    """A page with its tables made anew."""
    return MARKED.sub(lambda found: "\n".join((found[1].rstrip(), *TABLES[found[2]](), found[3])), page)


def main() -> None:
    """Write the tables, or print the points of a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    points = commands.add_parser("points", help="print every point of a file of results")
    points.add_argument("file", metavar="FILE.json")
    commands.add_parser("plots", help="draw the pictures of docs/scale.md and docs/curves.md")
    options = parser.parse_args()
    if options.command == "points":
        print(tables(BenchReport.read(options.file).curves))
        return
    if options.command == "plots":
        draw(scale_report(), DOCS / "plots")
        for report in curve_reports():
            draw_curves(report, DOCS / "plots")
        return
    for page in PAGES:
        page.write_text(fill(page.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
