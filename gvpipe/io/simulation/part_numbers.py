"""Parts of a sequence in VTK's files: a number for each cell, and the names as texts of the whole file.

The cell array ``part (M,) int32`` has the number of each cell's part, and the text array ``part_names`` of the field data has
the names. What else is called ``part`` keeps its name: the numbers are ``part_2``, the names ``part_2_names``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.io.simulation.dataset import Dataset, field_data

PART = "part"
NUMBERS = re.compile(r"part(_\d+)?")
TEXT_END = "\0"  # what ends a text in VTK's files, so that no name holds it


def numbers_of_triangles(parts: Sequence[Part], n_triangles: int) -> Int32:
    """``(T,)`` the number of each triangle's part; zeros where there are no parts."""
    sizes = [part.triangles[1] - part.triangles[0] for part in parts]
    return np.repeat(np.arange(len(sizes), dtype=np.int32), sizes) if sizes else np.zeros(n_triangles, np.int32)


def names_of_parts(parts: Sequence[Part]) -> tuple[str, ...]:
    """The parts' names; one without a name where there are no parts."""
    return tuple(part.name.replace(TEXT_END, "") for part in parts) or ("",)


def free_key(taken: Collection[str]) -> str:
    """``part``, or ``part_2``, ``part_3`` ... where the names before are taken."""
    number = 2
    key = PART
    while key in taken:
        key, number = f"{PART}_{number}", number + 1
    return key


def key_note(key: str, format_name: str) -> tuple[str, ...]:
    """The note for numbers that are not called ``part``."""
    return () if key == PART else (f"{format_name}: {PART!r} is taken, so that the numbers of parts are called {key!r}",)


def names_key(key: str) -> str:
    """The name of the texts that belong to numbers."""
    return f"{key}_names"


def grid_runs(
    blocks: Sequence[tuple[str, int]], parts: Sequence[Part], flat_parts: Int32, n_cells: int
) -> tuple[Int32, tuple[str, ...], Int64]:
    """Number the runs of a grid's cells: blocks of volume cells, then parts of flat cells.

    Args:
        blocks: of the volume; none: its cells are of the one part that there is.
        parts: of the surface.
        flat_parts: ``(n,)`` the part of each flat cell, rising.
        n_cells: volume cells.

    Returns:
        ``(M,)`` numbers of the volume cells, the names of all runs, ``(parts,)`` the number of each part of flat cells.
    """
    all_names = names_of_parts(parts)
    inside = list(blocks) or [(all_names[0], n_cells)]
    names = [name for name, _ in inside]
    numbers = np.repeat(np.arange(len(inside), dtype=np.int32), [count for _, count in inside])
    of_part = np.zeros(len(all_names), np.int64)
    for part in np.unique(flat_parts).tolist():
        is_same = len(names) == len(inside) and names[-1] == all_names[part]  # volume and flat cells of one block
        if not is_same:
            names.append(all_names[part])
        of_part[part] = len(names) - 1
    return numbers, tuple(names), of_part


def with_blocks(step: Dataset, texts: Mapping[str, Callable[[], Sequence[str]]]) -> Dataset:
    """A step whose numbers of parts became blocks; the step as it is where it has no such numbers, no names, or they fall.

    Args:
        step: with the numbers among its cells', and the names among what is not carried.
        texts: by name; each is read when it is called for.

    Raises:
        ValueError: an array is damaged.
    """
    key = next((key for key in step.cell_data if NUMBERS.fullmatch(key) and names_key(key) in texts), None)
    if key is None:
        return step
    numbers, names = np.asarray(step.cell_data[key].read()), texts[names_key(key)]()
    numbers = numbers[:, 0] if numbers.ndim == 2 and numbers.shape[1] == 1 else numbers
    if not _are_runs(numbers, len(names)):
        return step
    counts = np.bincount(numbers.astype(np.int64), minlength=len(names)).tolist()
    return replace(
        step,
        cell_data={name: each for name, each in step.cell_data.items() if name != key},
        blocks=tuple(zip(names, counts, strict=True)),
        not_carried=tuple(name for name in step.not_carried if name != field_data(names_key(key))),
    )


def _are_runs(numbers: Array, n_names: int) -> bool:
    """Whether numbers are those of names, one run after the other."""
    if numbers.ndim != 1 or numbers.dtype.kind not in "iu" or not len(numbers):
        return False
    return bool(numbers[0] >= 0 and numbers[-1] < n_names and (numbers[1:] >= numbers[:-1]).all())
