"""What is read of each asset, and how far it is from its reference.

    python tools/check_assets.py FOLDER [--only NAME]

FOLDER has ``assets/KIND/NAME/`` with the files of one asset each, and ``reference/NAME.npz`` with positions by other programs.
Each kind has a function in `KINDS` that reads an asset at the reference's times. The distance is the largest of any vertex, as
a part of the diagonal.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import gvpipe
from gvpipe.foundation.arrays import Array, Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf import read_poses
from gvpipe.model.sequence import MeshSequence

LIMIT = 1e-5  # part of the diagonal, beyond which an asset is marked


@dataclass(frozen=True)
class Compared:
    """Rows of a reference, and what was read for them, ``(n, V, 3)`` both."""

    label: str
    read: Float64
    reference: Array

    @property
    def distance(self) -> float:
        """Largest distance of a vertex, as a part of the reference's diagonal; infinite for other shapes."""
        if self.read.shape != self.reference.shape:
            return float("inf")
        diagonal = float(np.linalg.norm(np.ptp(self.reference.reshape(-1, 3).astype(np.float64), axis=0)))
        return float(np.linalg.norm(self.read - self.reference, axis=2).max()) / diagonal


def compare_gltf(path: Path, reference: dict[str, Array], sequence: MeshSequence) -> Iterator[Compared]:
    """Each clip of the reference; clip -1 is the file's own pose.

    References have a block of vertices per primitive, so blocks that parts share are repeated.
    """
    if "positions_4_influences" in reference:  # the file's own pose is of a reader that takes four influences alone
        kept = reference["clips"] >= 0
        reference = reference | {name: reference[name][kept] for name in ("clips", "times", "positions")}
    numbers = [int(number) for number in np.unique(reference["clips"]) if number >= 0]
    names = dict(zip(numbers, map(str, reference["clip_names"]), strict=True))
    for number in np.unique(reference["clips"]):
        rows = reference["clips"] == number
        name = names.get(int(number), "")
        positions = read_poses(path, name).at(reference["times"][rows].astype(np.float64))
        if sequence.parts:
            positions = np.concatenate([positions[:, slice(*part.vertices)] for part in sequence.parts], axis=1)
        yield Compared(name or "own pose", positions, reference["positions"][rows])


Compare = Callable[[Path, dict[str, Array], MeshSequence], Iterator[Compared]]
KINDS: dict[str, tuple[tuple[str, ...], Compare]] = {"gltf": ((".gltf", ".glb"), compare_gltf)}


def describe(sequence: MeshSequence) -> str:
    """What a sequence holds, in one line."""
    held = {
        "parts": len(sequence.parts),
        "materials": len(sequence.materials),
        "images": len(sequence.images),
        "attributes": " ".join(sequence.attributes),
        "fields": " ".join(sequence.fields),
    }
    frames = f"{len(sequence)} frames at {sequence.fps:g}, {sequence.n_vertices} vertices, {len(sequence.faces)} triangles"
    return ", ".join([frames, *(f"{name}: {value}" for name, value in held.items() if value)])


def check(path: Path, reference: Path, compare: Compare) -> bool:
    """Print what one asset holds and its distances; return whether all are within `LIMIT`."""
    start = time.perf_counter()
    try:
        sequence = gvpipe.read(path)
    except InputError as error:
        print(f"{path.parent.name}: {error}")
        return False
    print(f"{path.parent.name}: {describe(sequence)}; read in {time.perf_counter() - start:.2f} s")
    if not reference.exists():
        print("    no reference")
        return True
    with np.load(reference) as archive:
        compared = list(compare(path, dict(archive), sequence))
    worst = max(compared, key=lambda one: one.distance)
    far = [one.label for one in compared if one.distance > LIMIT]
    print(
        f"    {len(compared)} clips, largest distance {worst.distance:.2g}"
        + (f"; beyond {LIMIT:g}: {', '.join(far)}" if far else "")
    )
    return not far


def main() -> None:
    """Check all assets of a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with assets/ and reference/")
    parser.add_argument("--only", default="", help="assets whose name contains this")
    given = parser.parse_args()
    results: list[bool] = []
    for kind, (suffixes, compare) in KINDS.items():
        for folder in sorted(path for path in (given.folder / "assets" / kind).iterdir() if given.only in path.name):
            files = sorted(path for path in folder.iterdir() if path.suffix in suffixes)
            results += [check(path, given.folder / "reference" / f"{folder.name}.npz", compare) for path in files]
    print(f"{sum(results)} of {len(results)} assets agree")


if __name__ == "__main__":
    main()
