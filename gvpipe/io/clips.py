"""Clips of a file that has several animations: glTF's animations, FBX's takes."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from gvpipe.io.fbx.process import read_takes
from gvpipe.io.gltf import read_clips
from gvpipe.io.scene_formats import GLTF


class ClipRange(NamedTuple):
    """The name of a clip, as ``gvpipe.read(path, clip=...)`` takes it, and its first and last second."""

    name: str
    start: float
    stop: float


def list_clips(path: str) -> list[ClipRange]:
    """The clips of a glTF or FBX file, in its order; none for other files.

    Raises:
        InputError: the file cannot be read.
    """
    suffix = Path(path).suffix.lower()
    if not Path(path).is_file() or suffix not in (*GLTF, ".fbx"):
        return []
    return [ClipRange(*each) for each in (read_takes if suffix == ".fbx" else read_clips)(Path(path))]
