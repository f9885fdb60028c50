"""Pictures that a text file names: found beside it, never outside its folder, and written beside it.

A path in a material file is not to be trusted: a file that is passed on would take along whatever it names. So pictures are
read from the folder of the mesh and below it alone. A picture that cannot be used is left out with a note, since the mesh is
whole without it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

from gvpipe.asset.material import Image
from gvpipe.foundation.errors import InputError
from gvpipe.io.fetching import fetch
from gvpipe.io.left_behind import LeftBehind

MAX_BYTES = 1 << 29  # of a picture file
UNSAFE = re.compile(r"[^\w. ()-]+")
SIGNATURES = {
    b"\x89PNG": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
    b"\xabKTX 20": "image/ktx2",
    b"\x76\x2f\x31\x01": "image/x-exr",
    b"BM": "image/bmp",
    b"GIF8": "image/gif",
    b"II*\0": "image/tiff",
    b"MM\0*": "image/tiff",
    b"DDS ": "image/vnd-ms.dds",
}
SUFFIXES = {
    "image/png": ".png",
    "image/jpeg": ".jpg",
    "image/webp": ".webp",
    "image/ktx2": ".ktx2",
    "image/x-exr": ".exr",
    "image/bmp": ".bmp",
    "image/gif": ".gif",
    "image/tiff": ".tif",
    "image/vnd-ms.dds": ".dds",
}


class Pictures:
    """The pictures that the materials of one mesh file show, each read once.

    Args:
        folder: of the mesh file.
    """

    def __init__(self, folder: Path) -> None:
        self.images: list[Image] = []
        self.notes: list[str] = []
        self.left = LeftBehind()  # statements of material files
        self._folder = folder
        self._numbers: dict[str, int | None] = {}
        self._paths: dict[Path, int] = {}

    def find(self, named: str, material: str) -> int | None:
        """The number of the image that a file names; None, and a note, if there is none to be used."""
        if named not in self._numbers:
            try:
                self._numbers[named] = self._number(find_beside(self._folder, named))
            except InputError as exc:
                self._numbers[named] = None
                self.notes.append(f"material {material!r} goes without its picture: {exc}")
        return self._numbers[named]

    def _number(self, path: Path) -> int:
        """The number of a file's image, which is read the first time."""
        if path not in self._paths:
            self.images.append(read_picture(path))
            self._paths[path] = len(self.images) - 1
        return self._paths[path]


def read_picture(path: Path) -> Image:
    """A file as an image; raises `InputError`."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path} has more than {MAX_BYTES >> 20} MB; make it smaller")
        data = path.read_bytes()
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the file") from exc
    kinds = (kind for signature, kind in SIGNATURES.items() if data.startswith(signature))
    return Image(path.stem, next(kinds, ""), data)


def find_beside(folder: Path, named: str) -> Path:
    """The file that a text names, relative to a folder.

    Raises:
        InputError: the path leaves the folder, or there is no such file.
    """
    parts = PureWindowsPath(named).parts  # takes both kinds of slashes
    if PurePosixPath(named).is_absolute() or PureWindowsPath(named).anchor or ".." in parts or "\0" in named:
        raise InputError(f"{named!r} lies outside of the folder {folder}; copy it there and name it without a path")
    path = folder
    for part in parts:
        path = _same_name(path, part)
    fetch(path)
    root = folder.resolve()
    try:
        is_inside, is_file = path.resolve().is_relative_to(root), path.is_file()
    except (OSError, ValueError, RuntimeError):
        is_inside, is_file = True, False
    if not is_file:
        raise InputError(f"there is no {named!r} beside the mesh, in {folder}; copy it there")
    if not is_inside:
        raise InputError(f"{named!r} is a link to outside of the folder {folder}; copy the file there")
    return path


def _same_name(folder: Path, name: str) -> Path:
    """A file or folder of that name; of the same name in other letters, as on Windows, where there is none."""
    if (folder / name).exists() or not folder.is_dir():
        return folder / name
    return next((path for path in sorted(folder.iterdir()) if path.name.lower() == name.lower()), folder / name)


def picture_names(images: Sequence[Image]) -> list[str]:
    """File names for images, all different."""
    names: list[str] = []
    for number, image in enumerate(images):
        stem = UNSAFE.sub("_", image.name).strip(". ") or f"image_{number}"
        suffix = SUFFIXES.get(image.media_type, ".bin")
        stem = stem.removesuffix(suffix)[:100]
        taken = {name.lower() for name in names}
        names.append(f"{stem}_{number}{suffix}" if f"{stem}{suffix}".lower() in taken else stem + suffix)
    return names
