"""What of real assets comes back from a geometry video, and from the files that it is decoded to.

    python tools/check_round_trips.py FILE... [--codec pca] [--formats npz,obj,glb] [--frames 12] [--markdown]

Each file (a mesh sequence of any format) is encoded and decoded. Parts, polygons, seams, materials, images and metadata must
be equal, attributes and fields within their bounds. The decoded sequence is written in each format and read again; what that
format cannot hold is said. Status 1: something is not as it was.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from gvpipe.asset.polygons import polygon_corners
from gvpipe.foundation.errors import GvpipeError
from gvpipe.metrics.correspondence import match_corners

SLACK = 1 + 1e-5  # of a bound: what float32 rounds
PATTERNS = {"npz": "a.npz", "obj": "obj/%04d.obj", "ply": "ply/%04d.ply", "glb": "a.glb", "usdc": "a.usdc", "abc": "a.abc"}


def main() -> int:
    """Check the files that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FILE", help="a mesh sequence, or a pattern of frames")
    parser.add_argument("--codec", default="pca", help="of the geometry video [default: pca]")
    parser.add_argument("--formats", default="npz,obj,glb", help="that it is decoded to [default: npz,obj,glb]")
    parser.add_argument("--frames", type=int, default=12, help="most frames of each [default: 12]")
    parser.add_argument("--markdown", action="store_true", help="print a table for the documentation")
    given = parser.parse_args()
    is_wrong = False
    if given.markdown:
        print("| file | holds | bytes | differs | written and read again |\n| --- | --- | --- | --- | --- |")
    for file in given.files:
        for cells, found in check(file, given.codec, given.formats.split(","), given.frames):
            is_wrong |= found
            print("| " + " | ".join(cells) + " |" if given.markdown else "  ".join(cells), flush=True)
    return int(is_wrong)


def check(file: str, codec: str, formats: list[str], most: int) -> Iterator[tuple[list[str], bool]]:
    """Cells of one file's row, and whether something is wrong."""
    name = Path(file).name
    try:
        source = gvpipe.read(file)
        source = source.part(0, min(most, len(source)))
        with tempfile.TemporaryDirectory() as folder:
            started = time.perf_counter()
            report = gvpipe.encode(source, Path(folder, "a.mp4"), codec)
            decoded = gvpipe.decode(Path(folder, "a.mp4"))
            seconds = time.perf_counter() - started
            wrong = differences(source, decoded, gvpipe.info(Path(folder, "a.mp4")))
            written = [f"{kind}: {again(decoded, Path(folder, PATTERNS[kind]))}" for kind in formats]
    except GvpipeError as exc:
        yield [name, f"refused: {str(exc).replace(str(file), name)}", "-", "-", "-"], False
        return
    size = f"{report.bytes} ({seconds:.1f} s)"
    yield [name, describe(source), size, ", ".join(wrong) or "nothing", "; ".join(written)], bool(wrong)


def describe(sequence: gvpipe.MeshSequence) -> str:
    """What a sequence holds, short."""
    n_frames, n_vertices, _ = sequence.shape
    held = [f"{n_frames} x {n_vertices}", f"{len(sequence.parts)} parts"]
    held += [f"{name} per {each.domain}" for name, each in [*sequence.attributes.items(), *sequence.fields.items()]]
    if sequence.polygons is not None:
        held.append(f"{len(sequence.polygons)} polygons")
    return ", ".join([*held, f"{len(sequence.materials)} materials", f"{len(sequence.images)} images"])


def differences(
    source: gvpipe.MeshSequence, decoded: gvpipe.MeshSequence, info: gvpipe.Info | None, rounding: float = 1e-7
) -> list[str]:
    """What of a sequence did not come back; bounds are those of ``info``, or 0, and what is rounded beside."""
    wrong = []
    for what in ("parts", "materials", "images", "metadata"):
        if getattr(source, what) != getattr(decoded, what):
            wrong.append(what)
    if polygons_of(source) != polygons_of(decoded):
        wrong.append("polygons")
    bounds = {each["name"]: each["bound"] for each in (*info.attributes, *info.fields)} if info else {}
    errors = gvpipe.compare(source, decoded)
    for name, error in (errors.attributes | errors.fields).items():
        largest = error["max"]
        if largest is None:
            wrong.append(f"{name} is missing")
        elif largest > bounds.get(name, 0.0) * SLACK + rounding:
            wrong.append(f"{name} is {largest:.2g} off, {bounds.get(name, 0.0):.2g} allowed")
    return [*wrong, *seams_that_differ(source, decoded)]


def seams_that_differ(source: gvpipe.MeshSequence, decoded: gvpipe.MeshSequence) -> list[str]:
    """Attributes whose corners do not share values as they did."""
    corners = match_corners(source.faces, decoded.faces)
    wrong = []
    for name, ours in source.attributes.items():
        theirs = decoded.attributes.get(name)
        if theirs is None or ours.domain != "corner" or theirs.domain != "corner":
            continue
        a = (np.arange(len(ours)) if ours.indices is None else ours.indices)[corners]
        b = np.arange(len(theirs)) if theirs.indices is None else theirs.indices
        a, b = (values_by_vertex(decoded.faces, each) for each in (a, b))
        if len(np.unique(np.stack([a, b], axis=1), axis=0)) != max(a.max(initial=-1), b.max(initial=-1)) + 1:
            wrong.append(f"seams of {name}")
    return wrong


def values_by_vertex(faces: Any, indices: Any) -> Any:
    """Numbers ``(3T,)``, equal where two corners of one vertex share a value."""
    pairs = np.stack([faces.reshape(-1), indices], axis=1)
    return np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1)


def polygons_of(sequence: gvpipe.MeshSequence) -> list[tuple[int, ...]]:
    """Its polygons of more than three corners, each from its first corner on, sorted."""
    if sequence.polygons is None:
        return []
    corners = sequence.faces.reshape(-1)[polygon_corners(sequence.polygons)]
    stops = np.cumsum(sequence.polygons)
    starts = stops - sequence.polygons
    return sorted(tuple(corners[a:b].tolist()) for a, b in zip(starts, stops, strict=True) if b - a > 3)


def again(decoded: gvpipe.MeshSequence, path: Path, rounding: float = 1e-7) -> str:
    """What differs after a sequence was written and read again."""
    try:
        notes = gvpipe.write(decoded, path)
        read = gvpipe.read(path, fps=decoded.fps)
        if read.n_vertices != decoded.n_vertices:
            return f"{read.n_vertices} vertices, split along seams"
        wrong: list[Any] = differences(decoded, read, None, rounding)
    except GvpipeError as exc:
        return str(exc).replace(str(path), path.name)
    said = f" (said: {'; '.join(notes)})" if notes else ""
    return (", ".join(map(str, wrong)) or "equal") + said


if __name__ == "__main__":
    sys.exit(main())
