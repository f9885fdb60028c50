"""Measure data sets of short sequences: where the bytes of a file go, and how many sequences a second a shard gives.

    python tools/measure_datasets.py sizes ../shared/data/*.npz --json docs/benchmarks/datasets/short_sequences.json
    python tools/measure_datasets.py rates --json docs/benchmarks/datasets/shard_rates.json
    python tools/measure_datasets.py tables docs/benchmarks

Sizes: each sequence is cut to 16 frames and encoded by codec ``auto`` in the bare layout, then changed to the plain one.
Rates: sequences of one connectivity, made here, 45 x 45 vertices and 16 frames, are packed and read at random by one process;
seconds are of its processor time.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from gvpipe import datasets
from gvpipe.sequence import MeshSequence

N_FRAMES = 16
MAX_ERROR = "0.1%"
SIDE = 45  # vertices of a side
N_SEQUENCES = 24
SECONDS = 2.0  # of processor time, of a rate
PARTS = {
    "mesh": ("mesh",),
    "order": ("order",),
    "motion": ("still", "weights", "transforms", "charts", "basis", "coefficients", "holds", "deltas", "anchors", "clip"),
    "corrections": ("corrections", "outliers"),
    "video": ("video",),
    "container": ("container",),
}
SETTINGS: dict[str, dict[str, Any]] = {
    "pca": {"codec": "pca"},
    "pca, predictor navg": {"codec": "pca", "predictor": "navg"},
    "mcgv": {"codec": "mcgv"},
    "pdct": {"codec": "pdct"},
}
LEVELS = (2, 5, 100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("sizes", "rates", "tables"):
        command = commands.add_parser(name)
        if name != "rates":
            command.add_argument("paths", nargs="+", type=Path)
        command.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.command == "tables":
        print(*tables(options.paths[0]), sep="\n")
        return
    found: dict[str, Any] = {"gvpipe": gvpipe.__version__, "python": platform.python_version(), "machine": platform.machine()}
    found["results"] = measure_sizes(options.paths) if options.command == "sizes" else measure_rates()
    text = json.dumps(found, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n")


def measure_sizes(paths: list[Path]) -> list[dict[str, Any]]:
    """Bytes of each sequence's first frames, whole and by part, in both layouts."""
    results = []
    with tempfile.TemporaryDirectory() as folder:
        bare, plain = Path(folder, "bare.mp4"), Path(folder, "plain.mp4")
        for path in sorted(paths):
            sequence = gvpipe.read(path)
            sequence = sequence.part(0, min(N_FRAMES, sequence.n_frames))
            report = gvpipe.encode(sequence, bare, "auto", max_error=MAX_ERROR, bare=True)
            error = gvpipe.compare(sequence, gvpipe.read(bare)).max_diag
            changed = gvpipe.restream(bare, plain, "plain")
            results.append(
                {
                    "name": path.stem,
                    "codec": report.codec,
                    "vertices": report.vertices,
                    "frames": report.frames,
                    "float32": 12 * report.vertices * report.frames,
                    "max_diag": error,
                    "bare": report.bytes,
                    "plain": changed.bytes,
                    "sections": report.sections,
                    "plain_sections": gvpipe.info(plain).sections,
                }
            )
            print(json.dumps(results[-1]), file=sys.stderr, flush=True)
    return results


