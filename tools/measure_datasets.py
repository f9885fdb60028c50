"""Measure data sets of short sequences: where the bytes of a file go, and how many sequences a second a shard gives.

    python tools/measure_datasets.py sizes ../shared/data/*.npz --json docs/benchmarks/datasets/short_sequences.json
    python tools/measure_datasets.py rates --json docs/benchmarks/datasets/shard_rates.json
    python tools/measure_datasets.py sharing --json docs/benchmarks/datasets/sharing.json
    python tools/measure_datasets.py codecs ../shared/data/*.npz --json docs/benchmarks/datasets/codecs.json
    python tools/measure_datasets.py tables docs/benchmarks/datasets

Sizes: each sequence is cut to 16 frames and encoded by codec ``auto`` in the bare layout, then changed to the plain one.
Rates: sequences of one connectivity, made here, 45 x 45 vertices and 16 frames, are packed and read at random by one process;
seconds are of its processor time. The same sequences lie in tar files in other ways, too: as .npz, .npz compressed by zstd
(package ``zstandard``, or Python 3.14), and Draco, a stream a frame, whose step keeps the same bound.
Sharing: 500 sequences of seven irregular sheets of 500 to 3,500 vertices, packed with and without shared sections, and
read in a random order, the least of three passes.
Codecs: processor time, with that of processes that have ended, and bytes of codec ``pca`` and of ``auto``, 16 frames each.
"""

from __future__ import annotations

import argparse
import importlib
import io
import json
import math
import os
import platform
import sys
import tarfile
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import Delaunay, cKDTree

import gvpipe
from gvpipe import datasets
from gvpipe.benchmark.sweep import describe_machine
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence

Storage = tuple[Callable[[MeshSequence], bytes], Callable[[bytes], Float32]]  # a sequence to bytes, and to positions

N_FRAMES = 16
MAX_ERROR = "0.1%"
SIDE = 45  # vertices of a side
N_SEQUENCES = 24
SPANS, SECONDS = 5, 0.5  # of a rate: how many, and processor time of each
N_SHARING, TOPOLOGIES, VERTICES_STEP, PASSES = 500, 7, 500, 3
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
ZSTD_LEVEL = 3
DRACO_LEVELS = (7, 10)  # that of Draco's own command, and the smallest files


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("sizes", "codecs", "rates", "sharing", "tables"):
        command = commands.add_parser(name)
        if name in ("sizes", "codecs", "tables"):
            command.add_argument("paths", nargs="+", type=Path)
        command.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.command == "tables":
        print(*tables(options.paths[0]), sep="\n")
        return
    found: dict[str, Any] = {"gvpipe": gvpipe.__version__, "python": platform.python_version(), "machine": platform.machine()}
    if options.command != "sizes":
        found |= {"cpu": describe_machine(), "libraries": _versions()}
    measures: dict[str, Callable[[], Any]] = {
        "sizes": lambda: measure_sizes(options.paths),
        "codecs": lambda: measure_codecs(options.paths),
        "rates": measure_rates,
        "sharing": measure_sharing,
    }
    found["results"] = measures[options.command]()
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


def measure_codecs(paths: list[Path]) -> list[dict[str, Any]]:
    """Processor time and bytes of each sequence's first frames, by codec ``pca`` and by ``auto``, kernels compiled before."""
    results: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(paths):
            sequence = gvpipe.read(path)
            sequence = sequence.part(0, min(N_FRAMES, sequence.n_frames))
            found: dict[str, Any] = {"name": path.stem}
            for codec in ("pca", "auto"):
                started = sum(os.times()[:4])
                report = gvpipe.encode(sequence, Path(folder, "a.mp4"), codec, max_error=MAX_ERROR, bare=True)
                found[codec] = {"codec": report.codec, "bytes": report.bytes, "seconds": sum(os.times()[:4]) - started}
            results.append(found)
            print(json.dumps(found), file=sys.stderr, flush=True)
    return results


def measure_rates() -> list[dict[str, Any]]:
    """Sequences per second of processor time, read from shards and from tar files of other files."""
    sequences = [make_sequence(k) for k in range(N_SEQUENCES)]
    results = []
    with tempfile.TemporaryDirectory() as name:
        for label, settings in SETTINGS.items():
            folder = Path(name, label.replace(" ", "").replace(",", "-"))
            folder.mkdir()
            results.append({"label": label, **_rates_of_shard(sequences, folder, settings)})
            print(json.dumps(results[-1]), file=sys.stderr, flush=True)
        for label, storage in storages().items():
            results.append({"label": label, **_rates_of_tar(sequences, Path(name, "other.tar"), storage)})
            print(json.dumps(results[-1]), file=sys.stderr, flush=True)
    return results


