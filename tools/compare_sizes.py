"""Sizes of files at one error, beside those of the last release; the status is 1 where one is more than 2 % larger.

    python tools/compare_sizes.py                                       # the repository's own samples
    python tools/compare_sizes.py --data FOLDER --json sizes.json       # and every .npz file of a folder
    python tools/compare_sizes.py --data FOLDER --codec pca --sequence cow --sequence fox_run
    python tools/compare_sizes.py --data FOLDER --release               # after a release: these are the sizes to compare with

Each codec codes each sequence with ``--target-kg 0.1``, as ``gvpipe encode`` does. docs/benchmarks.md says where the ten
sequences come from; without ``--data`` they are left out. A row that the last release has no size for never fails.
``docs/benchmarks/sizes.json`` holds the sizes of the last release: figures alone.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import gvpipe
from gvpipe.benchmark.json_results import write_results
from gvpipe.benchmark.sweep import describe_machine, settings_of
from gvpipe.foundation.errors import GvpipeError

ROOT = Path(__file__).parents[1]
RELEASED = ROOT / "docs" / "benchmarks" / "sizes.json"
CODECS = ("mcgv", "mcgv:transform=klt", "pca", "laplacian", "pdct")
TARGET_KG = 0.1
ANY_QUALITY = 75.0  # the error decides
TOLERANCE = 0.02  # of the last release's bytes
WITHOUT_DATA = "Without --data FOLDER only samples are measured; docs/benchmarks.md says where the ten sequences come from."

Row = dict[str, Any]  # sequence, codec, bytes, bpvf, kg, seconds


def main() -> int:
    """Encode, print a row for each file, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="of .npz files, beside the repository's samples")
    parser.add_argument("--codec", action="append", choices=CODECS, help="this codec alone; may be given again")
    parser.add_argument("--sequence", action="append", metavar="NAME", help="this sequence alone; may be given again")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="encodes at once, in processes (default: 1)")
    parser.add_argument(
        "--against", type=Path, default=RELEASED, metavar="SIZES.json", help="default: the last release's sizes"
    )
    parser.add_argument("--json", type=Path, metavar="OUT.json", help="write what was measured")
    parser.add_argument("--release", action="store_true", help="put what was measured among the last release's sizes")
    given = parser.parse_args()
    paths = find_sequences(given.data, given.sequence)
    if not paths:
        parser.error(f"there is no such sequence. {WITHOUT_DATA}")
    if not given.data:
        print(WITHOUT_DATA, file=sys.stderr)
    released = read_rows(given.against)
    rows = []
    for row in measure(paths, given.codec or CODECS, given.jobs):
        rows.append(row)
        print(line_of(row, released), flush=True)
    if given.json:
        write_results(given.json, report(rows))
    if given.release:
        write_results(RELEASED, report([*merged(read_rows(RELEASED), rows).values()]))
    grown = find_grown(rows, released)
    print(f"{len(grown)} of {len(rows)} files grew by more than {TOLERANCE:.0%}: {', '.join(grown) or 'none'}")
    return 1 if grown else 0


def find_sequences(folder: Path | None, names: Sequence[str] | None) -> list[Path]:
    """The samples' archives and those of a folder, of the given names if there are any."""
    paths = [*sorted((ROOT / "samples").glob("*.npz")), *(sorted(folder.glob("*.npz")) if folder else [])]
    return [path for path in paths if not names or path.stem in names]


def measure(paths: Sequence[Path], codecs: Sequence[str], n_jobs: int) -> Iterator[Row]:
    """Yield a row for each sequence and codec, in this order."""
    tasks = [(path, codec) for path in paths for codec in codecs]
    if n_jobs == 1:
        yield from (encode(*task) for task in tasks)
        return
    with ProcessPoolExecutor(n_jobs) as pool:
        yield from pool.map(encode, *zip(*tasks, strict=True))


def encode(path: Path, codec: str) -> Row:
    """One file: its sequence, codec (``id`` or ``id:key=value``), bytes, rate, error and the seconds that it took."""
    (settings,) = settings_of(codec, [ANY_QUALITY], {})
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = gvpipe.encode(path, Path(folder, "a.mp4"), settings, target_kg=TARGET_KG)
        except GvpipeError as exc:  # a codec that does not take a sequence, or cannot reach the error
            return {"sequence": path.stem, "codec": codec, "bytes": None, "reason": str(exc)}
    seconds = time.perf_counter() - begun
    figures = {"bytes": made.bytes, "bpvf": round(made.bpvf, 4), "kg": round(made.errors["kg"] or 0.0, 4)}
    return {"sequence": path.stem, "codec": codec, **figures, "seconds": round(seconds, 1)}


def read_rows(path: Path) -> list[Row]:
    """The rows of a file that this tool wrote; none where there is no file."""
    return list(json.loads(path.read_text("utf-8"))["sizes"]) if path.exists() else []


def report(rows: Sequence[Row]) -> Mapping[str, Any]:
    """What is written: the rows, and what made them."""
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "HEAD"], capture_output=True, text=True)
    commit = done.stdout.strip() or None
    head = {"gvpipe": gvpipe.__version__, "commit": commit, "machine": describe_machine(), "target_kg": TARGET_KG}
    return {**head, "sizes": list(rows)}


def merged(old: Sequence[Row], new: Sequence[Row]) -> dict[tuple[str, str], Row]:
    """Rows by sequence and codec; a new one takes the place of an old one."""
    return {(row["sequence"], row["codec"]): row for row in (*old, *new)}


def change(row: Row, released: Sequence[Row]) -> float | None:
    """By what part a file is larger than the last release's; infinite where it is no longer made; None: nothing to compare."""
    before = merged(released, []).get((row["sequence"], row["codec"]))
    if before is None or not before["bytes"]:
        return None
    return round(row["bytes"] / before["bytes"] - 1, 9) if row["bytes"] else float("inf")


def find_grown(rows: Sequence[Row], released: Sequence[Row]) -> list[str]:
    """Sequences and codecs whose files are larger by more than `TOLERANCE`."""
    return [f"{row['sequence']} {row['codec']}" for row in rows if (change(row, released) or 0) > TOLERANCE]


def line_of(row: Row, released: Sequence[Row]) -> str:
    """A row as text."""
    difference = change(row, released)
    name = f"{row['sequence']:16} {row['codec']:18}"
    if not row["bytes"]:
        return f"{name} {'no file: ' + row['reason']}"
    beside = "no size to compare with" if difference is None else f"{difference:+.1%}"
    return f"{name} {row['bytes']:>9} bytes {row['bpvf']:8.3f} bpvf, KG {row['kg']:.4f}, {row['seconds']:.1f} s, {beside}"


if __name__ == "__main__":
    sys.exit(main())
