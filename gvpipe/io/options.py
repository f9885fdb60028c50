"""What a user may say about reading a file."""

from __future__ import annotations

import os
from dataclasses import dataclass


@dataclass(frozen=True)
class ReadOptions:
    """What a user may say about reading a file; formats ignore what does not concern them.

    Args:
        fps: frames per second, instead of the file's.
        clip: name of the animation, of files that hold several; None: the first.
        mesh: a file with the mesh, for formats that hold positions alone (point caches).
    """

    fps: float | None = None
    clip: str | None = None
    mesh: str | os.PathLike[str] | None = None


NO_OPTIONS = ReadOptions()
