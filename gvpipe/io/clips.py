"""Names of the clips of a file, of formats that hold several."""

from __future__ import annotations

from pathlib import Path

from gvpipe.errors import InputError
from gvpipe.io.gltf import read_clip_names
from gvpipe.io.scene_formats import HAVE_CLIPS


def list_clips(path: str) -> list[str]:
    """The clips that ``gvpipe.read(path, clip=...)`` takes, in the file's order; none for formats without.

    Raises:
        InputError: the file cannot be read.
    """
    if Path(path).suffix.lower() not in HAVE_CLIPS or not Path(path).is_file():
        return []
    try:
        return read_clip_names(Path(path))
    except ValueError as exc:
        raise InputError(f"{path} cannot be read: {exc}; export it again") from exc
