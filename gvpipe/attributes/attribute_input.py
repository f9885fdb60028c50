"""What users give as an attribute, checked: kinds, types, shapes, indices."""

from __future__ import annotations

import numpy as np

from gvpipe.attributes.corner_sharing import entries_of
from gvpipe.attributes.entry_layout import DOMAINS, count_values
from gvpipe.attributes.storage import MAX_COMPONENTS, TYPES
from gvpipe.attributes.surface import Surface
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.errors import InputError

KINDS = ("uv", "normal", "tangent", "color", "scalar", "vector", "label")


def check_attribute(
    values: Array, indices: Array | None, surface: Surface, domain: str, kind: str
) -> tuple[Array, Int32 | None]:
    """Return values ``(N, C)`` of a type that is stored, one for each vertex, triangle, part or entry, and entries of corners.

    Args are those of `gvpipe.attributes.attribute_coding.encode_attribute`.

    Raises:
        InputError: shapes, types or indices do not fit, or a number is not finite.
    """
    values = _check_values(np.asarray(values), kind)
    if domain not in DOMAINS:
        raise InputError(f"domain {domain!r}: it is one of {', '.join(DOMAINS)}")
    indices = np.arange(len(values)) if indices is None else np.asarray(indices)
    if indices.size and (int(indices.min()) < 0 or int(indices.max()) >= len(values)):
        raise InputError(f"{kind} indices {int(indices.min())}..{int(indices.max())}: there are {len(values)} values")
    if domain == "corner":
        corners = entries_of(indices, surface)
        rows = np.zeros(int(corners.max(initial=-1)) + 1, np.int64)
        rows[corners] = indices
        return np.ascontiguousarray(values[rows]), corners
    n = count_values(domain, surface)
    if indices.shape != (n,):
        raise InputError(f"{kind} has {len(indices)} values on domain {domain}: {n} are needed")
    return np.ascontiguousarray(values[indices]), None


def _check_values(values: Array, kind: str) -> Array:
    if kind not in KINDS:
        raise InputError(f"{kind!r}: kinds are {', '.join(KINDS)}")
    if values.dtype.kind == "f":
        values = values.astype(np.float32)
    if values.ndim != 2 or values.shape[1] > MAX_COMPONENTS or values.dtype.newbyteorder("=") not in TYPES:
        raise InputError(f"{kind} values {values.shape} {values.dtype}: a table of numbers is needed, at most 64 columns")
    if kind == "label" and values.dtype.kind == "f":
        raise InputError("labels are floating-point numbers; labels are integers")
    if values.dtype == np.uint64 and values.size and int(values.max()) >= 1 << 63:
        raise InputError(f"{kind} value {int(values.max())}: at most 2**63 - 1")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise InputError(f"{kind} value {row} is {values[row].tolist()}; replace what is not finite")
    return values