def measure_sharing() -> list[dict[str, Any]]:
    """Bytes of a data set of few connectivities with and without shared sections, and processor time to pack and to read it."""
    results = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "sequences")
        folder.mkdir()
        parts: Counter[str] = Counter()
        for k in range(N_SHARING):
            sequence = make_sheet(VERTICES_STEP * (1 + k % TOPOLOGIES), k)
            parts.update(gvpipe.encode(sequence, folder / f"{k}.mp4", "pca", max_error=MAX_ERROR, bare=True).sections)
        for share in (False, True):
            started = time.process_time()
            packed = datasets.pack(folder, Path(name, f"{share}.tar"), share=share)
            seconds = time.process_time() - started
            dataset = datasets.open(packed.shards)
            found = {"share": share, "shard": packed.bytes, "videos": dataset.n_bytes, "sections": packed.shared_sections}
            results.append(
                {**found, "pack_seconds": seconds, "read_seconds": min(_pass_seconds(dataset) for _ in range(PASSES))}
            )
        common = sum(size for part, size in parts.items() if part.split(".")[0] in ("mesh", "order"))
        results.append({"mesh_and_order": common, "files": sum(parts.values())})
    return results


def _pass_seconds(dataset: datasets.Dataset) -> float:
    """Processor time to read all sequences once, in a random order."""
    started = time.process_time()
    for k in np.random.default_rng(0).permutation(len(dataset)).tolist():
        dataset.read(k)
    return time.process_time() - started


def storages() -> dict[str, Storage]:
    """Other ways to store a sequence, by label; zstd is left out where nothing has it."""
    found: dict[str, Storage] = {
        "npz": (partial(_save_npz, np.savez), _load_npz),
        "npz, compressed": (partial(_save_npz, np.savez_compressed), _load_npz),
    }
    zstd = _find_zstd()
    if zstd is None:
        print("no zstd: pip install zstandard", file=sys.stderr)
    else:
        pack, unpack = zstd
        found[f"npz, zstd {ZSTD_LEVEL}"] = (
            lambda sequence: pack(_save_npz(np.savez, sequence)),
            lambda data: _load_npz(unpack(data)),
        )
    return found | {f"Draco, level {level}": (partial(_save_draco, level), _load_draco) for level in DRACO_LEVELS}


def make_sheet(n_vertices: int, seed: int) -> MeshSequence:
    """An irregular sheet, the same for each number of vertices, that four travelling waves move."""
    points = np.random.default_rng(n_vertices).uniform(0, 1, (n_vertices, 2))
    return _waves(np.c_[points, np.zeros(n_vertices)], Delaunay(points).simplices, seed)


def make_sequence(seed: int) -> MeshSequence:
    """A sheet that four travelling waves move, different for each seed."""
    x, y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    return _waves(points, np.concatenate([corner[:, None] + (0, 1, SIDE), corner[:, None] + (1, SIDE + 1, SIDE)]), seed)


def _waves(points: Float64, faces: Int32, seed: int) -> MeshSequence:
    random = np.random.default_rng(seed)
    t = np.arange(N_FRAMES)[:, None]
    positions = np.repeat(points[None], N_FRAMES, axis=0)
    for k in range(4):
        phase = points[:, :2] @ random.uniform(1, 8, 2) + t * (0.2 + 0.1 * k) + k
        positions += 0.05 * np.sin(phase)[:, :, None] * random.normal(size=3)
    return MeshSequence(positions.astype(np.float32), faces, 30.0)


def rate(read: Callable[[int], Any]) -> float:
    """Calls a second of processor time, the median of some spans, with the numbers of all sequences in a random order."""
    order = np.random.default_rng(0).permutation(N_SEQUENCES).tolist()
    read(0), read(1)  # compile and warm up
    rates, count = [], 0
    for _ in range(SPANS):
        first, started = count, time.process_time()
        while time.process_time() - started < SECONDS:
            read(order[count % N_SEQUENCES])
            count += 1
        rates.append((count - first) / (time.process_time() - started))
    return float(np.median(rates))


