"""Files at default settings, for docs/benchmarks.md: all codecs at quality 75, and with a bound on every vertex.

    python tools/measure_defaults.py ../shared/data/*.npz --json docs/benchmarks/quality-75.json
    python tools/measure_defaults.py ../shared/data/*.npz --max-error 0.1% --json docs/benchmarks/bound-0.1-percent.json

Every file is decoded and compared with its source. A file of results that is there keeps what was measured by other means, such
as rates of other compressors. ``tools/benchmark_tables.py`` makes the tables.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import gvpipe
from gvpipe.benchmark.sweep import describe_machine
from gvpipe.sequence import MeshSequence

QUALITY = 75
TARGET_KG = 0.1
CODECS = ("mcgv", "mcgv:prediction=affine", "pca", "laplacian", "pdct")
BOUND_CODECS = ("pca", "mcgv")
COMMAND = ["gvpipe", "encode", "NAME.npz", "x.mp4", "--codec", "CODEC"]


def main() -> None:
    """Measure, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=Path)
    parser.add_argument("--max-error", metavar="BOUND", help="of each vertex, in place of quality 75")
    parser.add_argument("--json", type=Path, metavar="OUT.json")
    given = parser.parse_args()
    found = json.loads(given.json.read_text()) if given.json and given.json.exists() else {}
    found.pop("note", None)
    order = [curve["sequence"] for curve in found.get("curves", [])]  # of the tables
    curves: list[dict[str, Any]] = []
    targets: list[dict[str, Any]] = []
    for path in sorted(
        given.sequences, key=lambda path: (order.index(path.stem) if path.stem in order else len(order), path.stem)
    ):
        sequence = gvpipe.read(path)
        for codec in BOUND_CODECS if given.max_error else CODECS:
            curves.append(measure(path.stem, sequence, codec, given.max_error))
            print(json.dumps(curves[-1]), flush=True)
        if not given.max_error:
            targets.append(aim(path.stem, sequence))
    command = [*COMMAND, "--max-error", given.max_error] if given.max_error else COMMAND
    formats: dict[str, int] = {}  # the newest that a file needs
    for curve in curves:
        codec, version = curve["codec"].partition(":")[0], curve.pop("version")
        formats[codec] = max(version, formats.get(codec, 0))
    found |= {
        "gvpipe": gvpipe.__version__,
        "formats": formats,
        "machine": describe_machine(),
        "command": command,
        "curves": curves,
    }
    found |= {"targets": targets} if targets else {}
    if given.json:
        given.json.write_text(json.dumps(found, indent=1) + "\n")


def measure(name: str, sequence: MeshSequence, codec: str, max_error: str | None) -> dict[str, Any]:
    """The file of one codec: its bytes and errors, and seconds of the wall clock."""
    identity, _, setting = codec.partition(":")
    settings: dict[str, Any] = dict([setting.split("=")]) if setting else {}
    aims: dict[str, Any] = {"max_error": max_error} if max_error else {"quality": QUALITY}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mp4")
        started = time.perf_counter()
        made = gvpipe.encode(sequence, path, identity, **aims, **settings)
        encoded = time.perf_counter()
        decoded = gvpipe.decode(path)
        seconds = time.perf_counter() - encoded
        version = gvpipe.info(path).version
    measured = gvpipe.compare(sequence, decoded)
    point = {
        "quality": None if max_error else QUALITY,
        "bytes": made.bytes,
        "bpvf": round(made.bpvf, 4),
        "kg": None if measured.kg is None else round(measured.kg, 4),
        "rmse_diag": measured.rmse_diag,
        "max_diag": measured.max_diag,
        "sted": None,
        "encode_s": round(encoded - started, 2),
        "decode_fps": round(sequence.n_frames / seconds, 1),
    }
    return {
        "sequence": name,
        "vertices": sequence.n_vertices,
        "triangles": len(sequence.faces),
        "frames": sequence.n_frames,
        "codec": codec,
        "version": version,
        "settings": settings,
        "peak_mb": None,
        "points": [point],
    }


def aim(name: str, sequence: MeshSequence) -> dict[str, Any]:
    """The rate of the default codec at `TARGET_KG`, and how many encodes found it."""
    with tempfile.TemporaryDirectory() as folder:
        made = gvpipe.encode(sequence, Path(folder, "a.mp4"), "mcgv", target_kg=TARGET_KG)
    return {"sequence": name, "codec": "mcgv", "kg": TARGET_KG, "bpvf": round(made.bpvf, 3), "encodes": len(made.tried)}


if __name__ == "__main__":
    main()
