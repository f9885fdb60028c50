"""How long reading takes from the start of Python to its end, beside the libraries themselves; how long writing takes.

    python tools/measure_formats.py ../shared/data [--only abc] [--repeats 5] [--markdown]

Reading: each asset in a new Python that imports gvpipe, and in one that imports the format's own library alone
(`library_readers.py`). Both read every frame. They take turns, and the medians of `--repeats` turns count: seconds of the
processor with those of processes that are started, and seconds of the clock. Byte code is cached, as in an installation.
Writing: `samba.npz` as `.glb`, `.usdc` and `.abc`, in this process.

Status 1: reading takes more than twice the library's own time of the processor, or writing more than 3 s.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from library_readers import READERS, reader_of

import gvpipe

TIMES, LONGEST = 2.0, 3.0  # of the library's own reading; seconds of writing
SEQUENCES = "objseq", "plyseq"  # kinds of assets that are a folder of frames
FRAMES = (".obj", ".ply", ".vtu", ".vtp", ".vts")  # that belong to such a folder, or to a list
OTHERS = (".e", ".exo", ".pvd", ".case")  # that one library or none reads
OURS = """
import sys, gvpipe
sequence = gvpipe.read(sys.argv[1])
for _ in sequence.chunks():
    pass
for field in sequence.fields.values():
    field.read(0, len(field))
"""
THEIRS = "import sys, library_readers; library_readers.{}(sys.argv[1])"


class Spent(NamedTuple):
    """Seconds of a process and those that it starts."""

    processor: float
    clock: float


class Row(NamedTuple):
    """What was measured of a file; of one that no library reads, ``own`` is None."""

    file: str
    library: str
    own: Spent | None
    ours: Spent

    @property
    def is_slow(self) -> bool:
        """Whether reading misses its budget."""
        return self.own is not None and self.ours.processor > TIMES * self.own.processor

    def cells(self) -> list[str]:
        """Name, library, then both times and their ratio, of the processor and of the clock."""
        cells = [self.file, self.library]
        for number, ours in enumerate(self.ours):
            own = None if self.own is None else self.own[number]
            cells += ["-", f"{ours:.2f}", "-"] if own is None else [f"{own:.2f}", f"{ours:.2f}", f"{ours / own:.2f}"]
        return cells


def main() -> int:
    """Measure the assets of the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with assets/ and samba.npz")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--repeats", type=int, default=5, help="readings of each file [default: 5]")
    parser.add_argument("--markdown", action="store_true", help="print tables for the documentation")
    given = parser.parse_args()
    if given.markdown:
        print("| file | library | its processor s | gvpipe's | ratio | its clock s | gvpipe's | ratio |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for row in read_rows(given.folder, given.only, given.repeats):
        text = "| " + " | ".join(row.cells()) + " |" if given.markdown else "  ".join(row.cells())
        print(text + ("  too slow" if row.is_slow and not given.markdown else ""), flush=True)
        rows.append(row)
    summarise(rows)
    n_slow = sum(row.is_slow for row in rows)
    for name, spent in written(given.folder, given.only, given.repeats):
        print(f"{name}, written: {spent:.2f} s of the processor", flush=True)
        n_slow += spent > LONGEST
    return int(n_slow > 0)


def summarise(rows: list[Row]) -> None:
    """Print median and largest ratio of each library."""
    for library in sorted({row.library for row in rows if row.own}):
        for kind, name in enumerate(Spent._fields):
            ratios = [row.ours[kind] / row.own[kind] for row in rows if row.library == library and row.own]
            print(f"{library}, {name}: {len(ratios)} files, median {statistics.median(ratios):.2f}, most {max(ratios):.2f}")


def read_rows(folder: Path, only: str, repeats: int) -> Iterator[Row]:
    """Yield a row for each asset that is read, then for samba in other formats."""
    with tempfile.TemporaryDirectory() as cache:
        for path in find_assets(folder / "assets"):
            name = path.relative_to(folder / "assets").as_posix()
            if only in name:
                yield from compared(name, path, repeats, cache)
        for suffix in ("usdc", "abc", "vtkhdf", "glb"):
            name, path = f"samba as .{suffix}", Path(cache, f"samba.{suffix}")
            if only in name:
                gvpipe.write(gvpipe.read(folder / "samba.npz"), path)
                yield from compared(name, path, repeats, cache)


def find_assets(folder: Path) -> Iterator[Path]:
    """Yield files that are a whole asset, and folders of frames."""
    for path in sorted(folder.rglob("*")):
        is_file = path.suffix in (*READERS, *OTHERS) and path.suffix not in FRAMES
        if is_file or path.parent.name in SEQUENCES:
            yield path


def compared(name: str, path: Path, repeats: int, cache: str) -> Iterator[Row]:
    """Yield the row of an asset, unless gvpipe refuses it."""
    found = reader_of(path)
    ours, own = partial(run, OURS, path, cache), None
    if found is not None:
        own = partial(run, THEIRS.format(found[1].__name__), path, cache)
    if ours() is None:  # a first run of each fills the cache
        return
    own = None if own is None or own() is None else own
    spent: dict[bool, list[Spent]] = {True: [], False: []}
    for _ in range(repeats):
        for is_ours, work in ((False, own), (True, ours)):
            one = None if work is None else work()
            if one is not None:
                spent[is_ours].append(one)
    yield Row(name, found[0] if found and own else "-", middle(spent[False]) if own else None, middle(spent[True]))


def middle(spent: list[Spent]) -> Spent:
    """The medians of processor and clock."""
    return Spent(*map(statistics.median, zip(*spent, strict=True)))


def run(code: str, path: Path, cache: str) -> Spent | None:
    """What a new Python spends on some code, with a path as its argument; None if it fails."""
    folders = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = {**os.environ, "PYTHONPATH": folders, "PYTHONPYCACHEPREFIX": cache}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    before, started = os.times(), time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code, str(path)], stderr=subprocess.DEVNULL, env=environment)
    clock, after = time.perf_counter() - started, os.times()
    below = after.children_user + after.children_system - before.children_user - before.children_system
    return None if done.returncode else Spent(below, clock)


def written(folder: Path, only: str, repeats: int) -> Iterator[tuple[str, float]]:
    """Yield formats and the least seconds of the processor that writing samba takes."""
    samba = gvpipe.read(folder / "samba.npz")
    samba.read(0, 1)
    with tempfile.TemporaryDirectory() as place:
        for suffix in ("glb", "usdc", "abc"):
            name = f"samba.{suffix}"
            if only in name:
                yield name, min(seconds(partial(gvpipe.write, samba, Path(place, f"a.{suffix}"))) for _ in range(repeats))


def seconds(work: Callable[[], Any]) -> float:
    """Seconds of the processor that some work takes in this process."""
    started = time.process_time()
    work()
    return time.process_time() - started


if __name__ == "__main__":
    sys.exit(main())
