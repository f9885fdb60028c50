"""Materials, textures, parts and metadata as what JSON holds, and back.

A dataclass becomes an object of its fields by name; fields at their default are left out, tuples are lists. Reading takes
nothing on trust: an unknown field, a wrong type or a list of another length is refused.
"""

from __future__ import annotations

import types
import typing
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.errors import InputError
from gvpipe.foundation.text import text_fault

LARGEST = float(np.finfo(np.float64).max)  # an integer of JSON may exceed it


def to_plain(value: Any) -> dict[str, Any]:
    """A dataclass of this package as an object.

    Examples:
        >>> from gvpipe.asset.material import Material, Texture
        >>> to_plain(Material("skin", roughness=0.5, base_color_texture=Texture(0)))
        {'name': 'skin', 'base_color_texture': {'image': 0}, 'roughness': 0.5}
    """
    given = ((one, getattr(value, one.name)) for one in fields(value))
    return {one.name: _plain(held) for one, held in given if not _is_default(one, held)}


def from_plain(kind: type[Any], given: Any, where: str) -> Any:
    """The dataclass ``kind`` that an object describes; texts in messages start with ``where``.

    Raises:
        InputError: it is no such object; or the dataclass refuses its values.
    """
    if not isinstance(given, dict):
        raise InputError(f"{where} is {_short(given)}; an object is needed")
    hints = _hints(kind)
    made: dict[str, Any] = {}
    for key, value in given.items():
        if key not in hints:
            raise InputError(f"{where} has {_short(key)}, which a {kind.__name__} has not")
        made[key] = _typed(hints[key], value, f"{where}: {key}")
    missing = [one.name for one in fields(kind) if one.name not in made and _has_no_default(one)]
    if missing:
        raise InputError(f"{where} lacks {missing[0]!r}")
    return kind(**made)


def _hints(kind: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _has_no_default(one: Field[Any]) -> bool:
    return one.default is MISSING and one.default_factory is MISSING


def _is_default(one: Field[Any], held: Any) -> bool:
    if one.default_factory is not MISSING:
        return bool(held == one.default_factory())
    return one.default is not MISSING and bool(held == one.default)


def _plain(held: Any) -> Any:
    if is_dataclass(held):
        return to_plain(held)
    if isinstance(held, tuple):
        return [_plain(each) for each in held]
    if isinstance(held, np.generic):
        return held.item()
    return dict(held) if isinstance(held, typing.Mapping) else held


def _typed(hint: Any, value: Any, where: str) -> Any:
    """A value of the type that a field is declared with."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType:
        return None if value is None else _typed(inner[0], value, where)
    if is_dataclass(hint):
        return from_plain(typing.cast(type[Any], hint), value, where)
    if origin is tuple:
        if inner[-1] is Ellipsis and isinstance(value, list):
            inner = (inner[0],) * len(value)
        if not isinstance(value, list) or len(value) != len(inner):
            raise InputError(f"{where} is {_short(value)}; {len(inner)} values are needed")
        return tuple(_typed(one, each, where) for one, each in zip(inner, value, strict=True))
    if origin is not None:  # a mapping of texts, which its dataclass checks
        if not isinstance(value, dict):
            raise InputError(f"{where} is {_short(value)}; an object of texts is needed")
        for name, text in value.items():
            fault = text_fault(name) or (text_fault(text, has_lines=True) if isinstance(text, str) else "")
            if fault:
                raise InputError(f"{where}: {_short(name)} {fault}; rename it")
        return value
    if hint is float:
        if type(value) not in (int, float) or not abs(value) <= LARGEST:
            raise InputError(f"{where} is {_short(value)}; a finite number is needed")
        return float(value)
    if type(value) is not hint or (hint is int and abs(value) >= 1 << 31):
        raise InputError(f"{where} is {_short(value)}; a value of type {hint.__name__} is needed")
    if hint is str and (fault := text_fault(value)):
        raise InputError(f"{where} {fault}; rename it")
    return value


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
