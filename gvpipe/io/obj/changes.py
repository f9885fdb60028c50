"""Whether the frames of an OBJ sequence have materials of their own: a sequence keeps those of its first frame.

Scanners write a material file and a picture for each frame. The names of material files stand at the top of an OBJ file, so
that a few bytes of each frame tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gvpipe.foundation.errors import InputError
from gvpipe.io.obj.lines import decode_name
from gvpipe.io.pictures import find_beside

HEAD = 1 << 13  # bytes at the top of a frame


def have_changing_materials(files: Sequence[Path]) -> bool:
    """Whether material files of later frames differ from those of the first."""
    named = [libraries_of(path) for path in files] if len(files) > 1 else []
    others = [(path, names) for path, names in zip(files[1:], named[1:], strict=True) if names and names != named[0]]
    if not others:
        return False
    first = _contents(files[0], named[0])
    return any(_contents(path, names) != first for path, names in others)


def libraries_of(path: Path) -> tuple[str, ...]:
    """Names of the material files that the top of a frame names."""
    try:
        with open(path, "rb") as file:
            lines = file.read(HEAD).splitlines()
    except OSError:  # which is said when the frame is read
        return ()
    return tuple(decode_name(line.split(None, 1)[1]) for line in lines if line.startswith((b"mtllib ", b"mtllib\t")))


def _contents(path: Path, names: tuple[str, ...]) -> list[bytes]:
    found = []
    for name in names:
        try:
            found.append(find_beside(path.parent, name).read_bytes())
        except (InputError, OSError):  # a file that is not there
            found.append(b"")
    return found
