"""Which files are the frames, and in what order.

An input may be a folder, a glob, a pattern, one file or a list of files. File names are compared as text and numbers in
turn, so that ``frame2`` comes before ``frame10``. The number that varies is the frame number, wherever it stands. What is
not clearly one series without gaps is refused: a sequence put together wrongly plays, but wrongly.

A list is what a shell makes of a glob, sorted as text. If its names are one numbered series, it is ordered like the glob, and
gaps are refused. If they are not, or a file occurs twice, someone chose the order, and it is kept.
"""

from __future__ import annotations

import glob
import itertools
import os
import re
from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from pathlib import Path

from gvpipe.foundation import notes
from gvpipe.foundation.errors import InputError
from gvpipe.io.formats import FRAME_FORMATS, format_names
from gvpipe.io.frames.numbering import is_number, name_parts, natural_key, shape, signed_rows, stem_parts, varying
from gvpipe.io.frames.pattern import Pattern, match_pattern
from gvpipe.io.scene_formats import SCENE_SUFFIXES

GLOB_CHARACTERS = "*?["
Choose = Callable[[Sequence[Path], str], list[Path]]
LISTED = 3  # gaps, series and names spelt out in a message before it says "and more"


def find_frames(path: str) -> list[Path]:
    """Frame files of a folder, glob, pattern or single file, in frame order.

    Raises:
        InputError: nothing found, several formats or series, two files with one number, gaps in the numbering.
    """
    return _find(path, _of_one_format)


def find_files(path: str, suffixes: Sequence[str], noun: str) -> list[Path]:
    """The same of other files, by their suffixes; ``noun`` says what they are."""

    def choose(files: Sequence[Path], where: str) -> list[Path]:
        found = [file for file in files if file.suffix.lower() in suffixes]
        if not found:
            raise InputError(f"{where}: no {noun} is there; {noun}s may be {', '.join(suffixes)}")
        return found

    return _find(path, choose)


def _find(path: str, choose: Choose) -> list[Path]:
    """Files in frame order; ``choose`` returns those that count of what is found, or refuses them."""
    if os.path.isdir(path):
        return _order(choose(_list_folder(Path(path)), path), path)
    if os.path.exists(path):
        return choose([Path(path)], path)
    pattern = match_pattern(path)
    if pattern is not None:
        return _find_pattern(Path(path), pattern, choose)
    if any(character in path for character in GLOB_CHARACTERS):
        matches = [Path(match) for match in glob.glob(path, recursive=True)]
        files = [match for match in matches if match.is_file()]
        if not files:
            raise InputError(f"{path}: no file matches; check the path and put it in quotes")
        return _order(choose(files, path), path)
    raise InputError(f"{path}: no such file or folder; check the path")


def order_list(files: Sequence[Path]) -> tuple[list[Path], bool]:
    """Frame files of a list, in frame order, and whether that is the order given for want of a better one.

    Raises:
        InputError: a file that is not there, several formats, or gaps in what is one series.
    """
    if not files:
        raise InputError("the list of frame files is empty; give at least one")
    for file in files:
        if os.path.isdir(file):
            raise InputError(f"{file} is a folder among {len(files)} inputs; give one folder, or frame files")
        if not os.path.exists(file):
            raise InputError(f"{file}: no such file; check the path")
    files = _of_one_format(files, f"{files[0]} ...")
    if len(files) == 1 or len(set(files)) < len(files) or not _is_one_series(files):
        return files, len(files) > 1
    return _order(files, f"{files[0]} ..."), False


def sibling_note(path: Path) -> tuple[str, ...]:
    """What to say of a single file beside which others lie that differ in a number alone."""
    parts = stem_parts(Path(path.name))
    others = [file.name for file in _list_folder(path.parent)]
    for i in reversed(range(len(parts))):
        if not is_number(parts[i]):
            continue
        width = len(parts[i]) if parts[i].startswith("0") else 0
        pattern = Pattern("".join(parts[:i]), "".join(parts[i + 1 :]) + path.suffix, width)
        count = sum(pattern.number(name) is not None for name in others)
        if count > 1:
            mark = f"%0{width}d" if width > 1 else "%d"
            return (notes.one_of_many(path.name, count, str(path.parent / (pattern.before + mark + pattern.after))),)
    return ()


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
        scenes = "" if os.path.isdir(path) else f"; scenes {', '.join(SCENE_SUFFIXES)}"
        raise InputError(f"{path}: {held}; frames may be {format_names()}{scenes}")
    if len(counts) > 1:
        listed = " and ".join(f"{count} {suffix}" for suffix, count in sorted(counts.items()))
        folder = path if os.path.isdir(path) else str(meshes[0].parent)
        example = os.path.join(folder, "*" + counts.most_common(1)[0][0])
        raise InputError(f"{path}: {listed} files; keep one format or choose it with a glob such as '{example}'")
    return meshes


