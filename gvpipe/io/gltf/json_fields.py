"""Fields of a glTF document's JSON objects, with their types and ranges checked.

A file may hold anything in any place. So every field is read by one of these functions. Each raises a `ValueError` that names
the object and the field.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Float64

Json = dict[str, Any]

MOST = 2**53  # JSON integers beyond are not exact


def integer(owner: Json, key: str, where: str, default: int | None = None, least: int = 0, most: int = MOST) -> int:
    """An integer from ``least`` to ``most``; without a default it must be there."""
    value = owner.get(key, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)  # some exporters write 3.0
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{where}: {key!r} is {show(value) if key in owner else 'missing'}, and an integer is needed")
    if not least <= value <= most:
        raise ValueError(f"{where}: {key!r} is {value}, and {least} to {most} is possible")
    return value


def index(owner: Json, key: str, where: str, count: int) -> int | None:
    """An index of one of ``count`` things, None where there is none."""
    if key not in owner:
        return None
    value = integer(owner, key, where)
    if value >= count:
        raise ValueError(f"{where}: {key!r} is {value}, but there are only {count}")
    return value


def number(owner: Json, key: str, where: str, default: float) -> float:
    """A finite number."""
    return float(numbers(owner, key, where, [default], listed=False)[0])


def numbers(owner: Json, key: str, where: str, default: list[float], listed: bool = True) -> Float64:
    """As many finite numbers as ``default`` has."""
    given = owner.get(key, default)
    values = given if listed or key not in owner else [given]
    is_list = isinstance(values, list) and len(values) == len(default)
    if not is_list or not all(isinstance(value, int | float) and abs(value) <= 1e300 for value in values):
        needed = f"{len(default)} finite numbers are" if listed else "a finite number is"
        raise ValueError(f"{where}: {key!r} is {show(given)}, and {needed} needed")
    return np.array(values, np.float64)


def text(owner: Json, key: str, default: str = "") -> str:
    """A text; anything else counts as none."""
    value = owner.get(key)
    return value if isinstance(value, str) else default


def child(owner: Json, key: str, where: str) -> Json:
    """An object, empty where there is none."""
    value = owner.get(key, {})
    if not isinstance(value, dict):
        raise ValueError(f"{where}: {key!r} is {show(value)}, and an object is needed")
    return value


def extension(owner: Json, name: str, where: str) -> Json:
    """The object's extension of that name, empty where there is none."""
    return child(child(owner, "extensions", where), name, where)


def objects(owner: Json, key: str, where: str) -> list[Json]:
    """A list of objects, empty where there is none."""
    value = owner.get(key, [])
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        raise ValueError(f"{where}: {key!r} is not a list of objects")
    return value


def indices(owner: Json, key: str, where: str, count: int) -> list[int]:
    """A list of indices of some of ``count`` things, empty where there is none."""
    value = owner.get(key, [])
    if not isinstance(value, list) or not all(isinstance(one, int) and 0 <= one < count for one in value):
        raise ValueError(f"{where}: {key!r} is not a list of indices below {count}")
    return value


def flag(owner: Json, key: str) -> bool:
    """Whether a field is true."""
    return owner.get(key) is True


def rounded_up(value: float) -> int:
    """The smallest integer from a value on, which may exceed it by a thousandth."""
    return math.ceil(value - 1e-3)
