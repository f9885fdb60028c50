"""Changes of HDF5 files by what they hold: a dataset's values, shape or type, an attribute, a link."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from fuzz.mutation import Rng, mutate_bytes

HDF = b"\x89HDF"
TYPES = ["<i1", "<u1", "<i4", "<i8", "<u8", "<f4", "<f8", "S4", ">f4", "?", "<c8"]
SHAPES = [(), (0,), (1,), (3,), (1, 3), (0, 3), (2, 2, 2), (5, 1)]


def mutate_hdf(data: bytes, rng: Rng) -> bytes:
    """One change: of what the file holds, or of its bytes."""
    if rng.random() < 0.4:
        return mutate_bytes(data, rng)
    import h5py

    file = io.BytesIO(data)
    try:
        with h5py.File(file, "r+") as held:
            _change(held, rng)
    except Exception:  # an earlier change may have left a file that h5py does not open
        return mutate_bytes(data, rng)
    return file.getvalue()


def _change(file: Any, rng: Rng) -> None:
    names: list[str] = []
    file.visit(names.append)
    name = names[int(rng.integers(len(names)))]
    item = file[name]
    if len(item.attrs) and rng.random() < 0.3:
        key = sorted(item.attrs)[int(rng.integers(len(item.attrs)))]
        item.attrs[key] = [0, -1, b"", "x", [1, 2, 3], 1e300, b"\xff\x1b", np.zeros((0,))][int(rng.integers(8))]
        return
    other = names[int(rng.integers(len(names)))]
    match int(rng.integers(5)):
        case 0:
            del file[name]
        case 1:
            del file[name]
            file[name] = np.zeros(SHAPES[int(rng.integers(len(SHAPES)))], TYPES[int(rng.integers(len(TYPES)))])
        case 2 if other != name:
            del file[name]
            file.copy(file[other], name)
        case _ if hasattr(item, "dtype") and item.dtype.kind in "iufSb" and item.size:
            values = np.asarray(item[()])
            changed = mutate_bytes(values.tobytes(), rng)[: values.nbytes].ljust(values.nbytes, b"\0")
            new = np.frombuffer(changed, values.dtype).reshape(values.shape)
            del file[name]
            file[name] = new
        case _:
            return