def _find_pattern(path: Path, pattern: Pattern, choose: Choose) -> list[Path]:
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
    files = choose([by_number[number] for number in numbers], str(path))
    _check_gaps(files, numbers, [pattern.name(number)[len(pattern.before) :][: pattern.width] for number in numbers])
    return files


def _order(files: list[Path], path: str) -> list[Path]:
    """Files in frame order, checked to be one series without gaps."""
    if len(files) == 1 or not any(re.search(r"[0-9]", file.stem) for file in files):
        return sorted(files, key=lambda file: natural_key(str(file)))  # a.obj, b.obj: nothing to count
    files, rows = signed_rows(files)
    by_shape = _group(files, [shape(row) for row in rows])
    if len(by_shape) > 1:
        raise _several_series(path, by_shape)
    numbers = varying(rows)
    if not numbers:  # frame1.obj and frame01.obj
        raise _same_number(files[0], files[1])
    series = _group(files, [tuple(int(row[i]) for i in numbers[:-1]) for row in rows])
    if len(series) == len(files):
        return files  # several numbers, no two files alike in all but the last: dates and times, not a count
    if len(series) > 1:
        raise _several_series(path, series)
    digits = [row[numbers[-1]] for row in rows]
    _check_gaps(files, [int(text) for text in digits], digits)
    return files


def _is_one_series(files: Sequence[Path]) -> bool:
    """Whether `_order` takes the files for one series, gaps aside."""
    _, rows = signed_rows(files)
    numbers = varying(rows) if len(set(map(shape, rows))) == 1 else []
    return bool(numbers) and len({tuple(int(row[i]) for i in numbers[:-1]) for row in rows}) in (1, len(files))


def _group(files: Sequence[Path], keys: Sequence[Hashable]) -> list[list[Path]]:
    """Files with equal keys together, the largest group first."""
    groups: dict[Hashable, list[Path]] = {}
    for file, key in zip(files, keys, strict=True):
        groups.setdefault(key, []).append(file)
    return sorted(groups.values(), key=len, reverse=True)


def _several_series(path: str, series: Sequence[list[Path]]) -> InputError:
    listed = ", ".join(f"{Path(_abstract(files, '#')).name} ({len(files)})" for files in series[:LISTED])
    more = f" and {len(series) - LISTED} more" if len(series) > LISTED else ""
    first = stem_parts(series[0][0])
    number = next((part for part in reversed(first) if is_number(part)), "")
    mark = f"%0{len(number)}d" if number.startswith("0") and len(number) > 1 else "%d"
    choice = _abstract(series[0], mark)
    return InputError(f"{path}: {len(series)} series of files, {listed}{more}; choose one, such as '{choice}'")


def _abstract(files: Sequence[Path], mark: str) -> str:
    """The path that the files of one series share, with a mark for the frame number."""
    rows = [stem_parts(file) for file in files]
    numbers = varying(rows) or [i for i, part in enumerate(rows[0]) if is_number(part)]
    name_starts = len(name_parts(str(files[0].parent)))
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
        width = len(digits[i]) if digits[i].lstrip("-").startswith("0") else 0
        missing = f"frame {numbers[i] + 1:0{width}d}"
        if steps[i] > 2:
            missing = f"frames {numbers[i] + 1:0{width}d} to {numbers[i + 1] - 1:0{width}d}"
        told.append(f"{missing} missing between {files[i].name} and {files[i + 1].name}")
    n_more = sum(steps[i] - 1 for i in gaps[LISTED:])
    more = f", and {n_more} more" if n_more else ""
    raise InputError(f"{', '.join(told)}{more}; export them again or renumber the files")
