"""Which files are the frames, and in what order.

An input may be a folder, a glob, a printf pattern or one file. File names are compared as text and numbers in turn,
so that ``frame2`` comes before ``frame10``; the number that varies is the frame number, wherever it stands. What is
not clearly one series without gaps is refused: a sequence put together wrongly plays, but wrongly.
"""

from __future__ import annotations

import glob
import itertools
import os
import re
from collections import Counter
from collections.abc import Hashable, Sequence
from pathlib import Path

from gvpipe.errors import InputError
from gvpipe.io.formats import FRAME_FORMATS, format_names
from gvpipe.io.pattern import Pattern, match_pattern

GLOB_CHARACTERS = "*?["
LISTED = 3  # gaps, series and names spelt out in a message before it says "and more"


def find_frames(path: str) -> list[Path]:
    """Frame files of a folder, glob, pattern or single file, in frame order.

    Raises:
        InputError: nothing found, several formats or series, two files with one number, gaps in the numbering.
    """
    if os.path.isdir(path):
        return _order(_of_one_format(_list_folder(Path(path)), path), path)
    if os.path.exists(path):
        return _of_one_format([Path(path)], path)
    pattern = match_pattern(path)
    if pattern is not None:
        return _find_pattern(Path(path), pattern)
    if any(character in path for character in GLOB_CHARACTERS):
        matches = [Path(match) for match in glob.glob(path, recursive=True)]
        files = [match for match in matches if match.is_file()]
        if not files:
            raise InputError(f"{path}: no file matches; check the path and put it in quotes")
        return _order(_of_one_format(files, path), path)
    raise InputError(f"{path}: no such file or folder; check the path")


