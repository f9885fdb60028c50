"""What many short sequences, or a very long one, take: processor time and bytes of real sequences, as rates.

    python tools/measure_plan.py ../shared/data/*.npz --json docs/benchmarks/scale/plan.json

Each sequence is encoded by codec ``pca`` with ``max_error="0.1%"`` and decoded, in one process: its first 16 frames in the bare
layout, as for data sets, and the whole of it. ``tools/benchmark_tables.py`` makes the plan of docs/scale.md of the rates.
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
from gvpipe.model.sequence import MeshSequence

N_FRAMES = 16
MAX_ERROR = "0.1%"
CODEC = "pca"


def main() -> None:
    """Measure, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=Path)
    parser.add_argument("--json", type=Path, metavar="OUT.json")
    given = parser.parse_args()
    results = []
    for path in sorted(given.sequences):
        sequence = gvpipe.read(path)
        short = sequence.part(0, min(N_FRAMES, sequence.n_frames))
        measure(short, bare=True)  # compiles
        results.append({"sequence": path.stem, "short": measure(short, bare=True), "whole": measure(sequence, bare=False)})
        print(json.dumps(results[-1]), flush=True)
    found = {"gvpipe": gvpipe.__version__, "machine": describe_machine(), "codec": CODEC, "max_error": MAX_ERROR}
    if given.json:
        given.json.write_text(json.dumps({**found, "results": results}, indent=1) + "\n")


def measure(sequence: MeshSequence, bare: bool) -> dict[str, Any]:
    """Bytes, and seconds of processor time to encode and to decode."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mp4")
        started = time.process_time()
        made = gvpipe.encode(sequence, path, CODEC, max_error=MAX_ERROR, bare=bare)
        encoded = time.process_time()
        gvpipe.decode(path).read(0, sequence.n_frames)
        decoded = time.process_time()
    return {
        "vertices": sequence.n_vertices,
        "frames": sequence.n_frames,
        "bytes": made.bytes,
        "encode_cpu_s": round(encoded - started, 3),
        "decode_cpu_s": round(decoded - encoded, 3),
    }


if __name__ == "__main__":
    main()
