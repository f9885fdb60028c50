"""How far the baseline `dynapack:predictor=space`, which stands for Touma and Gotsman, is from Draco frame by frame.

    pip install ./baselines
    python tools/measure_draco_frames.py ../sequences/cow.npz ../sequences/chicken.npz

Both round the same points to one lattice, over the bounding box of the whole animation, so that their errors are equal. Draco
(DracoPy) codes each frame as a mesh of its own, with Edgebreaker. At level 8 it predicts from one parallelogram, as the
baseline does, at level 10 from several. Every stream is decoded: each vertex must come back within half a step.

A row has bits per vertex and frame, of positions alone and with connectivity. The baseline codes connectivity once, Draco in
each frame; of Draco it is the stream of the same triangles where positions carry no information. The vertex order, which Draco
does not keep, and the container are left out.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path

import DracoPy
import numpy as np
from scipy.spatial import cKDTree

import gvpipe
from gvpipe.coding.codec import Memo
from gvpipe.coding.registry import codec_class
from gvpipe.connectivity.topology_only import encode_triangles
from gvpipe.foundation.arrays import Array, Float32
from gvpipe.foundation.progress import silent
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.coded_points import code_connectivity

BITS = (9, 11, 13)  # of the lattice
LEVELS = (8, 10)  # of Draco's compression
ROUNDING = 1.01  # half steps that a vertex may move, since Draco rounds in float32
CLOSE = 1e-3  # part by which errors may differ, likewise


def main() -> None:
    """Print a row for each sequence and lattice."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", metavar="NAME.npz", nargs="+", type=Path)
    parser.add_argument("--bits", metavar="N", nargs="+", type=int, default=BITS)
    options = parser.parse_args()
    names = ["`space`", *(f"Draco {level}" for level in LEVELS)]
    print("| sequence | bits | KG |", " | ".join([*names, *(f"{name}, with connectivity" for name in names)]), "|")
    for path in options.sequences:
        for bits in options.bits:
            print(measure(gvpipe.read(path), path.stem, bits), flush=True)


def measure(sequence: MeshSequence, name: str, bits: int) -> str:
    """A row; raises ValueError where the baseline and Draco have different errors."""
    rate = 8 / (sequence.n_vertices * sequence.n_frames)
    settings = codec_class("dynapack").from_texts({"predictor": "space", "bits": str(bits)})
    with tempfile.TemporaryDirectory() as folder:
        made = gvpipe.encode(sequence, Path(folder) / "a.mp4", settings)
        error = gvpipe.compare(sequence, gvpipe.decode(Path(folder) / "a.mp4")).rmse
    positions, connectivity = [made.sections["frames.0"]], [made.sections["mesh"]]
    shared = code_connectivity(sequence, False, Memo(), silent)
    faces = shared.mesh.point_faces.astype(np.int64)
    in_each = len(encode_triangles(faces, shared.mesh.n_points)[0][0])
    for level in LEVELS:
        size, square = code_frames(sequence, faces, shared.members, bits, level)
        if not math.isclose(math.sqrt(square), error, rel_tol=CLOSE):
            raise ValueError(f"{name}, {bits} bits: errors differ, {error} of the baseline, {math.sqrt(square)} of Draco")
        connectivity.append(in_each * sequence.n_frames)
        positions.append(size - connectivity[-1])
    kg = 100 * error / measure_spread(sequence)
    whole = [sum(pair) for pair in zip(positions, connectivity, strict=True)]
    return f"| {name} | {bits} | {kg:.3f} | {' | '.join(f'{size * rate:.2f}' for size in positions + whole)} |"


def code_frames(sequence: MeshSequence, faces: Array, members: Array, bits: int, level: int) -> tuple[int, float]:
    """Bytes of Draco's streams of all frames, and the mean square error of a vertex as decoded, squared model units.

    Raises:
        ValueError: a vertex does not come back within half a step.
    """
    frames = sequence.read(0, sequence.n_frames)
    origin, side = frames.reshape(-1, 3).min(axis=0), float(np.ptp(frames.reshape(-1, 3), axis=0).max())
    half = ROUNDING * side / (2**bits - 1) / 2
    size, squares = 0, 0.0
    for frame in frames:
        box = {"quantization_range": side, "quantization_origin": origin}
        data = DracoPy.encode(frame[members], faces.astype(np.uint32), quantization_bits=bits, compression_level=level, **box)
        left = _differences(frame, DracoPy.decode(data).points)
        if np.abs(left).max() > half:
            raise ValueError(f"{sequence.name}: Draco moved a vertex by {np.abs(left).max()}, more than half a step ({half})")
        size += len(data)
        squares += float(np.square(left).sum())
    return size, squares / frames[..., 0].size


def _differences(frame: Float32, decoded: Array) -> Array:
    """Vertices less their decoded points, whose order is another: within half a step there is one point of the lattice."""
    return np.asarray(frame.astype(np.float64) - decoded[cKDTree(decoded).query(frame)[1]])


if __name__ == "__main__":
    main()