def measure_rates() -> list[dict[str, Any]]:
    """Sequences per second of processor time, read from shards and from other files."""
    sequences = [make_sequence(k) for k in range(N_SEQUENCES)]
    results = []
    with tempfile.TemporaryDirectory() as name:
        for label, settings in SETTINGS.items():
            folder = Path(name, label.replace(" ", "").replace(",", "-"))
            folder.mkdir()
            for k, sequence in enumerate(sequences):
                gvpipe.encode(sequence, folder / f"{k}.mp4", max_error=MAX_ERROR, bare=True, **settings)
            datasets.pack(folder, folder / "shard.tar")
            dataset = datasets.open(folder / "shard.tar")
            sizes = sum(path.stat().st_size for path in folder.glob("*.mp4"))
            found = {"label": label, "bytes": sizes / N_SEQUENCES, "whole": rate(dataset.read)}
            found["alone"] = rate(partial(_read_alone, dataset))
            if len(dataset.open(0).levels) > 1:
                found |= {f"lod {lod}": rate(partial(dataset.read, lod=lod)) for lod in LEVELS}
            results.append(found)
            print(json.dumps(found), file=sys.stderr, flush=True)
    for label, save in (("npz", np.savez), ("npz, compressed", np.savez_compressed)):
        files = [_saved(save, sequence) for sequence in sequences]
        results.append({"label": label, "bytes": sum(map(len, files)) / N_SEQUENCES, "whole": rate(partial(_load, files))})
    return results


def make_sequence(seed: int) -> MeshSequence:
    """A sheet that four travelling waves move, different for each seed."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    faces = np.concatenate([corner[:, None] + (0, 1, SIDE), corner[:, None] + (1, SIDE + 1, SIDE)])
    t = np.arange(N_FRAMES)[:, None]
    positions = np.repeat(points[None], N_FRAMES, axis=0)
    for k in range(4):
        phase = points[:, :2] @ random.uniform(1, 8, 2) + t * (0.2 + 0.1 * k) + k
        positions += 0.05 * np.sin(phase)[:, :, None] * random.normal(size=3)
    return MeshSequence(positions.astype(np.float32), faces, 30.0)


def rate(read: Callable[[int], Any]) -> float:
    """Calls a second of processor time, with the numbers of all sequences in turn; the first calls compile and warm up."""
    read(0), read(1)
    count, started = 0, time.process_time()
    while time.process_time() - started < SECONDS:
        read(count % N_SEQUENCES)
        count += 1
    return count / (time.process_time() - started)


def tables(folder: Path) -> list[str]:
    """The results as tables in Markdown."""
    sizes = json.loads((folder / "short_sequences.json").read_text())["results"]
    lines = [f"| sequence | codec | {' | '.join(PARTS)} | bare file | plain file | float32 / bare | float32 / plain |"]
    lines.append("|" + " --- |" * (len(PARTS) + 6))
    for row in sizes:
        parts = [sum(n for name, n in row["sections"].items() if name.split(".")[0] in names) for names in PARTS.values()]
        ratios = [f"{row['float32'] / row[layout]:.1f}" for layout in ("bare", "plain")]
        cells = [row["name"], row["codec"], *parts, row["bare"], row["plain"], *ratios]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    means = [math.exp(np.mean([math.log(row["float32"] / row[layout]) for row in sizes])) for layout in ("bare", "plain")]
    lines.append(f"| geometric mean |{' |' * (len(PARTS) + 3)} {means[0]:.1f} | {means[1]:.1f} |")
    rates = json.loads((folder / "shard_rates.json").read_text())["results"]
    columns = ["whole", "alone", *(f"lod {lod}" for lod in LEVELS)]
    lines += ["", f"| file | bytes | {' | '.join(columns)} |", "|" + " --- |" * (len(columns) + 2)]
    for row in rates:
        cells = [f"{row[name]:.0f}" if name in row else "" for name in columns]
        lines.append(f"| {row['label']} | {row['bytes']:.0f} | {' | '.join(cells)} |")
    return lines


def _saved(save: Callable[..., None], sequence: MeshSequence) -> bytes:
    file = io.BytesIO()
    save(file, vertices=sequence.positions[:], faces=sequence.faces)
    return file.getvalue()


def _read_alone(dataset: datasets.Dataset, k: int) -> Any:
    """A sequence as `gvpipe.open` reads it, without what files of one connectivity share."""
    return dataset.open(k)[:]


def _load(files: list[bytes], k: int) -> Any:
    with np.load(io.BytesIO(files[k])) as found:
        return found["vertices"]


if __name__ == "__main__":
    main()
