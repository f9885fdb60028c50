"""A static attribute of a mesh: numbers per vertex, corner, triangle or part, with the values that rows share.

Face-varying data has one row per corner. Corners that share a value have the same index, so that a seam is where the corners of
a vertex have different indices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arguments import did_you_mean, show
from gvpipe.foundation.arrays import Array, Int32, Integers
from gvpipe.foundation.errors import InputError

DOMAINS = ("vertex", "corner", "triangle", "part")
KINDS = ("uv", "normal", "tangent", "color", "scalar", "vector", "label")
WIDTHS = {"uv": (2,), "normal": (3,), "tangent": (3, 4), "color": (3, 4)}  # components of a kind; others have any number
MAX_COMPONENTS = 64
MOST_ROUNDED = 1e-4  # part of the range by which float32 may round float64


@dataclass(frozen=True, eq=False)
class Attribute:
    """Static numbers of a mesh.

    `numpy.asarray` gives one row per element of the domain, ``(rows, C)``.

    Args:
        values: ``(N, C)``, or ``(N,)`` for one component. float32, or integers of any size; float64 is rounded to float32, and
            refused where that moves a value by more than 1e-4 of the range.
        domain: what has a row each: ``"vertex"``, ``"corner"`` (three per triangle), ``"triangle"`` or ``"part"``.
        kind: ``"uv"``, ``"normal"``, ``"tangent"``, ``"color"`` (float 0..1, or integers of full range), ``"scalar"``,
            ``"vector"`` or ``"label"`` (integers); ``""``: what name, type and number of components suggest.
        indices: ``(rows,) int32`` the value of each row; None: row i has value i.
        unit: of scalars and vectors, such as ``"MPa"``.

    Raises:
        InputError: a shape, type, domain or kind that cannot be, an index out of range, a value that is not finite.

    Examples:
        >>> seam = Attribute([[0, 0], [1, 0], [1, 1]], "corner", "uv", indices=[0, 1, 2, 2, 1, 0])
        >>> len(seam), np.asarray(seam).shape
        (6, (6, 2))
    """

    values: Array
    domain: str = "vertex"
    kind: str = ""
    indices: Int32 | None = None
    unit: str = ""
    name: str = field(default="attribute", compare=False)

    def __post_init__(self) -> None:
        values = as_values(self.values, self.name)
        if values.ndim == 1:
            values = values[:, None]
        if values.ndim != 2 or not 1 <= values.shape[1] <= MAX_COMPONENTS:
            raise InputError(f"{self.name} has shape {values.shape}; (values, 1 to {MAX_COMPONENTS} components) is needed")
        object.__setattr__(self, "values", values)
        check_word("domain", self.domain, DOMAINS, self.name)
        check_text(self.unit, f"unit of {self.name}")
        if self.kind:
            check_kind(self.kind, values, self.name)
        if self.indices is not None:
            object.__setattr__(self, "indices", _as_indices(self.indices, len(values), self.name))
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise InputError(f"{self.name}: value {bad[0]} is {values[bad[0]].tolist()}; finite numbers are needed")

    @property
    def shape(self) -> tuple[int, int]:
        """``(rows, C)``."""
        return (len(self), int(self.values.shape[1]))

    @property
    def dtype(self) -> np.dtype[Any]:
        """The numbers' type."""
        result: np.dtype[Any] = self.values.dtype
        return result

    def __len__(self) -> int:
        return len(self.values if self.indices is None else self.indices)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        rows = self.values if self.indices is None else self.values[self.indices]
        return np.array(rows, dtype) if copy else np.asarray(rows, dtype)

    def __getitem__(self, key: Any, /) -> Any:
        return np.asarray(self)[key]

    def tolist(self) -> list[list[Any]]:
        """Its rows as lists of numbers."""
        result: list[list[Any]] = np.asarray(self).tolist()
        return result

    def select(self, rows: Integers) -> Attribute:
        """Return the attribute whose row i is this one's row ``rows[i]``; values stay shared."""
        indices = rows if self.indices is None else self.indices[rows]
        return Attribute(self.values, self.domain, self.kind, np.asarray(indices, np.int32), self.unit, self.name)


def as_attribute(name: str, given: Any, rows: dict[str, int], where: str) -> Attribute:
    """Return an attribute of a mesh whose domains have ``rows``; an array's domain follows from its number of rows.

    Raises:
        InputError: no domain has that number of rows; else as `Attribute`.
    """
    label = f"{where}: attribute {name!r}"
    if isinstance(given, Attribute):
        if len(given) != rows[given.domain]:
            raise InputError(f"{label} has {len(given)} rows; {rows[given.domain]} are needed, one per {given.domain}")
        return given if given.kind else replace(given, kind=guess_kind(name, given.values))
    values = as_values(given, label)
    domain = next((domain for domain in DOMAINS if values.ndim and len(values) == rows[domain]), None)
    if domain is None:
        raise InputError(
            f"{label} has {len(values) if values.ndim else 'no'} rows; one per vertex ({rows['vertex']}), per corner "
            f"({rows['corner']}) or per triangle ({rows['triangle']}) is needed"
        )
    return Attribute(values, domain, guess_kind(name, values), name=label)


