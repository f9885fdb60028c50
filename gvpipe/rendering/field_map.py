"""A field as colours: which value each vertex or triangle has, on a scale that serves all frames that are drawn together."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Array, Float64, UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import used_vertices
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rendering.legend import paint_legend, round_ticks

SYMMETRIC = "symmetric"
Range = tuple[float, float] | str | None


class FieldMap:
    """The values of a field as parts of a range.

    Args:
        sequence: which has the field.
        name: of the field; one of several components is shown by its magnitude.
        frames: that are drawn.
        colors: a colour map, of `gvpipe.rasterizer.colormaps.COLORMAPS`.
        limits: the range's ends; ``"symmetric"``: about 0, to the largest absolute value; None: from the smallest value to the
            largest. Both of these count all finite values that are drawn.

    Raises:
        InputError: there is no such field or colour map; a range that cannot be.
    """

    def __init__(
        self, sequence: MeshSequence, name: str, frames: Sequence[int], colors: str = "viridis", limits: Range = None
    ) -> None:
        if name not in sequence.fields:
            known = f"there are: {', '.join(sequence.fields)}" if sequence.fields else "there are none"
            raise InputError(f"{sequence.name}: field {name!r} asked for; {known}{did_you_mean(name, sequence.fields)}")
        self._field: Field = sequence.fields[name]
        self._name, self._ramp = name, colormap(colors)
        self.limits = _checked(limits) if isinstance(limits, tuple) else self._limits_of(sequence, frames, limits)

    def numbers(self, frame: int) -> Float64:
        """``(R,)`` values, or magnitudes, of vertices or triangles; NaN where there is none."""
        block = self._field.read(frame, frame + 1)[0].astype(np.float64)
        if block.shape[1] == 1:
            return np.asarray(block[:, 0])
        return np.asarray(np.linalg.norm(block, axis=1))

    def values(self, frame: int) -> Float64:
        """Values as parts of the range: ``(V,)``, or ``(T, 1)`` of triangles; NaN where there is none."""
        low, high = self.limits
        numbers = self.numbers(frame)
        numbers[np.isinf(numbers)] = np.nan
        parts = (numbers - low) / (high - low) if high > low else np.where(np.isnan(numbers), np.nan, 0.5)
        return np.asarray(parts[:, None] if self._field.domain == "triangle" else parts)

    def legend(self, size: tuple[int, int]) -> UInt8:
        """Return a colour bar with its numbers: ``(H, w, 3) uint8``, the left edge of a picture of ``size`` (width, height).

        Raises:
            InputError: the picture is too small for it.
        """
        title = f"|{self._name}|" if self._field.n_components > 1 else self._name
        titles = [f"{title},", self._field.unit] if self._field.unit else ["", title]
        return paint_legend(size, titles, round_ticks(*self.limits), self._ramp)

    def _limits_of(self, sequence: MeshSequence, frames: Sequence[int], limits: str | None) -> tuple[float, float]:
        """Smallest and largest finite value of what is drawn; 0 and 0 where there is none."""
        if limits not in (None, SYMMETRIC):
            raise InputError(f"range {limits!r}; two numbers such as 0,250 or {SYMMETRIC!r} is needed")
        rows: Array | slice = used_vertices(sequence) if self._field.domain == "vertex" else slice(None)
        low, high = math.inf, -math.inf
        for frame in sorted(set(frames)):
            numbers = self.numbers(frame)[rows]
            numbers = numbers[np.isfinite(numbers)]
            low, high = min(low, float(numbers.min(initial=math.inf))), max(high, float(numbers.max(initial=-math.inf)))
        if low > high:
            return 0.0, 0.0
        largest = max(abs(low), abs(high))
        return (-largest, largest) if limits == SYMMETRIC else (low, high)


def parse_range(text: str) -> tuple[float, float] | str:
    """Return the ends of ``"0,250"``, or ``"symmetric"``.

    Raises:
        InputError: neither.
    """
    if text == SYMMETRIC:
        return text
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError as exc:
        raise InputError(f"range {text!r}; two numbers such as 0,250 or {SYMMETRIC!r} is needed") from exc
    return _checked((low, high))


def _checked(limits: tuple[float, ...]) -> tuple[float, float]:
    if len(limits) != 2 or not all(math.isfinite(end) for end in limits):
        raise InputError(f"a range of {limits}; two finite numbers are needed")
    low, high = float(limits[0]), float(limits[1])
    if not low < high:
        raise InputError(f"a range from {low:g} to {high:g}; the first number must be below the second")
    return low, high
