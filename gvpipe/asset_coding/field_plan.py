"""How finely a field is coded, on a surface or inside of it."""

from __future__ import annotations

from typing import NamedTuple

from gvpipe.asset.field import Field
from gvpipe.asset_coding.bounds import Precision, precision
from gvpipe.asset_coding.scan import Scan, scan_field
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.errors import InputError


class FieldPlan(NamedTuple):
    """A field, its precision, and what its values are."""

    field: Field
    found: Precision
    scan: Scan

    @property
    def bound(self) -> FieldBound:
        """What the section keeps, of numbers that are no directions."""
        return FieldBound(self.found.bound - self.scan.rounding) if self.found.bound else FieldBound(exact=True)


def plan_field(
    name: str,
    field: Field,
    given: float | str | None,
    where: str,
    *,
    texels: int = 0,
    polygons: Int32 | None = None,
    span: tuple[float, float] | None = None,
    place: str = "",
) -> tuple[FieldPlan | None, bool]:
    """Return how a field is coded, None if it is left out; and whether it is exact since all its numbers are whole.

    Args:
        name: of the field.
        field: to code.
        given: as for `gvpipe.asset_coding.bounds.precision`.
        where: the sequence's name, for messages.
        texels: side of the largest image.
        polygons: ``(P,)`` corners of the mesh's polygons, None if all are triangles.
        span: smallest and largest of the numbers that the same bound is for elsewhere.
        place: of the field, for messages.

    Raises:
        InputError: numbers that are not finite, or of digits that the bound does not keep.
        SettingError: `given` is no bound.
    """
    is_float, what = field.dtype.kind == "f", f"field {name!r}"
    asked = precision(given, field.kind, is_float, 1.0, texels, what, vectors=(1, 1.0))
    if not asked.is_kept:
        return None, False
    scan = scan_field(name, field, asked.holes, where, polygons)
    low, high = (scan.low, scan.high) if span is None else (min(scan.low, span[0]), max(scan.high, span[1]))
    is_whole = scan.is_whole and high > low
    vectors = (field.n_components, scan.longest)
    found = precision(given, field.kind, is_float, high - low, texels, what, is_whole, vectors)
    if scan.rounding > found.bound / 2:
        raise InputError(
            f"{where}: {place}field {name!r} is float64, and float32 rounds it by up to {scan.rounding:.2g} once "
            f"{scan.reduction.offsets} is subtracted; give it a bound of {2 * scan.rounding:.2g} or more by --field"
        )
    return FieldPlan(field, found, scan), is_whole and given is None