def guess_kind(name: str, values: Array) -> str:
    """The kind that a name and an array suggest: ``uv1 (N, 2)`` is a uv, one column of integers a label."""
    for kind, widths in WIDTHS.items():
        is_typed = kind == "color" or values.dtype.kind == "f"
        if name.lower().startswith(kind) and values.ndim == 2 and values.shape[1] in widths and is_typed:
            return kind
    if values.ndim == 1 or values.shape[1] == 1:
        return "label" if values.dtype.kind in "iu" else "scalar"
    return "vector"


def as_values(given: Any, name: str) -> Array:
    """An array of float32 or of integers; raises `InputError` for what is neither."""
    values = as_numbers(given, name)
    if values.dtype == np.float64:
        lost, spread = rounding_of([values])
        raise InputError(
            f"{name}: float32 would round its values by up to {lost:.2g} of a range of {spread:.2g}; subtract an offset first"
        )
    return values


def as_numbers(given: Any, name: str) -> Array:
    """As `as_values`, but float64 stays as it is where float32 does not do."""
    values = np.asarray(given)
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind not in "fiu":
        raise InputError(f"{name} has type {values.dtype}; numbers are needed")
    if values.dtype.kind != "f" or values.dtype == np.float32:
        return values
    if needs_float64([values]):
        return values.astype(np.float64, copy=False)
    with np.errstate(over="ignore", invalid="ignore"):
        return values.astype(np.float32)


SMALLEST_FLOAT32 = 2.0**-149


def needs_float64(blocks: Sequence[Array]) -> bool:
    """Whether float32 would move a value by more than 1e-4 of the range of all ``blocks``.

    What float32 rounds to zero does not count: programs that leave memory as it is write such numbers, as of 1e-308.
    """
    lost, spread = rounding_of(blocks)
    return bool(np.isfinite(lost)) and lost > SMALLEST_FLOAT32 and lost > MOST_ROUNDED * spread > 0


def rounding_of(blocks: Sequence[Array]) -> tuple[float, float]:
    """By how much float32 moves values of ``blocks`` at most, and their range; NaN left out."""
    lost, low, high = 0.0, np.inf, -np.inf
    with np.errstate(over="ignore", invalid="ignore"):
        for values in (each for each in blocks if each.size):
            lost = max(lost, float(np.nanmax(np.abs(values - values.astype(np.float32)), initial=0.0)))
            low = min(low, float(np.fmin.reduce(values, axis=None)))
            high = max(high, float(np.fmax.reduce(values, axis=None)))
    return lost, high - low


def check_word(what: str, word: object, words: tuple[str, ...], name: str) -> None:
    """Raise `InputError` unless ``word`` is one of ``words``."""
    if word not in words:
        raise InputError(f"{name}: {what} {word!r}; one of {', '.join(words)} is needed{did_you_mean(word, words)}")


def check_text(value: object, role: str) -> None:
    """Raise TypeError unless ``value`` is a text."""
    if not isinstance(value, str):
        raise TypeError(f"{role} is {show(value)}; a text is needed")


def check_kind(kind: str, values: Array, name: str) -> None:
    """Raise `InputError` unless ``values (..., C)`` can be of that kind."""
    check_word("kind", kind, KINDS, name)
    widths = WIDTHS.get(kind)
    if widths and values.shape[-1] not in widths:
        needed = " or ".join(map(str, widths))
        raise InputError(f"{name} has {values.shape[-1]} components; a {kind} has {needed}")
    if kind == "label" and values.dtype.kind not in "iu":
        raise InputError(f"{name} has type {values.dtype}; labels are integers")
    if kind in ("uv", "normal", "tangent") and values.dtype.kind != "f":
        raise InputError(f"{name} has type {values.dtype}; a {kind} is of floating-point numbers")


def _as_indices(given: Any, n_values: int, name: str) -> Int32:
    indices = np.asarray(given)
    if indices.ndim != 1 or (indices.size and indices.dtype.kind not in "iu"):
        raise InputError(f"{name}: indices are {show(given)}; (rows,) integers are needed")
    out = np.flatnonzero((indices < 0) | (indices >= n_values))
    if len(out):
        raise InputError(f"{name}: index {out[0]} is {indices[out[0]]}; there are values 0..{n_values - 1}")
    return np.ascontiguousarray(indices, np.int32)
