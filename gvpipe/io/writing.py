"""Writing a mesh sequence, by the extension of the output."""

from __future__ import annotations

import os
from pathlib import Path

from gvpipe.container.sources import check_target
from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.frames.writer import write_frames
from gvpipe.io.late import late
from gvpipe.io.scene_formats import OPENVAT, WRITERS
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

SKIN_WRITER = late("gltf", "write_skinned")
GLB_WRITER = late("gltf", "write_animated")
COMPRESSIONS = ("none", "meshopt")


def is_glb(path: str) -> bool:
    """Whether a path is of one .glb, which may have a skeleton and be compressed."""
    return Path(path).suffix.lower() == ".glb" and match_pattern(path) is None and not os.path.isdir(path)


def write(
    sequence: MeshSequence, path: str | os.PathLike[str], start: int = 0, skin: Skin | None = None, compress: str = "none"
) -> tuple[str, ...]:
    """Write a mesh sequence; returns what the format cannot hold, a line each.

    Args:
        path: an ``.npz``, a scene (animated ``.glb``, ``.usda``, ``.usdc``, ``.usd``, ``.usdz``, ``.abc``), a point cache
            (``.pc2``, ``.mdd``, ``.npy``), a folder of vertex animation textures (``.openvat``), a pattern of frame files
            (``out/%04d.obj``) or a folder (existing, or ending in ``/``).
        start: number of the first frame file.
        skin: of the sequence, for a ``.glb``: its skeleton is written in place of morph targets.
        compress: ``"meshopt"``: a ``.glb`` in fewer bytes, by EXT_meshopt_compression; or ``"none"``.

    Raises:
        InputError: the path names no format that can be written, or none that has a skeleton or a compression.
        OutputError: a file cannot be written; nothing half-written is left.
    """
    path = os.fspath(path)
    check_target(path)
    suffix = Path(path).suffix.lower()
    if compress not in COMPRESSIONS:
        raise SettingError(f"compress is {show(compress)}; {' or '.join(map(repr, COMPRESSIONS))} is needed")
    is_packed = compress != "none"
    if (skin is not None or is_packed) and not is_glb(path):
        what, option = ("a skeleton", "skin") if skin is not None else ("a compressed file", "compression")
        raise InputError(f"{path}: {what} is written as one .glb; give such a name, or leave the {option} out")
    if skin is not None:
        return tuple(SKIN_WRITER(sequence, skin, Path(path), is_packed))
    if is_packed:
        return tuple(GLB_WRITER(sequence, Path(path), is_packed))
    writer = WRITERS.get(suffix)
    # .glb may be a frame, too: of a pattern, or of a sequence of one
    is_frame = suffix in FRAME_FORMATS and (sequence.n_frames == 1 or match_pattern(path) is not None or os.path.isdir(path))
    is_folder = path.endswith(("/", os.sep)) and suffix != OPENVAT
    if writer is not None and not is_folder and not is_frame:
        return writer(sequence, Path(path)) or ()
    return write_frames(sequence, path, start)
