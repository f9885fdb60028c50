"""JSON objects of a file, read field by field, each checked against its type and its range."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import CorruptFile, corrupt_section, quote
from gvpipe.foundation.text import text_fault

BYTES_PER_CHARACTER = 32  # of parsed JSON, at most: "{}," is an object of 64 bytes and its place in a list
SECONDS_PER_CHARACTER = 0.2e-6


class JsonObject:
    """One JSON object; every read says what was wrong with it.

    Args:
        values: what `json.loads` returned.
        section: that it lies in, for messages.

    Raises:
        CorruptFile: here or later: it is no object, or a field is missing, of another type or out of range.

    Examples:
        >>> part = JsonObject({"name": "wheel", "vertices": [0, 8]}, "asset")
        >>> part.text("name"), part.integers("vertices", 2, 0, 100)
        ('wheel', (0, 8))
    """

    def __init__(self, values: Any, section: str) -> None:
        self.section = section
        if not isinstance(values, Mapping):
            raise self.corrupt("an object is missing")
        self._values = values

    @property
    def plain(self) -> dict[str, Any]:
        """Its values as they are, unchecked."""
        return dict(self._values)

    def __contains__(self, key: str) -> bool:
        return self._values.get(key) is not None

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; ``default`` where it is missing."""
        value = self._values.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(key, "a text")
        if fault := text_fault(value):
            raise self.corrupt(f"{key!r} {fault}")
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str | None = None) -> str:
        """Return one of some words."""
        value = self.text(key, default)
        if value not in choices:
            raise self.wrong(key, f"one of {', '.join(choices)}")
        return value

    def choices(self, key: str, count: int, choices: tuple[str, ...], default: Any = None) -> tuple[str, ...]:
        """Return ``count`` of some words."""
        words = self._list(key, default, count)
        if not all(word in choices for word in words):
            raise self.wrong(key, f"{count} of {', '.join(choices)}")
        return tuple(words)

    def flag(self, key: str, default: bool = False) -> bool:
        """Return true or false."""
        value = self._values.get(key, default)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        """Return a finite number in ``low..high``."""
        return self._number(key, self._values.get(key, default), low, high)

    def integer(self, key: str, low: int, high: int, default: int | None = None) -> int:
        """Return an integer in ``low..high``."""
        return self._integer(key, self._values.get(key, default), low, high)

    def numbers(self, key: str, count: int, low: float, high: float, default: Any = None) -> tuple[float, ...]:
        """Return ``count`` finite numbers in ``low..high``."""
        return tuple(self._number(key, value, low, high) for value in self._list(key, default, count))

    def integers(self, key: str, count: int, low: int, high: int) -> tuple[int, ...]:
        """Return ``count`` integers in ``low..high``."""
        return tuple(self._integer(key, value, low, high) for value in self._list(key, None, count))

    def integers_up_to(self, key: str, most: int, low: int, high: int) -> tuple[int, ...]:
        """Return at most ``most`` integers in ``low..high``; none where the key is missing."""
        given = self._values.get(key, [])
        if not isinstance(given, list) or len(given) > most:
            raise self.wrong(key, f"a list of at most {most}")
        return tuple(self._integer(key, value, low, high) for value in given)

    def object(self, key: str) -> JsonObject:
        """Return the object of a key."""
        return JsonObject(self._values.get(key), self.section)

    def objects(self, key: str, most: int) -> Iterator[JsonObject]:
        """Yield a list of objects, at most ``most`` of them; none where the key is missing."""
        given = self._values.get(key, [])
        if not isinstance(given, list) or len(given) > most:
            raise self.wrong(key, f"a list of at most {most}")
        return (JsonObject(value, self.section) for value in given)

    def texts(self, key: str, most: int) -> dict[str, str]:
        """Return texts by name; none where the key is missing."""
        given = self._values.get(key, {})
        if not isinstance(given, Mapping) or len(given) > most:
            raise self.wrong(key, f"an object of at most {most} texts")
        names = JsonObject(given, self.section)
        return {name: names.text(name) for name in given}

    def wrong(self, key: str, needed: str) -> CorruptFile:
        """Return the error of a field that is not what is needed."""
        return self.corrupt(f"{key!r} is {quote(self._values.get(key))}; {needed} is needed")

    def corrupt(self, what: str) -> CorruptFile:
        """Return the error that says ``what`` is wrong in this section."""
        return corrupt_section(self.section, what)

    def _list(self, key: str, default: Any, count: int) -> list[Any]:
        value = self._values.get(key, default)
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.wrong(key, f"a list of {count}")
        return list(value)

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise self.wrong(key, f"a number in {low}..{high}")
        return float(value)

    def _integer(self, key: str, value: Any, low: int, high: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.wrong(key, f"an integer in {low}..{high}")
        return value


def pack_json(values: Mapping[str, Any]) -> bytes:
    """Return an object as deflated JSON in UTF-8 (zlib)."""
    return zlib.compress(json.dumps(values, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode(), 9)


def unpack_json(
    data: bytes, section: str, most: int, budget: Budget = UNLIMITED, inflater: zlib._Decompress | None = None
) -> JsonObject:
    """Mirror of `pack_json`.

    Args:
        data: the section.
        section: its name.
        most: bytes that it may inflate to.
        budget: of the file.
        inflater: a fresh one, for what is not deflated as `pack_json` does.

    Raises:
        CorruptFile: it is not deflated JSON of an object, or larger.
        OverBudget: it inflates to more than the file may take.
    """
    room = min(most, budget.memory_left // BYTES_PER_CHARACTER)
    try:
        inflater = zlib.decompressobj() if inflater is None else inflater
        text = inflater.decompress(data, int(room) + 1)
        budget.ask(f"section {section!r}", BYTES_PER_CHARACTER * len(text), SECONDS_PER_CHARACTER * len(text))
        if len(text) > most or inflater.unconsumed_tail or not inflater.eof or inflater.unused_data:
            raise ValueError(f"more than {most} bytes, or cut short")
        return JsonObject(json.loads(text, parse_constant=_refuse, parse_float=_finite), section)
    except (ValueError, RecursionError, zlib.error) as exc:
        raise corrupt_section(section, f"it is not JSON as gvpipe writes it ({exc})") from exc


def _refuse(word: str) -> Any:
    raise ValueError(f"{word} is no number")


def _finite(digits: str) -> float:
    value = float(digits)
    if not math.isfinite(value):
        raise ValueError(f"{digits} is too large")
    return value
