"""Sizes of what people use instead of gvpipe: the tables of README.

    python tools/measure_alternatives.py [../shared/data/fields/bracket_vibration.npz ...]

First `samples/creature.npz`: caches, glTF, vertex animation textures, gzip, Draco frame by frame (DracoPy). Then each
simulation that is given: HDF5 with gzip and with SZ3 (pip install h5py hdf5plugin), and gvpipe by `pca`, with the same bounds.
"""

from __future__ import annotations

import argparse
import gzip
import tempfile
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
from scipy.spatial import cKDTree

import gvpipe
from gvpipe.foundation.arrays import Array, Float32

ROOT = Path(__file__).parents[1]
OUTPUTS = ("a.abc", "a.usdc", "a.pc2", "a.mdd", "a.glb", "a.openvat")
BITS = (10, 11)  # of Draco's positions
BOUND = 0.001  # of a field's range, and of the diagonal


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("simulations", nargs="*", type=Path, help="archives with fields")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measure_sample(Path(folder))
        for path in given.simulations:
            measure_simulation(path, Path(folder))


def measure_sample(folder: Path) -> None:
    """The sample in every form, with root mean square errors as parts of frame 0's diagonal."""
    source = gvpipe.read(ROOT / "samples" / "creature.npz")
    frames = source.read(0, source.n_frames)
    diagonal = float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    report = gvpipe.encode(source, folder / "a.mp4")
    error = gvpipe.compare(source, gvpipe.decode(folder / "a.mp4")).rmse_diag
    print(f"gvpipe: {report.bytes} bytes, error {error:.2e}")
    for name in OUTPUTS:
        gvpipe.write(source, folder / name)
        print(f"{name[1:]}: {_size(folder / name)} bytes")
    print(f"gzip: {len(gzip.compress(frames.tobytes()))} bytes")
    for bits in BITS:
        coded = [DracoPy.encode(frame, source.faces, quantization_bits=bits, compression_level=10) for frame in frames]
        errors = [_nearest(frame, DracoPy.decode(data).points) for frame, data in zip(frames[::25], coded[::25], strict=True)]
        error = float(np.sqrt(np.mean(errors))) / diagonal
        print(f"Draco, {bits} bits: {sum(map(len, coded))} bytes, error {error:.2e}")


def measure_simulation(path: Path, folder: Path) -> None:
    """A simulation by gvpipe, and as HDF5."""
    source = gvpipe.read(path)
    frames = source.read(0, source.n_frames)
    arrays = {"positions": frames, **{name: np.asarray(field[:], np.float32) for name, field in source.fields.items()}}
    bound = f"{100 * BOUND:g}%"
    report = gvpipe.encode(source, folder / "b.mp4", "pca", max_error=bound, fields=dict.fromkeys(source.fields, bound))
    sizes = {kind: _hdf5_size(arrays, folder / "b.h5", kind) for kind in ("gzip", "SZ3")}
    n_bytes = sum(array.nbytes for array in arrays.values())
    print(f"{path.name}: float32 {n_bytes}, gzip {sizes['gzip']}, SZ3 {sizes['SZ3']}, gvpipe {report.bytes} bytes")


def _hdf5_size(arrays: dict[str, Array], path: Path, kind: str) -> int:
    import h5py

    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array, **_filter(name, array, kind))
    return path.stat().st_size


def _filter(name: str, array: Array, kind: str) -> dict[str, Any]:
    if kind == "gzip":
        return {"chunks": True, "compression": "gzip", "shuffle": True}
    import hdf5plugin

    wide = np.linalg.norm(np.ptp(array[0], axis=0)) if name == "positions" else np.nanmax(array) - np.nanmin(array)
    return {"chunks": array.shape, **hdf5plugin.SZ3(absolute=BOUND * float(wide))}


def _nearest(frame: Float32, points: Array) -> float:
    """The mean square distance of vertices from the nearest of decoded points, whose order is another."""
    return float(np.square(cKDTree(points).query(frame)[0]).mean())


def _size(path: Path) -> int:
    return sum(each.stat().st_size for each in (path.rglob("*") if path.is_dir() else [path]) if each.is_file())


if __name__ == "__main__":
    main()
