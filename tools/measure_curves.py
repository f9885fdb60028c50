"""Measures all codecs and baselines at eight qualities, one file of results per sequence, in as many runs as it takes.

    python tools/measure_curves.py ../sequences/fox_run.npz ../sequences/cow.npz
    python tools/measure_curves.py ../sequences/cow.npz --codecs pca,famc --again
    python tools/benchmark_tables.py                                             # tables of docs/curves.md
    python tools/benchmark_tables.py plots                                       # and its pictures

A file is ``docs/benchmarks/curves/NAME.json``, of the shape that `gvpipe bench --json` writes, rounded and without sections.
Each curve has the commit it was measured at. A curve that the file has already is not measured again, so that an interrupted
run goes on where it was. A codec that cannot code a sequence has no curve: its message is kept under ``refused``.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gvpipe.benchmark import sweep
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import GvpipeError
from gvpipe.tasks.executor import WorkerDied

FOLDER = Path(__file__).parents[1] / "docs" / "benchmarks" / "curves"
QUALITIES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 100.0)
MORE = ("pca:predictor=rbf", "dynapack:predictor=replica")  # settings beside those of `gvpipe bench`
LIBRARIES = ("numpy", "scipy", "av", "DracoPy")
DIGITS = 5
LEFT_OUT = ("sections",)  # of points


def measure(source: Path, codecs: list[str], again: bool) -> None:
    """Measure the curves that a sequence's file of results lacks, and write it after each."""
    path = FOLDER / f"{source.stem}.json"
    known = json.loads(path.read_text("utf-8")) if path.is_file() else {"curves": [], "refused": {}}
    for codec in codecs:
        if not again and (codec in known["refused"] or any(curve["codec"] == codec for curve in known["curves"])):
            continue
        print(source.stem, codec, flush=True)
        known["refused"].pop(codec, None)
        curves = [curve for curve in known["curves"] if curve["codec"] != codec]
        try:
            made = sweep.run([str(source)], [codec], QUALITIES)
        except GvpipeError as exc:
            if isinstance(exc.__cause__, WorkerDied):
                raise
            message = str(exc).replace(str(source), source.name)
            known = {**known, "curves": curves, "refused": {**known["refused"], codec: message}}
        else:
            curve = {**dataclasses.asdict(made.curves[0]), "commit": commit()}
            curve["points"] = [rounded(point) for point in curve["points"]]
            libraries = {name: version(name) for name in LIBRARIES}
            machine = {**made.machine, **libraries}
            curves = sorted([*curves, curve], key=lambda one: str(one["codec"]))
            known = {**known, "gvpipe": made.gvpipe, "machine": machine, "command": command(source), "curves": curves}
        write(path, known)


def rounded(point: dict[str, Any]) -> dict[str, Any]:
    """A point's values with `DIGITS` significant digits, and so many decimals of its rate."""
    return {
        key: round(value, DIGITS) if key == "bpvf" else float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
        for key, value in point.items()
        if key not in LEFT_OUT
    }


def write(path: Path, values: dict[str, Any]) -> None:
    """Write a file of results, a curve a line."""
    head = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in values.items() if key != "curves")
    lines = ",\n".join(json.dumps(curve, separators=(",", ":"), allow_nan=False) for curve in values["curves"])
    path.parent.mkdir(parents=True, exist_ok=True)
    with unnamed_path(path) as temporary:
        temporary.write_text(f'{{{head},\n"curves": [\n{lines}\n]}}\n', "utf-8")


def command(source: Path) -> list[str]:
    """What makes a file anew."""
    return ["python", "tools/measure_curves.py", source.name]


def commit() -> str:
    """The commit that is measured."""
    found = subprocess.run(
        ["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True, cwd=FOLDER.parent
    )
    return found.stdout.strip()


def main() -> None:
    """Measure what is missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", metavar="NAME.npz", nargs="+", type=Path)
    parser.add_argument("--codecs", metavar="ID,ID...", help="these alone")
    parser.add_argument("--again", action="store_true", help="measure curves anew that the files have")
    options = parser.parse_args()
    codecs = options.codecs.split(",") if options.codecs else [*sweep.default_codecs(), *MORE]
    for source in options.sequences:
        measure(source, codecs, options.again)


if __name__ == "__main__":
    main()
