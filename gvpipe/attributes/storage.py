"""Values of an attribute as integers that are predicted, and back; each storage keeps a bound on the error.

| storage | codes | error |
| --- | --- | --- |
| INTEGERS | the values | none |
| FLOATS | bits of float32, ordered as the values are | none |
| STEPS | multiples of a step | at most the bound, in every component |
| DIRECTIONS | octahedral lattice points | at most the bound, an angle; lengths become 1, zero stays zero |
| TANGENTS | the same, and the sign of the fourth component | the same |
| RANKS | places among the distinct values | none |
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from gvpipe.attributes import octahedral
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Array, Float32, Int64, UInt64

INTEGERS, FLOATS, STEPS, DIRECTIONS, TANGENTS, RANKS = range(6)
TYPES = tuple(np.dtype(name) for name in ("f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"))
MAX_COMPONENTS = 64
MAX_CODE = 1 << 36  # magnitude of the codes of integers and steps
STEP = struct.Struct("<d")
FIRST = struct.Struct("<q")


@dataclass(frozen=True)
class Storage:
    """How codes become values.

    Args:
        id: one of the above.
        dtype: of the values, one of `TYPES`.
        n_components: C of the values.
        step: of STEPS, in the unit of the values.
        n: of the octahedral lattice.
        zeros: ``(Z,)`` rows that are zero and no direction.
        table: ``(D,)`` distinct values, ascending, of RANKS.
    """

    id: int
    dtype: np.dtype[np.generic]
    n_components: int
    step: float = 1.0
    n: int = 0
    zeros: Int64 | None = None
    table: Int64 | None = None


def store_integers(values: Array) -> tuple[Storage, Int64]:
    """Store integers ``(N, C)`` that int64 holds as they are, or, if they are large, as ranks."""
    if values.size and (int(values.max()) >= MAX_CODE or int(values.min()) <= -MAX_CODE):
        return store_ranks(values)
    return Storage(INTEGERS, values.dtype, values.shape[1]), values.astype(np.int64)


def store_ranks(values: Array) -> tuple[Storage, Int64]:
    """Store integers ``(N, C)`` that int64 holds by their ranks among the distinct ones."""
    table, ranks = np.unique(values.astype(np.int64), return_inverse=True)
    storage = Storage(RANKS, values.dtype, values.shape[1], table=table)
    return storage, ranks.reshape(values.shape).astype(np.int64)


def store_floats(values: Float32, bound: float) -> tuple[Storage, Int64]:
    """Store ``values (N, C)``, finite, within ``bound``, in their unit; 0: every bit."""
    for step in _steps(values, bound):
        codes = np.rint(values / step)
        restored = _from_steps(codes, step)
        if np.abs(restored - values.astype(np.float64)).max(initial=0.0) <= bound and np.abs(codes).max(initial=0) < MAX_CODE:
            return Storage(STEPS, values.dtype, values.shape[1], step=step), codes.astype(np.int64)
    keys = np.ascontiguousarray(values, np.float32).view(np.int32).astype(np.int64)
    return Storage(FLOATS, values.dtype, values.shape[1]), np.where(keys >= 0, keys, -keys - (1 << 31) - 1)


def store_directions(values: Float32, degrees: float, n: int | None = None) -> tuple[Storage, Int64]:
    """Store directions ``(N, 3)``, or tangents ``(N, 4)``, within an angle; every bit if that is too small, or 0.

    Args:
        values: finite; tangents whose fourth component is neither -1 nor 1 are stored as they are.
        degrees: bound.
        n: the lattice, instead of the coarsest that meets the bound.
    """
    is_tangent = values.shape[1] == 4
    if is_tangent and not (np.abs(values[:, 3]) == 1).all():
        return store_floats(values, 0.0)
    directions = values[:, :3].astype(np.float64)
    largest = np.abs(directions).max(axis=1, initial=0.0)
    zeros = np.flatnonzero(largest == 0)
    directions[zeros] = (0.0, 0.0, 1.0)
    largest[zeros] = 1.0
    directions /= largest[:, None]  # tiny ones have no square
    directions /= np.sqrt((directions**2).sum(axis=1, keepdims=True))
    n = octahedral.finest_needed(directions, degrees) if n is None else n
    if n > octahedral.MAX_N:
        return store_floats(values, 0.0)
    codes = octahedral.to_lattice(directions, n)
    if is_tangent:
        codes = np.concatenate([codes, values[:, 3:].astype(np.int64)], axis=1)
    return Storage(TANGENTS if is_tangent else DIRECTIONS, values.dtype, values.shape[1], n=n, zeros=zeros), codes


def restore(storage: Storage, codes: Int64, cursor: Cursor) -> Array:
    """Return the values ``(N, C)`` of ``codes``; raises `CorruptFile`, in the name of ``cursor``, for codes without a value."""
    if storage.id == FLOATS:
        return float_values(codes)
    if storage.id == STEPS:
        values = _from_steps(codes, storage.step)
        if not np.isfinite(values).all():
            raise cursor.corrupt("a value is not finite")
        return values
    if storage.id in (DIRECTIONS, TANGENTS):
        directions = octahedral.to_directions(codes[:, :3])
        directions[storage.zeros] = 0
        return np.concatenate([directions, codes[:, 3:].astype(np.float32)], axis=1)
    if storage.table is not None:
        if codes.min(initial=0) < 0 or codes.max(initial=-1) >= len(storage.table):
            raise cursor.corrupt("a rank is out of range")
        codes = storage.table[codes]
    limits = np.iinfo(np.dtype(storage.dtype).name)
    if codes.size and (int(codes.min()) < limits.min or int(codes.max()) > limits.max):
        raise cursor.corrupt(f"a value does not fit {storage.dtype}")
    return codes.astype(storage.dtype)


def float_values(codes: Int64) -> Float32:
    """The float32 values of the codes of FLOATS."""
    return np.where(codes >= 0, codes, -(codes + 1) - (1 << 31)).astype(np.int32).view(np.float32)


def pack_storage(storage: Storage) -> bytes:
    """Return the bytes of a storage."""
    head = bytes([storage.id, TYPES.index(storage.dtype)]) + varint(storage.n_components)
    if storage.id == STEPS:
        head += STEP.pack(storage.step)
    if storage.zeros is not None:
        gaps = np.diff(storage.zeros, prepend=-1) - 1
        head += varint(storage.n) + varint(len(gaps)) + (pack_block(encode_integers(gaps)) if len(gaps) else b"")
    if storage.table is not None:
        head += varint(len(storage.table))
        if len(storage.table):
            ordered = storage.table.view(np.uint64)
            distances: UInt64 = ordered[1:] - ordered[:-1] - np.uint64(1)
            low, high = (distances & np.uint64(0xFFFFFFFF)).astype(np.int64), (distances >> np.uint64(32)).astype(np.int64)
            head += FIRST.pack(int(storage.table[0])) + pack_block(encode_integers(low)) + pack_block(encode_integers(high))
    return head


def read_storage(cursor: Cursor, n_entries: int, wanted: int | None = None) -> Storage:
    """Mirror of `pack_storage`; raises `CorruptFile`, also where there are not as many components as ``wanted``."""
    number, type_number = cursor.take(2)
    if number > RANKS or type_number >= len(TYPES):
        raise cursor.corrupt("an attribute has an unknown storage")
    dtype = TYPES[type_number]
    if (dtype.kind == "f") != (number not in (INTEGERS, RANKS)):
        raise cursor.corrupt(f"an attribute of {dtype} is stored as what it is not")
    n_components = cursor.varint(MAX_COMPONENTS, "the number of components")
    if wanted is not None and n_components != wanted:
        raise cursor.corrupt(f"an attribute has {n_components} components; section 'asset' lists {wanted}")
    if number in (DIRECTIONS, TANGENTS) and n_components != number - DIRECTIONS + 3:
        raise cursor.corrupt(f"directions have {n_components} components")
    if number == STEPS:
        step = float(cursor.struct(STEP)[0])
        if not 0 < step < np.inf:
            raise cursor.corrupt("a step is out of range")
        return Storage(number, dtype, n_components, step=step)
    if number in (DIRECTIONS, TANGENTS):
        n = cursor.varint(octahedral.MAX_N, "the octahedral lattice")
        if n == 0:
            raise cursor.corrupt("the octahedral lattice has no points")
        return Storage(number, dtype, n_components, n=n, zeros=_read_zeros(cursor, n_entries))
    return Storage(
        number, dtype, n_components, table=_read_table(cursor, n_entries * n_components) if number == RANKS else None
    )


def _steps(values: Float32, bound: float) -> list[float]:
    """Steps that may keep the bound, the largest first: rounding to float32 may add half a unit in the last place."""
    largest = np.abs(values).max(initial=np.float32(0))
    spare = bound - float(np.spacing(largest)) / 2
    return [step for step in (2 * bound, 2 * bound * (1 - 1e-6), 2 * spare) if step > 0]


def _from_steps(codes: Array, step: float) -> Float32:
    with np.errstate(over="ignore"):
        return (codes.astype(np.float64) * step).astype(np.float32)


def _read_zeros(cursor: Cursor, n_entries: int) -> Int64:
    count = cursor.varint(n_entries, "the number of zero directions")
    if not count:
        return np.zeros(0, np.int64)
    gaps = decode_integers(cursor.block(), count, name=cursor.name)
    if gaps.min() < 0 or gaps.max() > n_entries or int((gaps + 1).sum()) > n_entries:
        raise cursor.corrupt("a zero direction is out of range")
    return np.cumsum(gaps + 1) - 1


def _read_table(cursor: Cursor, most: int) -> Int64:
    count = cursor.varint(most, "the number of distinct values")
    if not count:
        return np.zeros(0, np.int64)
    first = int(cursor.struct(FIRST)[0])
    low, high = (decode_integers(cursor.block(), count - 1, name=cursor.name) for _ in range(2))
    if count > 1 and (min(low.min(), high.min()) < 0 or max(low.max(), high.max()) >= 1 << 32):
        raise cursor.corrupt("a gap between values is out of range")
    total = (low.astype(np.float64) + 2.0**32 * high.astype(np.float64)).sum() + count
    gaps = (high.astype(np.uint64) << np.uint64(32)) + low.astype(np.uint64) + np.uint64(1)
    table = np.concatenate([np.array([first], np.int64).view(np.uint64), gaps]).cumsum(dtype=np.uint64).view(np.int64)
    if total > 2.0**64 or (table[1:] <= table[:-1]).any():
        raise cursor.corrupt("distinct values are out of range")
    return table
