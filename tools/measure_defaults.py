"""Files at default settings, for docs/benchmarks.md: all codecs at quality 75, and with a bound on every vertex.

    python tools/measure_defaults.py ../shared/data/*.npz --json docs/benchmarks/quality-75.json
    python tools/measure_defaults.py ../shared/data/*.npz --max-error 0.1% --json docs/benchmarks/bound-0.1-percent.json

Every file is decoded and compared with its source. A file of results that is there keeps what was measured by other means, such
as rates of other compressors, and its order of sequences. ``tools/benchmark_tables.py`` makes the tables.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import gvpipe
from gvpipe.benchmark.json_results import write_results
from gvpipe.benchmark.report import POINT_KEYS, BenchReport, Curve
from gvpipe.benchmark.sweep import MEASURES, describe_machine

QUALITY = 75.0
TARGET_KG = 0.1
CODECS = ("mcgv", "mcgv:prediction=affine", "pca", "laplacian", "pdct")
BOUND_CODECS = ("pca", "mcgv")
COMMAND = ["python", "tools/measure_defaults.py", "*.npz"]  # without folders, which are a machine's own


def main() -> None:
    """Measure, and write or print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=Path)
    parser.add_argument("--max-error", metavar="BOUND", help="of each vertex, in place of quality 75")
    parser.add_argument("--json", type=Path, metavar="OUT.json")
    given = parser.parse_args()
    found = json.loads(given.json.read_text("utf-8")) if given.json and given.json.exists() else {}
    order = list(dict.fromkeys(curve["sequence"] for curve in found.get("curves", [])))
    paths = sorted(given.sequences, key=lambda path: (order.index(path.stem) if path.stem in order else len(order), path.stem))
    aims, codecs = ({"max_error": given.max_error}, BOUND_CODECS) if given.max_error else ({"quality": QUALITY}, CODECS)
    curves = [measure(path, codec, aims) for path in paths for codec in codecs]
    command = [*COMMAND, "--max-error", given.max_error] if given.max_error else COMMAND
    found |= BenchReport(gvpipe.__version__, describe_machine(), command, curves).to_json()
    if not given.max_error:
        found["targets"] = [aim(path) for path in paths]
    if given.json:
        write_results(given.json, found)
    else:
        print(json.dumps(found, indent=1))


def measure(path: Path, codec: str, aims: dict[str, Any]) -> Curve:
    """The file of one codec, ``id`` or ``id:key=value``, made with a quality or a bound: its bytes and errors."""
    sequence = gvpipe.read(path)
    identity, *pairs = codec.split(":")
    settings = {**aims, **dict(pair.split("=") for pair in pairs)}
    with tempfile.TemporaryDirectory() as folder:
        made = gvpipe.encode(sequence, Path(folder, "a.mp4"), identity, **settings)
        errors = gvpipe.compare(sequence, gvpipe.decode(Path(folder, "a.mp4"))).to_json()
    found = {key: errors[key] for key in MEASURES} | {"quality": aims.get("quality"), "bytes": made.bytes, "bpvf": made.bpvf}
    shape = (sequence.n_vertices, len(sequence.faces), sequence.n_frames)
    return Curve(path.stem, *shape, codec, settings, None, [dict.fromkeys(POINT_KEYS) | found])


def aim(path: Path) -> dict[str, Any]:
    """The rate of the default codec at `TARGET_KG`, and how many encodes found it."""
    with tempfile.TemporaryDirectory() as folder:
        made = gvpipe.encode(path, Path(folder, "a.mp4"), "mcgv", target_kg=TARGET_KG)
    return {"sequence": path.stem, "codec": "mcgv", "kg": TARGET_KG, "bpvf": round(made.bpvf, 3), "encodes": len(made.tried)}


if __name__ == "__main__":
    main()
