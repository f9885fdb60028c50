"""File names as text and numbers in turn: what numbers they share, which of them vary, and how that sorts.

A hyphen before a number is a minus sign behind ``_``, ``.`` or nothing (``f_-5``). Elsewhere (``f-5``) it is one if only that
makes the names one series, as where ``f0`` is among them. It separates otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

UNSIGNED = re.compile(r"([0-9]+)")
CLEARLY_SIGNED = re.compile(r"((?:(?<=[_./\\])-|^-)?[0-9]+)")
SIGNED = re.compile(r"((?:(?<![0-9])-)?[0-9]+)")


def natural_key(name: str) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key that compares numbers in names as numbers: ``a2 < a10``, ``a < a1 < b``."""
    return _row_key(name_parts(name)), name


def signed_rows(files: Sequence[Path]) -> tuple[list[Path], list[list[str]]]:
    """The files in order and their `stem_parts`, hyphens taken for minus signs where they must be."""
    rows = [stem_parts(file, CLEARLY_SIGNED) for file in files]
    if len(set(map(shape, rows))) > 1:
        signed = [stem_parts(file, SIGNED) for file in files]
        rows = signed if len(set(map(shape, signed))) == 1 else [stem_parts(file) for file in files]
    ordered = sorted(zip(files, rows, strict=True), key=lambda pair: (_row_key(pair[1]), str(pair[0])))
    return [file for file, _ in ordered], [row for _, row in ordered]


def name_parts(name: str, numbers: re.Pattern[str] = UNSIGNED) -> list[str]:
    """A name as text and numbers in turn, without empty parts: ``a12_b -> ["a", "12", "_b"]``."""
    return [part for part in numbers.split(name) if part]


def stem_parts(file: Path, numbers: re.Pattern[str] = UNSIGNED) -> list[str]:
    """The parts of a file's path without its extension."""
    return name_parts(str(file.with_suffix("")), numbers)


def is_number(part: str) -> bool:
    """Whether a part is a number; text never ends in a digit."""
    return part[-1] in "0123456789"


def shape(row: Sequence[str]) -> str:
    """What names of one series share: ``["a", "12", "_b"] -> "a#_b"``."""
    return "".join("#" if is_number(part) else part for part in row)


def varying(rows: Sequence[list[str]]) -> list[int]:
    """Where rows of equal shape hold different numbers."""
    columns = enumerate(zip(*rows, strict=True))
    return [i for i, column in columns if is_number(column[0]) and len(set(map(int, column))) > 1]


def _row_key(row: Sequence[str]) -> list[tuple[int, int, str]]:
    return [(0, int(part), "") if is_number(part) else (1, 0, part.casefold()) for part in row]
