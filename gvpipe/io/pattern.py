"""File names with a frame number in them, as printf writes it: ``walk_%04d.obj``, ``frame%d.obj``."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from gvpipe.errors import InputError

PRINTF = re.compile(r"%(0\d+)?d")


@dataclass(frozen=True)
class Pattern:
    """A file name with one ``%d`` or ``%04d`` in it.

    Args:
        before, after: the text around the number.
        width: digits that shorter numbers are padded to.
    """

    before: str
    after: str
    width: int

    def name(self, number: int) -> str:
        """The file name of one frame."""
        return f"{self.before}{number:0{self.width}d}{self.after}"

    def number(self, name: str) -> int | None:
        """The frame number of a file name, or None if it is not of this pattern."""
        digits = name[len(self.before) : len(name) - len(self.after)]
        matches = digits.isdecimal() and digits.isascii() and self.name(int(digits)) == name
        return int(digits) if matches else None


def match_pattern(path: str) -> Pattern | None:
    """The printf pattern in a path's file name, or None if there is none.

    Raises:
        InputError: several of them, or one in the folder's name.
    """
    folder, name = os.path.split(path)
    found = list(PRINTF.finditer(name))
    if PRINTF.search(folder) and not os.path.isdir(folder):
        raise InputError(f"{path}: the folder's name holds a %d; only the file's name can be numbered")
    if len(found) > 1:
        raise InputError(f"{path}: {len(found)} numbers in the pattern; keep one, such as %04d")
    if not found:
        return None
    return Pattern(name[: found[0].start()], name[found[0].end() :], int(found[0][1] or 0))
