"""What scene files and point caches hold for gvpipe, and how far their positions are from a reference.

    python tools/check_scenes.py ../shared/data [--kind usd] [--only NAME] [--markdown]

The folder has `assets/MANIFEST.csv` (columns file, kind, reference) and `reference/*.npz`, made by other readers:
`positions (n, V, 3)` at `timecodes` (USD) or `times` (seconds), with `mesh_names` and `mesh_offsets`. Meshes are compared by
name, vertex by vertex. The distance is the largest, as part of the diagonal of the reference's first frame.

Points that were baked from skinning agree at whole time codes alone, since baked points move in straight lines between them.
Status 1: a file is farther than 1e-5.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io import READERS, read
from gvpipe.model.sequence import MeshSequence

KINDS = ("usd", "abc", "pointcache")
LIMIT = 1e-5
OTHERS = {  # files beside an entry's main one, and what they lack of what its reference holds
    "arm_blendshapes/arm.usda": "its blend shapes",
    "sublayer/crowd_geometry.usd": "its animation",
    "sphere_skin_inch/sphere_skin.usda": "the transform of the scene that refers to it",
    "pi_basic/pi_basic.usda": "no instances",
}
BAKED = ("arm_baked.usda", "lbs.baked.usda", "blendshapes.baked.usda")


@dataclass(frozen=True)
class Row:
    """What is printed of one file."""

    file: str
    held: str
    distance: str
    is_far: bool = False
    seconds: float = 0.0


def main() -> int:
    """Check the files that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with assets/MANIFEST.csv and reference/")
    parser.add_argument("--kind", choices=KINDS, help="one kind of files")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--markdown", action="store_true", help="print a table for the documentation")
    given = parser.parse_args()
    if given.markdown:
        print("| file | read | distance from the reference |\n| --- | --- | --- |")
    is_far = False
    for row in check(given.folder, given.kind, given.only):
        is_far |= row.is_far
        plain = f"{row.file}: {row.held}; {row.distance}; {row.seconds:.2f} s"
        print(f"| {row.file} | {row.held} | {row.distance} |" if given.markdown else plain)
    return int(is_far)


def check(folder: Path, kind: str | None, only: str) -> Iterator[Row]:
    """Yield a row for each file that gvpipe reads by a scene or cache format."""
    with open(folder / "assets" / "MANIFEST.csv", newline="") as file:
        entries = list(csv.DictReader(file))
    for entry in entries:
        path = folder / "assets" / entry["file"]
        wanted = entry["kind"] in KINDS and entry["kind"] in (kind or entry["kind"]) and only in entry["file"]
        if wanted and path.suffix.lower() in READERS:
            references = [folder / "reference" / name for name in entry["reference"].split()]
            yield check_file(path, entry["file"], references, mesh_beside(path))


def check_file(path: Path, name: str, references: list[Path], mesh: Path | None) -> Row:
    """Read one file and compare it with its references."""
    started = time.perf_counter()
    try:
        sequence = read(path, mesh=mesh)
    except InputError as exc:
        return Row(name, f"refused: {str(exc).replace(str(path), path.name)}", "-")
    seconds = time.perf_counter() - started
    lacks = next((lack for end, lack in OTHERS.items() if name.endswith(end)), "")
    if lacks or not references:
        return Row(name, describe(sequence), f"the reference has {lacks}" if lacks else "no reference", seconds=seconds)
    distances = [distance(sequence, reference, path.name in BAKED) for reference in references]
    known = [found for found in distances if found is not None]
    if not known:
        return Row(name, describe(sequence), "the reference is of another space or order", seconds=seconds)
    return Row(name, describe(sequence), f"{max(known):.1e}", max(known) > LIMIT, seconds)


def describe(sequence: MeshSequence) -> str:
    """``V 921, T 1724, F 20 at 24 fps; 6 parts; normal, uv (corner)``."""
    held = [f"V {sequence.n_vertices}, T {len(sequence.faces)}, F {sequence.n_frames} at {sequence.fps:g} fps"]
    held += [f"{len(sequence.parts)} parts"] if len(sequence.parts) > 1 else []
    held += [f"{name} ({each.domain})" for name, each in sequence.attributes.items()]
    held += [f"field {name} ({each.domain})" for name, each in sequence.fields.items()]
    held += [f"{len(sequence.materials)} materials"] if sequence.materials else []
    held += [f"{len(sequence.images)} images"] if sequence.images else []
    return ", ".join(held)


def distance(sequence: MeshSequence, path: Path, is_baked: bool) -> float | None:
    """The largest distance of a vertex from a reference as part of its diagonal, None where it is of another kind."""
    reference = np.load(path)
    frames = sequence.positions
    expected: Array = reference["positions"]
    diagonal = float(np.linalg.norm(np.ptp(expected[0], axis=0)))
    at = getattr(frames, "at", None)
    if at is None:
        if expected.shape != sequence.shape:
            return None
        return float(np.abs(sequence.read_absolute(0, len(sequence)) - expected).max()) / diagonal
    if "mesh_names" not in reference or not ("timecodes" in reference or "sample_times" in reference):
        return None
    times = reference["timecodes"] if "timecodes" in reference else reference["times"]
    names, offsets = reference["mesh_names"].tolist(), reference["mesh_offsets"]
    visible = reference["visible"] if "visible" in reference else np.ones((len(times), len(names)), bool)
    expected = np.where(np.repeat(visible, np.diff(offsets), axis=1)[..., None], expected, np.nan)  # hidden meshes are points
    if is_baked:
        whole = times == np.rint(times)
        times, expected = times[whole], expected[whole]
    found = np.stack([at(float(moment)) for moment in times])
    return _by_mesh(sequence, found, names, offsets, expected) / diagonal


def _by_mesh(sequence: MeshSequence, found: Float64, names: list[str], offsets: Array, expected: Array) -> float:
    """The largest distance over the meshes that both have; at least one."""
    spans = {_path(part): part.vertices for part in sequence.parts}
    shared = [(number, spans[name]) for number, name in enumerate(names) if name in spans]
    if len(shared) < len(spans):
        return float("inf")
    return max(
        float(np.nanmax(np.abs(found[:, start:stop] - expected[:, offsets[number] : offsets[number + 1]]), initial=0.0))
        for number, (start, stop) in shared
    )


def _path(part: Part) -> str:
    return "/" + "/".join(filter(None, (part.parent, part.name)))


def mesh_beside(path: Path) -> Path | None:
    """The mesh of a point cache: the OBJ in its folder or the one above."""
    if path.suffix.lower() not in (".pc2", ".mdd", ".npy"):
        return None
    return next(iter(sorted(path.parent.glob("*.obj")) or sorted(path.parent.parent.glob("*.obj"))), None)


if __name__ == "__main__":
    sys.exit(main())
