"""Writing a mesh sequence, by the extension of the output."""

from __future__ import annotations

import os
from pathlib import Path

from gvpipe.container.sources import check_target
from gvpipe.foundation.errors import InputError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.frames.writer import write_frames
from gvpipe.io.late import late
from gvpipe.io.scene_formats import OPENVAT, WRITERS
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

SKIN_WRITER = late("gltf", "write_skinned")


def takes_skin(path: str) -> bool:
    """Whether a path is of a file that may have a skeleton."""
    return Path(path).suffix.lower() == ".glb" and match_pattern(path) is None and not os.path.isdir(path)


def write(sequence: MeshSequence, path: str | os.PathLike[str], start: int = 0, skin: Skin | None = None) -> tuple[str, ...]:
    """Write a mesh sequence; returns what the format cannot hold, a line each.

    Args:
        path: an ``.npz``, a scene (animated ``.glb``, ``.usda``, ``.usdc``, ``.usd``, ``.usdz``, ``.abc``), a point cache
            (``.pc2``, ``.mdd``, ``.npy``), a folder of vertex animation textures (``.openvat``), a pattern of frame files
            (``out/%04d.obj``) or a folder (existing, or ending in ``/``).
        start: number of the first frame file.
        skin: of the sequence, for a ``.glb``: its skeleton is written in place of morph targets.

    Raises:
        InputError: the path names no format that can be written.
        OutputError: a file cannot be written; nothing half-written is left.
    """
    path = os.fspath(path)
    check_target(path)
    suffix = Path(path).suffix.lower()
    if skin is not None:
        if not takes_skin(path):
            raise InputError(f"{path}: a skeleton is written as one .glb; give such a name, or leave the skin out")
        return tuple(SKIN_WRITER(sequence, skin, Path(path)))
    writer = WRITERS.get(suffix)
    # .glb may be a frame, too: of a pattern, or of a sequence of one
    is_frame = suffix in FRAME_FORMATS and (sequence.n_frames == 1 or match_pattern(path) is not None or os.path.isdir(path))
    is_folder = path.endswith(("/", os.sep)) and suffix != OPENVAT
    if writer is not None and not is_folder and not is_frame:
        return writer(sequence, Path(path)) or ()
    return write_frames(sequence, path, start)
