"""An animated field on a mesh: numbers per frame and vertex, or per frame and triangle, loaded when they are read."""

from __future__ import annotations

import operator
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from gvpipe.asset.attribute import KINDS, MAX_COMPONENTS, as_numbers, check_kind, check_text, check_word
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError

DOMAINS = ("vertex", "triangle")  # of a surface
VOLUME_DOMAINS = ("point", "cell")  # of what lies inside of it


class FieldFrames(Protocol):
    """What a field's values must offer: a shape, a type, and slices of frames as arrays."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def dtype(self) -> Any: ...

    def __getitem__(self, key: slice, /) -> Array: ...


@dataclass(frozen=True, eq=False, repr=False)
class Field:
    """Animated numbers of a mesh: ``field[3]`` is one frame, ``field[10:20]`` ten of them.

    Args:
        values: ``(F, R)`` or ``(F, R, C)``, R vertices or triangles: an array, or anything of that shape that slices by
            frame. float32, float64 or integers of at most 32 bits. An array of float64 is rounded to float32, unless that
            moves a value by more than 1e-4 of the range (an absolute pressure of 101325 +- 1 Pa).
        domain: ``"vertex"`` or ``"triangle"``; of a `gvpipe.Volume` ``"point"`` or ``"cell"``.
        kind: as of `gvpipe.Attribute`; ``""``: scalar, or vector for several components.
        unit: such as ``"MPa"``.
        range: smallest and largest value, if they are known; of vectors, of all components.

    Raises:
        InputError: a shape, type, domain or kind that cannot be.

    Examples:
        >>> stress = Field(np.zeros((5, 4)), unit="MPa")
        >>> stress, stress[1:3].shape
        (<Field: 5 frames of 4 values, scalar per vertex, MPa>, (2, 4))
    """

    values: FieldFrames
    domain: str = "vertex"
    kind: str = ""
    unit: str = ""
    range: tuple[float, float] | None = None
    name: str = field(default="field", compare=False)

    def __post_init__(self) -> None:
        given: Any = self.values
        if isinstance(given, list | tuple):
            given = np.asarray(given)
        shape = tuple(getattr(given, "shape", ()))
        if len(shape) not in (2, 3) or min(shape) < 1 or (len(shape) == 3 and shape[2] > MAX_COMPONENTS):
            raise InputError(
                f"{self.name} has shape {shape}; (frames, rows) or (frames, rows, 1 to {MAX_COMPONENTS} components) is needed"
            )
        if np.dtype(given.dtype).kind not in "fiub" or np.dtype(given.dtype).name in ("int64", "uint64"):
            raise InputError(f"{self.name} has type {given.dtype}; floating-point numbers or integers of 32 bits are needed")
        object.__setattr__(self, "values", as_numbers(given, self.name) if isinstance(given, np.ndarray) else given)
        object.__setattr__(self, "kind", self.kind or ("vector" if len(shape) == 3 and shape[2] > 1 else "scalar"))
        check_word("domain", self.domain, (*DOMAINS, *VOLUME_DOMAINS), self.name)
        check_text(self.unit, f"unit of {self.name}")
        check_word("kind", self.kind, KINDS, self.name)
        check_kind(self.kind, np.zeros((1, self.n_components), self.dtype), self.name)

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, R)`` or ``(F, R, C)``, as it was given."""
        return tuple(self.values.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """The numbers' type: float32, float64 or integers."""
        given = np.dtype(self.values.dtype)
        if given.kind == "b":
            return np.dtype(np.uint8)
        return np.dtype(np.float32) if given.name == "float16" else given.newbyteorder("=")

    @property
    def n_components(self) -> int:
        """C, 1 for ``(F, R)``."""
        return self.shape[2] if len(self.shape) == 3 else 1

    @property
    def is_by_polygon(self) -> bool:
        """Whether it is known that all triangles of each polygon have the same numbers, as where a file has them by polygon."""
        return bool(getattr(self.values, "is_by_polygon", False))

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: int | slice, /) -> Array:
        if isinstance(key, slice):
            start, stop, step = key.indices(len(self))
            if step == 1:
                return self._shaped(self.read(start, max(start, stop)))
            rows = [self.read(i, i + 1) for i in range(start, stop, step)]
            return self._shaped(np.concatenate(rows) if rows else self.read(0, 0))
        index = operator.index(key)
        if not -len(self) <= index < len(self):
            raise IndexError(f"frame {index} of {self.name}: there are {len(self)}")
        index %= len(self)
        frame: Array = self._shaped(self.read(index, index + 1))[0]
        return frame

    def __repr__(self) -> str:
        unit = f", {self.unit}" if self.unit else ""
        return f"<Field: {len(self)} frames of {self.shape[1]} values, {self.kind} per {self.domain}{unit}>"

    def read(self, start: int, stop: int) -> Array:
        """Return frames ``start`` to ``stop`` with their components: ``(n, R, C)``; NaN and infinities as they are."""
        block = np.asarray(self.values[start:stop])
        with np.errstate(over="ignore"):
            block = np.ascontiguousarray(block, self.dtype)
        return block.reshape(len(block), self.shape[1], self.n_components)

    def part(self, start: int, stop: int) -> Field:
        """Return frames ``start`` to ``stop`` as a field; they still load when read."""
        return self._with(_Span(self, start, stop))

    def select(self, rows: Array) -> Field:
        """Return the field whose row i is this one's row ``rows[i]``; frames still load when read."""
        return self._with(_Rows(self, rows))

    def _with(self, values: FieldFrames) -> Field:
        return Field(values, self.domain, self.kind, self.unit, self.range, self.name)

    def _shaped(self, block: Array) -> Array:
        return block if len(self.shape) == 3 else block[:, :, 0]


def as_field(name: str, given: Any, n_frames: int, rows: dict[str, int], where: str) -> Field:
    """Return a field of a mesh whose domains have ``rows``; an array's domain follows from its number of rows.

    Raises:
        InputError: its frames or rows are not those of the sequence; else as `Field`.
    """
    label = f"{where}: field {name!r}"
    if isinstance(given, Field):
        made = given
    else:
        shape = tuple(getattr(given, "shape", np.shape(given)))
        domain = "triangle" if len(shape) > 1 and shape[1] == rows["triangle"] != rows["vertex"] else "vertex"
        made = Field(given, domain, name=label)
    if made.domain not in rows:
        raise InputError(f"{label} is per {made.domain}; a surface has fields per {' and '.join(DOMAINS)}")
    if made.shape[:2] != (n_frames, rows[made.domain]):
        raise InputError(
            f"{label} has shape {made.shape}; ({n_frames} frames, {rows[made.domain]} rows, one per {made.domain}) is needed"
        )
    return made


class _Span:
    """Some frames of a field, in a row."""

    def __init__(self, whole: Field, start: int, stop: int) -> None:
        self._whole, self._start = whole, start
        self.shape: tuple[int, ...] = (stop - start, *whole.shape[1:])
        self.dtype = whole.dtype
        self.is_by_polygon = whole.is_by_polygon

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        return self._whole[self._start + start : self._start + stop]


class _Rows:
    """Rows of a field, in another order."""

    def __init__(self, whole: Field, rows: Array) -> None:
        self._whole, self._rows = whole, rows
        self.shape: tuple[int, ...] = (len(whole), len(rows), *whole.shape[2:])
        self.dtype = whole.dtype

    def __getitem__(self, key: slice, /) -> Array:
        return self._whole[key][:, self._rows]
