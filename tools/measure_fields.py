"""Bits per value of every field in `.npz` files, and the largest error over the bound, beside the best of other compressors.

    python tools/measure_fields.py bracket.npz plate.npz --peers fields.csv
    python tools/measure_fields.py plate.npz --field displacement --positions own --modes prediction derived

A file has ``faces (T, 3)``, ``vertices (F, V, 3)``, and each field as ``field_NAME (F, V)`` or ``(F, V, C)``. Components
that are 0 everywhere count for nothing. Peers are a table of comma-separated values with the columns ``sequence``, ``field``,
``peer`` and ``bits_per_value``.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import gvpipe
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.segment import MODES
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array

Peers = dict[tuple[str, str], tuple[float, str]]


class Row(NamedTuple):
    """What was measured of a field."""

    modes: str
    bits: float  # per value
    error: float  # largest, over the bound
    seconds: tuple[float, float]  # to encode, to decode, of processor time


def main() -> None:
    chosen = _arguments()
    peers = _read_peers(chosen.peers) if chosen.peers else {}
    print(f"| {'field':38} | mode | bits per value | best peer | ratio | error / bound | encode, s | decode, s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    ratios = []
    for path in chosen.files:
        with np.load(path) as data:
            positions, mesh = data["vertices"], FieldMesh(data["faces"].astype(np.int32), data["vertices"].shape[1])
            known = _positions(chosen.positions, path, positions)
            for key in (key for key in data.files if key.startswith("field_")):
                name = key.removeprefix("field_")
                if chosen.field and name not in chosen.field:
                    continue
                row = measure(data[key], mesh, chosen, known)
                best = peers.get((path.stem, name))
                print(_line(f"{path.stem} {name}", row, best), flush=True)
                if best:
                    ratios.append(row.bits / best[0])
    if ratios:
        print(f"\ngeometric mean of the ratios: {math.exp(sum(map(math.log, ratios)) / len(ratios)):.3f}")


def measure(field: Array, mesh: FieldMesh, chosen: argparse.Namespace, positions: Callable[[int, int], Array] | None) -> Row:
    """Encode a field ``(F, V)`` or ``(F, V, C)``, decode it, and compare."""
    values = field.reshape(*field.shape[:2], -1)
    largest = float(np.ptp(values)) * chosen.share
    bound = FieldBound(exact=True) if chosen.exact else FieldBound(largest)
    started = time.process_time()
    section = encode_field(lambda a, b: values[a:b], len(values), mesh, bound, positions=positions, modes=tuple(chosen.modes))
    encoded = time.process_time()
    reader = FieldReader(section, len(values), mesh, "field", positions)
    back = reader.read(0, len(values))
    seconds = encoded - started, time.process_time() - encoded
    used = int((np.abs(values).max(axis=(0, 1)) > 0).sum()) * values[:, :, 0].size
    error = float(np.abs(back.astype(np.float64) - values).max())
    return Row(" ".join(sorted(set(reader.modes))), 8 * len(section) / max(1, used), error / largest, seconds)


def _arguments() -> argparse.Namespace:
    described, _, rest = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser(description=described, epilog=rest, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.npz")
    parser.add_argument("--share", type=float, default=1e-3, help="bound, as a share of the field's range (0.001)")
    parser.add_argument("--exact", action="store_true", help="every bit instead")
    parser.add_argument("--field", nargs="+", help="measure these fields alone")
    parser.add_argument("--modes", nargs="+", choices=MODES, default=list(MODES), help="choose among these alone")
    parser.add_argument(
        "--positions",
        default="none",
        choices=("none", "own", "decoded"),
        help="positions that fields may follow from: the file's own, or decoded from pca with --max-error 0.1%%",
    )
    parser.add_argument("--peers", type=Path, help="table of other compressors' results")
    return parser.parse_args()


def _positions(kind: str, path: Path, own: Array) -> Callable[[int, int], Array] | None:
    if kind == "none":
        return None
    if kind == "decoded":
        video = path.with_suffix(".measured.mp4").name
        gvpipe.encode(gvpipe.read(path), video, codec="pca", max_error="0.1%")
        own = gvpipe.decode(video).read(0, len(own))
        Path(video).unlink()
    return lambda start, stop: own[start:stop]


def _read_peers(path: Path) -> Peers:
    """The best peer of each sequence and field, and its rate."""
    best: Peers = {}
    with path.open(newline="", encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            key, found = (row["sequence"], row["field"]), (float(row["bits_per_value"]), row["peer"])
            best[key] = min(best.get(key, found), found)
    return best


def _line(name: str, row: Row, best: tuple[float, str] | None) -> str:
    peer, ratio = (f"{best[0]:.3f} {best[1]}", f"{row.bits / best[0]:.3f}") if best else ("", "")
    seconds = " | ".join(f"{value:.1f}" for value in row.seconds)
    return f"| {name:38} | {row.modes} | {row.bits:.4f} | {peer} | {ratio} | {row.error:.4f} | {seconds} |"


if __name__ == "__main__":
    main()
