"""File names with a frame number in them, as programs write it: ``walk_%04d.obj``, ``walk_####.obj``, ``walk_$F4.obj``.

printf's form goes first: in ``C#_%04d.obj`` the ``#`` is a letter. In the other forms the number of ``#``, or the digit behind
``$F``, is what shorter numbers are padded to.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from gvpipe.foundation.errors import InputError

PRINTF = re.compile(r"%(?P<width>0\d+)?d")
HOUDINI = re.compile(r"\$F(?P<width>\d)?")
HASHES = re.compile(r"(?P<hashes>#+)")
INTEGER = re.compile(r"-?[0-9]+")


@dataclass(frozen=True)
class Pattern:
    """A file name with one ``%d`` or ``%04d`` in it, or the same in another form.

    Args:
        before, after: the text around the number.
        width: characters that shorter numbers are padded to; the sign is one of them, as in printf.
    """

    before: str
    after: str
    width: int

    def name(self, number: int) -> str:
        """The file name of one frame."""
        return f"{self.before}{number:0{self.width}d}{self.after}"

    def number(self, name: str) -> int | None:
        """The frame number of a file name, or None if it is not of this pattern; ``-5`` may be ``-005`` or ``-0005``."""
        digits = name[len(self.before) : len(name) - len(self.after)]
        if not INTEGER.fullmatch(digits):
            return None
        number = int(digits)
        spelt = {self.name(number)}
        if number < 0:
            spelt.add(f"{self.before}-{-number:0{self.width}d}{self.after}")
        return number if name in spelt else None


def match_pattern(path: str) -> Pattern | None:
    """The pattern in a path's file name, or None if there is none.

    Raises:
        InputError: several of them, or one in the folder's name.
    """
    folder, name = os.path.split(path)
    if PRINTF.search(folder) and not os.path.isdir(folder):
        raise InputError(f"{path}: the folder's name holds a %d; only the file's name can be numbered")
    for form in (PRINTF, HOUDINI, HASHES):
        found = list(form.finditer(name))
        if len(found) > 1:
            raise InputError(f"{path}: {len(found)} numbers in the pattern; keep one, such as %04d")
        if found:
            groups = found[0].groupdict()
            width = len(groups["hashes"]) if "hashes" in groups else int(groups["width"] or 0)
            return Pattern(name[: found[0].start()], name[found[0].end() :], width)
    return None
