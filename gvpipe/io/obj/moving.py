"""Pictures of OBJ frames that have material files of their own: one row for each image of the first frame.

Scanners write a material file and a picture for each frame. Where the materials of a frame are those of the first but for the
pictures' paths, these are a moving image. A picture that does not change stays an image as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from gvpipe.asset.material import Image, Material
from gvpipe.foundation.errors import InputError
from gvpipe.io.obj.changes import libraries_of
from gvpipe.io.obj.lines import decode_name
from gvpipe.io.obj.mtl import names_in, read_mtl
from gvpipe.io.picture_files import FilePictures
from gvpipe.io.pictures import Pictures, find_beside


class Moving(NamedTuple):
    """Images of a sequence, and notes on frames without a picture."""

    images: tuple[Image, ...]
    notes: tuple[str, ...]


class _Paths(Pictures):
    """The paths of pictures, in place of their bytes."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.paths: list[Path] = []

    def _number(self, path: Path) -> int:
        if path not in self.paths:
            self.paths.append(path)
        return self.paths.index(path)


def moving_images(
    files: Sequence[Path], materials: Sequence[Material], images: Sequence[Image], start: int = 0
) -> Moving | None:
    """Return the images of all frames; None where materials change in more than their pictures, or nothing moves.

    A frame whose picture is not there shows that of the frame before, and a note names it.

    Args:
        files: of all frames.
        materials, images: of the first frame.
        start: number of the first frame, for messages.

    Raises:
        InputError: a picture has another size than the first.
    """
    if not images or len(files) < 2:
        return None
    named = [libraries_of(path) for path in files]
    if all(names in (named[0], ()) for names in named):
        return None
    first = _looks(files[0], named[0], [material.name for material in materials])
    if first is None or len(first[1]) != len(images):
        return None
    rows = [[path] for path in first[1]]
    notes = []
    for frame, (path, names) in enumerate(zip(files[1:], named[1:], strict=True), 1):
        looks = _looks(path, names, [material.name for material in materials])
        if looks is None or not _alike(looks[0], first[0], len(looks[1]) == len(rows)):
            return None
        if len(looks[1]) != len(rows):
            notes.append(f"frame {start + frame} shows the picture of the frame before: {looks[2] or path.name}")
        for number, row in enumerate(rows):
            row.append(looks[1][number] if len(looks[1]) == len(rows) else row[-1])
    moving = tuple(
        replace(image, data=b"", pictures=FilePictures(row, start)) if _changes(row, image) else image
        for image, row in zip(images, rows, strict=True)
    )
    return Moving(moving, tuple(notes)) if any(image.is_moving for image in moving) else None


def _looks(path: Path, libraries: Sequence[str], wanted: Sequence[str]) -> tuple[list[Material], list[Path], str] | None:
    """A frame's materials, the paths of their pictures, and why one is missing; None where they are not those of the first."""
    texts = []
    for library in libraries:
        try:
            texts.append(decode_name(find_beside(path.parent, library).read_bytes()))
        except (InputError, OSError):
            return None
    there = [name for text in texts for name in names_in(text)]
    names = list(wanted) if set(wanted) <= set(there) else there
    if len(names) != len(wanted):
        return None
    paths = _Paths(path.parent)
    found = [material for text in texts for material in read_mtl(text, paths, names)]
    if len(found) != len(wanted):
        return None
    return found, paths.paths, "; ".join(paths.notes)


def _alike(materials: Sequence[Material], first: Sequence[Material], is_whole: bool) -> bool:
    """Whether materials are the same but for their names, and for textures unless all pictures are there."""
    pairs = zip(materials, first, strict=True)
    return all(_bare(one, is_whole) == _bare(other, is_whole) for one, other in pairs)


def _bare(material: Material, is_whole: bool) -> Material:
    gone: dict[str, Any] = {} if is_whole else dict.fromkeys(material.textures)
    return replace(material, name="", **gone)


def _changes(row: Sequence[Path], image: Image) -> bool:
    """Whether a row has another picture than the first somewhere."""
    others = [path for path in dict.fromkeys(row) if path != row[0]]
    return any(path.stat().st_size != len(image.data) or path.read_bytes() != image.data for path in others)
