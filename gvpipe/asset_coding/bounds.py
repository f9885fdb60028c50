"""How finely attributes and fields are kept: what a user asked for, and what holds where nothing was asked.

| kind | default |
| --- | --- |
| uv | 1/4 texel of the largest image, 1/8192 without images |
| normal, tangent | 1 degree |
| colours, labels, integers | exact |
| floats of which all are whole numbers below 2^24 | exact: they count or name something |
| others | 0.1 % of their range |
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.errors import SettingError

TEXELS = 0.25
UV = 1 / 8192
DEGREES = 1.0
PART = 1e-3  # of the range
KEEP_NAN, BY_LENGTH = "nan=keep", "by=length"  # behind a bound, each after a comma

Given = Mapping[str, float | str]


@dataclass(frozen=True)
class Precision:
    """How finely one attribute or field is kept.

    Args:
        is_kept: whether it is in the file at all.
        bound: largest error of a number (of each component), degrees for normals and tangents; 0: exact.
        holes: whether NaN is kept as it is.
    """

    is_kept: bool = True
    bound: float = 0.0
    holes: bool = False


NOT_KEPT = Precision(is_kept=False)


def precision(
    given: float | str | None,
    kind: str,
    is_float: bool,
    spread: float,
    texels: int,
    what: str,
    is_whole: bool = False,
    vectors: tuple[int, float] = (1, 0.0),
) -> Precision:
    """Return the precision of one attribute or field.

    Args:
        given: ``"none"``, ``"exact"``, a number, a part of the range such as ``"0.1%"``, each with ``",nan=keep"`` behind it
            if a field has holes, or ``",by=length"`` to bound the length of a vector's error, a part then of the longest; None:
            the default.
        kind: of the numbers.
        is_float: whether they are floating-point numbers.
        spread: largest less smallest value.
        texels: side of the largest image, 0 without images.
        what: it is, for messages.
        is_whole: whether all are whole numbers.
        vectors: components, and the length of the longest vector.

    Raises:
        SettingError: the text is none of these, or the bound is no number above 0.
    """
    text, *more = ("" if given is None else str(given).strip().lower()).split(",")
    holes, by_length = KEEP_NAN in more, BY_LENGTH in more
    if set(more) - {KEEP_NAN, BY_LENGTH}:
        raise SettingError(f"{what}: {given!r} cannot be a bound; behind a comma, {KEEP_NAN} or {BY_LENGTH} is needed")
    if text == "none":
        return NOT_KEPT
    if text == "exact" or (not text and (not is_float or is_whole or kind in ("color", "label"))):
        return Precision(holes=holes)
    if not text:
        return Precision(bound=_default(kind, spread, texels), holes=holes)
    bound = _parse(text, vectors[1] if by_length else spread, what)
    if by_length:
        bound /= math.sqrt(vectors[0])  # of each component
    return Precision(bound=bound if is_float else max(math.floor(bound), 0), holes=holes)


def check_names(given: Given, names: Iterable[str], what: str) -> None:
    """Raise `SettingError` for a bound of an attribute or field that the sequence does not have."""
    known = list(names)
    for name in given:
        if name not in known:
            there = f"there are {', '.join(known)}" if known else "there are none"
            raise SettingError(f"the sequence has no {what} {name!r}; {there}{did_you_mean(name, known)}")


def _default(kind: str, spread: float, texels: int) -> float:
    if kind in ("normal", "tangent"):
        return DEGREES
    if kind == "uv":
        return TEXELS / texels if texels else UV
    return PART * spread


def _parse(text: str, spread: float, what: str) -> float:
    try:
        bound = float(text.removesuffix("%")) * (spread / 100 if text.endswith("%") else 1.0)
    except ValueError:
        bound = math.nan
    if not math.isfinite(bound) or bound < 0 or (bound == 0 and not text.endswith("%")):
        raise SettingError(
            f"{what}: {text!r} cannot be a bound; a number above 0, a part of the range (0.1%), 'exact' or 'none' is needed"
        )
    return bound