def largest_error(sequences: list[MeshSequence], read: Callable[[int], Float32]) -> float:
    """Of all vertices, as a part of frame 0's diagonal; vertices are matched by their paths, since Draco numbers them anew."""
    errors = []
    for k, sequence in enumerate(sequences):
        positions, found = sequence.positions[:].astype(float), read(k).astype(float)
        paths, found_paths = (np.concatenate(list(frames), axis=1) for frames in (positions, found))  # (V, 3 F)
        order = cKDTree(paths).query(found_paths)[1]
        if len(np.unique(order)) != sequence.n_vertices:
            raise SystemExit(f"sequence {k}: its vertices cannot be told apart")
        errors.append(np.linalg.norm(found - positions[:, order], axis=2).max() / frame_diagonal(sequence))
    return float(max(errors))


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
    lines += ["", f"| file | bytes | largest error | {' | '.join(columns)} |", "|" + " --- |" * (len(columns) + 3)]
    for row in rates:
        cells = [f"{row[name]:.0f}" if name in row else "" for name in columns]
        error = f"{100 * row['max_diag']:.3f} %" if row["max_diag"] else "0"
        lines.append(f"| {row['label']} | {row['bytes']:.0f} | {error} | {' | '.join(cells)} |")
    return lines


def _rates_of_shard(sequences: list[MeshSequence], folder: Path, settings: dict[str, Any]) -> dict[str, Any]:
    """Bytes, largest error and rates of gvpipe's files."""
    for k, sequence in enumerate(sequences):
        gvpipe.encode(sequence, folder / f"{k}.mp4", max_error=MAX_ERROR, bare=True, **settings)
    datasets.pack(folder, folder / "shard.tar")
    dataset = datasets.open(folder / "shard.tar")
    sizes = sum(path.stat().st_size for path in folder.glob("*.mp4"))
    found = {"bytes": sizes / N_SEQUENCES, "max_diag": largest_error(sequences, dataset.read), "whole": rate(dataset.read)}
    found["alone"] = rate(partial(_read_alone, dataset))
    if len(dataset.open(0).levels) > 1:
        found |= {f"lod {lod}": rate(partial(dataset.read, lod=lod)) for lod in LEVELS}
    return found


def _read_alone(dataset: datasets.Dataset, k: int) -> Any:
    """A sequence as `gvpipe.open` reads it, without what files of one connectivity share."""
    return dataset.open(k)[:]


def _rates_of_tar(sequences: list[MeshSequence], path: Path, storage: Storage) -> dict[str, Any]:
    """Bytes, largest error and rate of other files; where each lies is read once, as of a shard."""
    save, load = storage
    with tarfile.open(path, "w") as archive:
        for k, sequence in enumerate(sequences):
            data = save(sequence)
            member = tarfile.TarInfo(str(k))
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    with tarfile.open(path) as archive:
        places = [(member.offset_data, member.size) for member in archive.getmembers()]

    def read(k: int) -> Float32:
        with path.open("rb") as file:
            file.seek(places[k][0])
            return load(file.read(places[k][1]))

    sizes = sum(size for _, size in places)
    return {"bytes": sizes / N_SEQUENCES, "max_diag": largest_error(sequences, read), "whole": rate(read)}


def _save_npz(save: Callable[..., None], sequence: MeshSequence) -> bytes:
    file = io.BytesIO()
    save(file, vertices=sequence.positions[:], faces=sequence.faces)
    return file.getvalue()


def _load_npz(data: bytes) -> Float32:
    with np.load(io.BytesIO(data)) as found:
        positions: Float32 = found["vertices"]
    return positions


def _find_zstd() -> tuple[Callable[[bytes], bytes], Callable[[bytes], bytes]] | None:
    """What compresses and what decompresses, of the package or of Python; None if there is neither."""
    for name in ("zstandard", "compression.zstd"):
        try:
            zstd = importlib.import_module(name)
        except ImportError:
            continue
        return partial(zstd.compress, level=ZSTD_LEVEL), zstd.decompress
    return None


def _save_draco(level: int, sequence: MeshSequence) -> bytes:
    """Lengths of the frames' streams as uint32, then the streams; the step is the largest whose cells keep the bound."""
    import DracoPy

    step = 0.9999 * 2 / math.sqrt(3) * float(MAX_ERROR.rstrip("%")) / 100 * frame_diagonal(sequence)  # less rounding to float32
    streams = []
    for points in sequence.positions[:]:
        bits = math.ceil(math.log2(float(np.ptp(points, axis=0).max()) / step + 1))
        box = {"quantization_range": step * (2**bits - 1), "quantization_origin": points.min(axis=0)}
        streams.append(DracoPy.encode(points, sequence.faces, quantization_bits=bits, compression_level=level, **box))
    return b"".join([np.array(list(map(len, streams)), "<u4").tobytes(), *streams])


def _load_draco(data: bytes) -> Float32:
    import DracoPy

    ends = np.cumsum([4 * N_FRAMES, *np.frombuffer(data, "<u4", N_FRAMES)]).tolist()
    return np.stack([DracoPy.decode(data[start:end]).points for start, end in pairwise(ends)])


def _versions() -> dict[str, str]:
    found = {}
    for name in ("numpy", "DracoPy", "zstandard"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


if __name__ == "__main__":
    main()
