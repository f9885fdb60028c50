"""Names of the clips of a glTF file."""

from __future__ import annotations

from pathlib import Path

from gvpipe.errors import InputError
from gvpipe.io.gltf import read_clip_names
from gvpipe.io.scene_formats import GLTF


def list_clips(path: str) -> list[str]:
    """The clips of a glTF file that ``gvpipe.read(path, clip=...)`` takes, in its order; none for other files.

    Raises:
        InputError: the file cannot be read.
    """
    if Path(path).suffix.lower() not in GLTF or not Path(path).is_file():
        return []
    try:
        return read_clip_names(Path(path))
    except ValueError as exc:
        raise InputError(f"{path} cannot be read: {exc}; export it again") from exc
