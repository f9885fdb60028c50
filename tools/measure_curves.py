"""Measures all codecs and baselines at eight qualities, one file of results per sequence, in as many runs as it takes.

    python tools/measure_curves.py ../sequences/fox_run.npz ../sequences/cow.npz
    python tools/measure_curves.py ../sequences/*.npz --own --again --jobs 2     # gvpipe's codecs; baselines stay as they are
    python tools/measure_curves.py ../sequences/cow.npz --codecs pca,famc --again
    python tools/benchmark_tables.py                                             # tables of docs/curves.md
    python tools/benchmark_tables.py plots                                       # and its pictures

A file is ``docs/benchmarks/curves/NAME.json``, of the shape that `gvpipe bench --json` writes, rounded and without sections.
Each curve has the commit it was measured at. A curve that the file has already is not measured again, so that an interrupted
run goes on where it was; with ``--again`` one of another commit is. A codec that cannot code a sequence has no curve: its
message is kept under ``refused``. All runs at low priority.

Each point is an encode by itself. Encodes that share what does not depend on quality (`gvpipe.coding.codec.Memo`) take a fifth
to two thirds less time, but other bytes: each begins where the one before ended.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gvpipe.benchmark import sweep
from gvpipe.coding.registry import codec_class
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import GvpipeError
from gvpipe.tasks.executor import WorkerDied

FOLDER = Path(__file__).parents[1] / "docs" / "benchmarks" / "curves"
QUALITIES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 100.0)
MORE = (
    "pca:predictor=rbf",
    "dynapack:predictor=replica",
    "dynapack:predictor=space",  # stands for Touma and Gotsman frame by frame
)  # settings beside those of `gvpipe bench`
LIBRARIES = ("numpy", "scipy", "av", "DracoPy")
DIGITS = 5
LEFT_OUT = ("sections",)  # of points
OWN = "gvcodecs"  # package of gvpipe's codecs
PRIORITY = 10  # added to this process' niceness
WRITING = threading.Lock()  # of files of results


def measure(source: Path, codec: str, again: bool, until: float = float("inf")) -> None:
    """Measure a curve if the sequence's file of results lacks it and it is not later than ``until``, and write it there."""
    path, now = FOLDER / f"{source.stem}.json", commit()
    if time.monotonic() > until or not is_wanted(read(path), codec, now if again else None):
        return
    print(source.stem, codec, flush=True)
    curve, refused, made = None, None, None
    try:
        made = sweep.run([str(source)], [codec], QUALITIES)
    except GvpipeError as exc:
        if isinstance(exc.__cause__, WorkerDied):
            raise
        refused = str(exc).replace(str(source), source.name)
    else:
        curve = {**dataclasses.asdict(made.curves[0]), "commit": now}
        curve["points"] = [rounded(point) for point in curve["points"]]
    with WRITING:
        known = read(path)  # with what others measured meanwhile
        known["curves"] = [one for one in known["curves"] if one["codec"] != codec]
        known["refused"].pop(codec, None)
        if curve is None or made is None:
            known["refused"][codec] = refused
        else:
            known["curves"] = sorted([*known["curves"], curve], key=lambda one: str(one["codec"]))
            machine = {**made.machine, **{name: version(name) for name in LIBRARIES}}
            known = {**known, "gvpipe": made.gvpipe, "machine": machine, "command": command(source), "curves": known["curves"]}
        write(path, known)


def read(path: Path) -> dict[str, Any]:
    """A file of results, or an empty one."""
    values: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.is_file() else {"refused": {}, "curves": []}
    return values


def is_wanted(known: dict[str, Any], codec: str, commit: str | None) -> bool:
    """Whether results lack a codec's curve, or, given a commit, have one of another."""
    if codec in known["refused"]:
        return commit is not None
    curve = next((one for one in known["curves"] if one["codec"] == codec), None)
    return curve is None or (commit is not None and curve.get("commit") != commit)


def is_own(codec: str) -> bool:
    """Whether a codec is gvpipe's, and no baseline."""
    return codec_class(codec.split(":")[0]).__module__.split(".")[0] == OWN


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
    parser.add_argument("--own", action="store_true", help="gvpipe's codecs alone: no baselines")
    parser.add_argument("--again", action="store_true", help="measure curves of other commits anew")
    parser.add_argument("--jobs", metavar="N", type=int, default=1, help="curves at once, 1 unless given")
    parser.add_argument("--minutes", metavar="N", type=float, default=float("inf"), help="begin no curve after so long")
    options = parser.parse_args()
    codecs = options.codecs.split(",") if options.codecs else [*sweep.default_codecs(), *MORE]
    codecs = [codec for codec in codecs if is_own(codec) or not options.own]
    if hasattr(os, "nice"):
        os.nice(PRIORITY)
    until = time.monotonic() + 60 * options.minutes
    with ThreadPoolExecutor(options.jobs) as executor:
        made = [
            executor.submit(measure, source, codec, options.again, until) for source in options.sequences for codec in codecs
        ]
        for one in made:
            one.result()


if __name__ == "__main__":
    main()
