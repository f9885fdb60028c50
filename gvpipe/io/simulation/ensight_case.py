"""EnSight Gold case files (.case, .encas): which file and which of its steps hold the geometry and each variable at a time.

Source: ANSYS, EnSight User Manual, "EnSight Gold casefile format".
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Float64

LARGEST_CASE = 64 << 20  # bytes
VARIABLE = re.compile(r"(scalar|vector|tensor symm|tensor asym) per (node|element):?\s*(.*)", re.IGNORECASE)
COMPONENTS = {"scalar": 1, "vector": 3, "tensor symm": 6, "tensor asym": 9}


@dataclass
class TimeSet:
    """Times, and the number that stands for each in file names."""

    times: Float64
    numbers: list[int]


@dataclass(frozen=True)
class Series:
    """Files of one thing over time.

    Args:
        pattern: file name, with ``*`` for the digits of a number.
        time_set, file_set: numbers of the sets, None: it stands still, or has a file per step.
    """

    pattern: str
    time_set: int | None
    file_set: int | None


@dataclass(frozen=True)
class Variable:
    """Numbers per node or per element."""

    name: str
    components: int
    per_node: bool
    series: Series


@dataclass
class Case:
    """A parsed case file."""

    model: Series | None = None
    variables: list[Variable] = field(default_factory=list)
    time_sets: dict[int, TimeSet] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)  # lines of the geometry and the materials that are not read

    def times(self) -> Float64 | None:
        """``(F,)`` of the steps: those of the set that the model or the first variable is in."""
        for series in (self.model, *(variable.series for variable in self.variables)):
            if series and series.time_set is not None and series.time_set in self.time_sets:
                return self.time_sets[series.time_set].times
        return None

    def place(self, series: Series, step: int) -> tuple[str, int | None]:
        """File name, and the step inside the file or None, of a series at a step of the case.

        Raises:
            ValueError: its time set has no such step.
        """
        if series.time_set is None:
            return series.pattern, None
        times = self.time_sets.get(series.time_set)
        if times is None:
            raise ValueError(f"it has no time set {series.time_set}")
        # a series of fewer steps keeps its last one
        number = min(step, len(times.times) - 1)
        if series.file_set is not None and "*" not in series.pattern:
            return series.pattern, number
        digits = series.pattern.count("*")
        if not digits:
            return series.pattern, None
        if number >= len(times.numbers):
            raise ValueError(f"time set {series.time_set} has no file number for step {number}")
        return re.sub(r"\*+", f"{times.numbers[number]:0{digits}d}", series.pattern, count=1), None


def parse_case(path: Path) -> Case:
    """Parse a case file; raises `ValueError`."""
    if path.stat().st_size > LARGEST_CASE:
        raise ValueError(f"it has {path.stat().st_size} bytes; a case file is a short text")
    lines = path.read_bytes().decode("latin-1").splitlines()
    if not any(line.strip() for line in lines):
        raise ValueError("the file is empty")
    case, section, at = Case(), "", 0
    sets: list[tuple[int, dict[str, list[str]]]] = []
    for line in lines:
        text = line.split("#")[0].strip()
        if text.upper() in ("FORMAT", "GEOMETRY", "VARIABLE", "TIME", "FILE", "MATERIAL", "BLOCK_CONTINUATION"):
            section = text.upper()
        elif section == "TIME" and text:
            _time_line(text, sets)
        elif text:
            at += 1
            _case_line(section, text, case)
    if not at or case.model is None:
        raise ValueError("it is not an EnSight case, or has no model")
    case.time_sets = {number: _time_set(number, found) for number, found in sets}
    return case


def _case_line(section: str, text: str, case: Case) -> None:
    key, _, rest = text.partition(":")
    if section == "FORMAT" and key.strip().lower() == "type":
        if "gold" not in rest.lower():
            raise ValueError(f"it is of type {rest.strip()[:40]!r}; 'ensight gold' is read")
    elif section == "GEOMETRY" and key.strip().lower() == "model":
        words = [
            word for word in rest.split() if word.lower() not in ("change_coords_only", "cstep", "changing_geometry_per_part")
        ]
        case.model, _ = _series(words, has_name=False)
    elif section == "GEOMETRY" or section == "MATERIAL":
        case.others.append(f"{section.lower()} {key.strip()!r}"[:60])
    elif section == "VARIABLE":
        found = VARIABLE.fullmatch(text)
        if found is None:
            words = rest.split()
            named = next((word for word in words if not word.isdigit()), "")
            case.skipped.append(f"{named} ({key.strip()})"[:60] if named else key.strip()[:60])
            return
        series, name = _series(found.group(3).split(), has_name=True)
        case.variables.append(Variable(name, COMPONENTS[found.group(1).lower()], found.group(2).lower() == "node", series))


def _series(words: list[str], has_name: bool) -> tuple[Series, str]:
    """Numbers of sets, the name of a variable, and a file name."""
    sets = []
    while words and words[0].isdigit() and len(words) > 1 + has_name:
        sets.append(int(words.pop(0)))
    if len(words) < 1 + has_name:
        raise ValueError("a line of its case names no file")
    name = words.pop(0) if has_name else ""
    return Series(words[0].strip('"'), sets[0] if sets else None, sets[1] if len(sets) > 1 else None), name


def _time_line(text: str, sets: list[tuple[int, dict[str, list[str]]]]) -> None:
    """A key and its numbers, or more numbers of the key before."""
    key, colon, rest = text.partition(":")
    key = key.strip().lower()
    if key == "time set":
        sets.append((int((rest.split() or ["1"])[0]), {}))
    elif colon and sets:
        sets[-1][1][key] = rest.split()
    elif sets and sets[-1][1]:
        sets[-1][1][list(sets[-1][1])[-1]] += text.split()


def _time_set(number: int, found: dict[str, list[str]]) -> TimeSet:
    times = np.array([float(word) for word in found.get("time values", [])], np.float64)
    count = int((found.get("number of steps") or ["0"])[0])
    if not len(times) or count != len(times):
        raise ValueError(f"time set {number} has {count} steps and {len(times)} times")
    if "filename numbers" in found:
        return TimeSet(times, [int(word) for word in found["filename numbers"]])
    start, step = (
        int((found.get(f"filename {key}") or [default])[0]) for key, default in (("start number", "0"), ("increment", "1"))
    )
    return TimeSet(times, [start + step * i for i in range(count)])
