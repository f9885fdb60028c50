"""A field as colours: which value each vertex or triangle has, on a scale that serves all frames that are drawn together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Array, Float64, UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.grids.volume import Volume
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import used_vertices
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rendering.field_range import Ends, Range, checked_range, ends_of
from gvpipe.rendering.legend import log_ticks, paint_legend, round_ticks


class FieldMap:
    """The values of a field as parts of a range.

    Args:
        sequence: which has the field.
        name: of the field; one of several components is shown by its magnitude.
        frames: that are drawn.
        colors: a colour map, of `gvpipe.rasterizer.colormaps.COLORMAPS`.
        limits: the range's ends; percentiles, such as ``"2%,98%"``; ``"symmetric"``: about 0, to the largest absolute value;
            None: from the smallest value to the largest. All but the first count all finite values that are drawn
            (`gvpipe.rendering.field_range`).
        log: let colours follow the logarithm; values of 0 and below then count for nothing, and show as none.

    Raises:
        InputError: there is no such field or colour map; a range that cannot be; a log scale without a value above 0.
    """

    def __init__(
        self,
        sequence: MeshSequence,
        name: str,
        frames: Sequence[int],
        colors: str = "viridis",
        limits: Range = None,
        *,
        log: bool = False,
    ) -> None:
        self._field = _field_of(sequence, name)
        self._name, self._log, self._ramp = name, log, colormap(colors)
        by_vertex = self._field.domain == "vertex" and len(sequence.faces)
        self._rows: Array | slice = used_vertices(sequence) if by_vertex else slice(None)
        self.limits = self._limits_of(sequence, frames, limits)

    def numbers(self, frame: int) -> Float64:
        """``(R,)`` values, or magnitudes, of vertices or triangles; NaN where there is none."""
        frame = min(frame, len(self._field) - 1)
        return _lengths(self._field.read(frame, frame + 1)[0].astype(np.float64))

    def drawn(self, frame: int) -> Float64:
        """The numbers that a range counts: of vertices that triangles use, and on a log scale those above 0."""
        drawn: Float64 = self.numbers(frame)[self._rows]
        return drawn[drawn > 0] if self._log else drawn

    def values(self, frame: int) -> Float64:
        """Values as parts of the range: ``(V,)``, or ``(T, 1)`` of triangles; NaN where there is none."""
        parts = self._parts(self.numbers(frame))
        return np.asarray(parts[:, None] if self.domain == "triangle" else parts)

    def inside(self, volume: Volume, frame: int) -> Float64 | None:
        """The same of inner points ``(I,)``, or of cells ``(M,)`` for a field of triangles; None where there is none."""
        fields = volume.cell_fields if self.domain == "triangle" else volume.point_fields
        if self._name not in fields:
            return None
        field = fields[self._name]
        frame = min(frame, len(field) - 1)
        return self._parts(_lengths(field.read(frame, frame + 1)[0].astype(np.float64)))

    @property
    def domain(self) -> str:
        """``"vertex"`` or ``"triangle"``."""
        return self._field.domain

    def _parts(self, numbers: Float64) -> Float64:
        low, high = self.limits
        numbers[np.isinf(numbers)] = np.nan
        if self._log:
            low, high = np.log([low, high])
            numbers = np.log(numbers, out=np.full_like(numbers, np.nan), where=numbers > 0)
        return np.asarray((numbers - low) / (high - low) if high > low else np.where(np.isnan(numbers), np.nan, 0.5))

    def legend(self, size: tuple[int, int]) -> UInt8:
        """Return a colour bar with its numbers: ``(H, w, 3) uint8``, the left edge of a picture of ``size`` (width, height).

        Raises:
            InputError: the picture is too small for it.
        """
        title = f"|{self._name}|" if self._field.n_components > 1 else self._name
        titles = [f"{title},", self._field.unit] if self._field.unit else ["", title]
        ticks = log_ticks(*self.limits) if self._log else round_ticks(*self.limits)
        return paint_legend(size, titles, ticks, self._ramp)

    def _limits_of(self, sequence: MeshSequence, frames: Sequence[int], limits: Range) -> Ends:
        """The range's ends; 0 and 0 where no finite value is drawn."""
        wanted = checked_range(limits, log=self._log)
        if isinstance(wanted, tuple):
            return wanted
        found = ends_of(self.drawn, frames, wanted)
        if found is None and self._log:
            raise InputError(f"{sequence.name}: field {self._name!r} has no value above 0 to show; leave out the log scale")
        return found or (0.0, 0.0)


def _lengths(block: Float64) -> Float64:
    """Numbers ``(R, 1)`` as they are, lengths of vectors ``(R, C)``: ``(R,)``."""
    return np.asarray(block[:, 0] if block.shape[1] == 1 else np.linalg.norm(block, axis=1))


def _field_of(sequence: MeshSequence, name: str) -> Field:
    """The field of a name; static numbers of vertices or triangles are a field of one frame. Raises `InputError`."""
    if name in sequence.fields:
        found: Field = sequence.fields[name]
        return found
    still = {key: one for key, one in sequence.attributes.items() if one.domain in ("vertex", "triangle")}
    if name in still:
        return Field(np.asarray(still[name])[None], still[name].domain, unit=still[name].unit, name=f"attribute {name!r}")
    names = [*sequence.fields, *still]
    known = f"there are: {', '.join(names)}" if names else "there are none"
    raise InputError(f"{sequence.name}: field {name!r} asked for; {known}{did_you_mean(name, names)}")