def natural_key(name: str) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key that compares numbers in names as numbers: ``a2 < a10``, ``a < a1 < b``."""
    parts = [(0, int(part), "") if part.isdecimal() else (1, 0, part.casefold()) for part in _parts(name)]
    return parts, name


def _parts(name: str) -> list[str]:
    """A name as text and numbers in turn, without empty parts: ``a12_b -> ["a", "12", "_b"]``."""
    return re.findall(r"[0-9]+|[^0-9]+", name)


def _list_folder(folder: Path) -> list[Path]:
    try:
        return [entry for entry in folder.iterdir() if not entry.name.startswith(".") and entry.is_file()]
    except OSError as exc:
        raise InputError(f"{folder} cannot be listed: {exc.strerror}; check its permissions") from exc


def _of_one_format(files: Sequence[Path], path: str) -> list[Path]:
    """The files that are meshes; all must be of one format."""
    meshes = [file for file in files if file.suffix.lower() in FRAME_FORMATS]
    counts = Counter(file.suffix.lower() for file in meshes)
    if not counts:
        held = f"none of its {len(files)} files is a mesh" if len(files) > 1 else "it is not a mesh"
        if not files:
            held = "the folder is empty"
        elif len(files) == 1 and files[0] != Path(path):
            held = f"{files[0].name} is not a mesh"
        raise InputError(f"{path}: {held}; frames may be {format_names()}")
    if len(counts) > 1:
        listed = " and ".join(f"{count} {suffix}" for suffix, count in sorted(counts.items()))
        folder = path if os.path.isdir(path) else str(meshes[0].parent)
        example = os.path.join(folder, "*" + counts.most_common(1)[0][0])
        raise InputError(f"{path}: {listed} files; keep one format or choose it with a glob such as '{example}'")
    return meshes


def _find_pattern(path: Path, pattern: Pattern) -> list[Path]:
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"{path}: no folder {folder}; check the path")
    by_number = {}
    for file in _list_folder(folder):
        number = pattern.number(file.name)
        if number is not None:
            by_number[number] = file
    if not by_number:
        raise InputError(f"{path}: no file such as {pattern.name(1)}; check the path and the number of digits")
    numbers = sorted(by_number)
    files = _of_one_format([by_number[number] for number in numbers], str(path))
    _check_gaps(files, numbers, [pattern.name(number)[len(pattern.before) :][: pattern.width] for number in numbers])
    return files


def _order(files: list[Path], path: str) -> list[Path]:
    """Files in frame order, checked to be one series without gaps."""
    files = sorted(files, key=lambda file: natural_key(str(file)))
    if len(files) == 1 or not any(re.search(r"[0-9]", file.stem) for file in files):
        return files  # a.obj, b.obj: nothing to count
    rows = [_stem_parts(file) for file in files]
    by_shape = _group(files, ["".join("#" if part.isdecimal() else part for part in row) for row in rows])
    if len(by_shape) > 1:
        raise _several_series(path, by_shape)
    varying = _varying(rows)
    if not varying:  # frame1.obj and frame01.obj
        raise _same_number(files[0], files[1])
    series = _group(files, [tuple(int(row[i]) for i in varying[:-1]) for row in rows])
    if len(series) == len(files):
        return files  # several numbers, no two files alike in all but the last: dates and times, not a count
    if len(series) > 1:
        raise _several_series(path, series)
    digits = [row[varying[-1]] for row in rows]
    _check_gaps(files, [int(text) for text in digits], digits)
    return files


def _stem_parts(file: Path) -> list[str]:
    return _parts(str(file.with_suffix("")))


def _varying(rows: Sequence[list[str]]) -> list[int]:
    """Where rows of equal shape hold different numbers."""
    columns = enumerate(zip(*rows, strict=True))
    return [i for i, column in columns if column[0].isdecimal() and len(set(map(int, column))) > 1]


def _group(files: Sequence[Path], keys: Sequence[Hashable]) -> list[list[Path]]:
    """Files with equal keys together, the largest group first."""
    groups: dict[Hashable, list[Path]] = {}
    for file, key in zip(files, keys, strict=True):
        groups.setdefault(key, []).append(file)
    return sorted(groups.values(), key=len, reverse=True)


def _several_series(path: str, series: Sequence[list[Path]]) -> InputError:
    listed = ", ".join(f"{Path(_abstract(files, '#')).name} ({len(files)})" for files in series[:LISTED])
    more = f" and {len(series) - LISTED} more" if len(series) > LISTED else ""
    first = _stem_parts(series[0][0])
    number = next((part for part in reversed(first) if part.isdecimal()), "")
    mark = f"%0{len(number)}d" if number.startswith("0") and len(number) > 1 else "%d"
    choice = _abstract(series[0], mark)
    return InputError(f"{path}: {len(series)} series of files, {listed}{more}; choose one, such as '{choice}'")


def _abstract(files: Sequence[Path], mark: str) -> str:
    """The path that the files of one series share, with a mark for the frame number."""
    rows = [_stem_parts(file) for file in files]
    numbers = _varying(rows) or [i for i, part in enumerate(rows[0]) if part.isdecimal()]
    name_starts = len(_parts(str(files[0].parent)))
    numbers = [i for i in numbers if i >= name_starts]
    if numbers:
        rows[0][numbers[-1]] = mark
    return "".join(rows[0]) + files[0].suffix


def _same_number(one: Path, other: Path) -> InputError:
    return InputError(f"{one.name} and {other.name} have the same number; remove one of them")


def _check_gaps(files: Sequence[Path], numbers: Sequence[int], digits: Sequence[str]) -> None:
    """Refuse missing numbers; a constant step over three or more files (every second frame, say) is no gap."""
    steps = [after - before for before, after in itertools.pairwise(numbers)]
    if 0 in steps:
        at = steps.index(0)
        raise _same_number(files[at], files[at + 1])
    if len(steps) > 1 and len(set(steps)) == 1:
        return
    gaps = [i for i, step in enumerate(steps) if step > 1]
    if not gaps:
        return
    told = []
    for i in gaps[:LISTED]:
        width = len(digits[i]) if digits[i].startswith("0") else 0
        missing = f"frame {numbers[i] + 1:0{width}d}"
        if steps[i] > 2:
            missing = f"frames {numbers[i] + 1:0{width}d} to {numbers[i + 1] - 1:0{width}d}"
        told.append(f"{missing} missing between {files[i].name} and {files[i + 1].name}")
    n_more = sum(steps[i] - 1 for i in gaps[LISTED:])
    more = f", and {n_more} more" if n_more else ""
    raise InputError(f"{', '.join(told)}{more}; export them again or renumber the files")
