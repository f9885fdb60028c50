"""Writing a mesh sequence, by the extension of the output."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from gvpipe.container.sources import check_target
from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.frames.writer import write_frames
from gvpipe.io.late import late
from gvpipe.io.scene_formats import OPENVAT, USD, WRITERS
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

SKIN_WRITER = late("gltf", "write_skinned")
USD_SKIN_WRITER = late("usd.writer", "write_usd")
GLB_WRITER = late("gltf", "write_animated")
VTU_WRITER = late("simulation.vtu_writer", "write_vtu")
HOLD_VOLUMES = (".vtu", ".pvd", ".vtkhdf", ".xdmf")
HOLD_MOVING = (".obj", "", *USD)
HOLD_PICTURES = (".npz", ".glb", ".gltf", ".ply", ".openvat")
STILL = "{} has no textures that move: each shows the picture of its first frame; --texture-out writes them as a video"
COMPRESSIONS = ("none", "meshopt", "draco")


def is_glb(path: str) -> bool:
    """Whether a path is of one .glb, which may be compressed."""
    return _is_one(path, (".glb",))


def takes_skin(path: str) -> bool:
    """Whether a path is of one file that may have a skeleton."""
    return _is_one(path, (".glb", *USD))


def _is_one(path: str, suffixes: tuple[str, ...]) -> bool:
    return Path(path).suffix.lower() in suffixes and match_pattern(path) is None and not os.path.isdir(path)


def check_skin(sequence: MeshSequence, skin: Skin, path: str) -> None:
    """Raise `InputError` unless a skin is of a sequence's vertices and frames."""
    shape = (sequence.n_frames, sequence.n_vertices)
    if (skin.n_frames, len(skin.bind)) != shape:
        raise InputError(
            f"{path}: the skin has {skin.n_frames} frames of {len(skin.bind)} vertices, the sequence {shape[0]} of {shape[1]}; "
            f"give the skin that was made of it"
        )


def write(
    sequence: MeshSequence, path: str | os.PathLike[str], start: int = 0, skin: Skin | None = None, compress: str = "none"
) -> tuple[str, ...]:
    """Write a mesh sequence; returns what the format cannot hold, a line each.

    Args:
        path: an ``.npz``, a scene (animated ``.glb``, ``.usda``, ``.usdc``, ``.usd``, ``.usdz``, ``.abc``), a point cache
            (``.pc2``, ``.mdd``, ``.npy``), a folder of vertex animation textures (``.openvat``), a pattern of frame files
            (``out/%04d.obj``) or a folder (existing, or ending in ``/``).
        start: number of the first frame file.
        skin: of the sequence, for a ``.glb`` or USD: its skeleton is written in place of morph targets or sampled points.
        compress: of a ``.glb``: ``"meshopt"``, in fewer bytes by EXT_meshopt_compression; ``"draco"``, its meshes by
            KHR_draco_mesh_compression; or ``"none"``.

    Raises:
        InputError: the path names no format that can be written, or none that has a skeleton or a compression.
        OutputError: a file cannot be written; nothing half-written is left.
        SettingError: a compression that is not known.
    """
    path = os.fspath(path)
    check_target(path)
    suffix = Path(path).suffix.lower()
    if compress not in COMPRESSIONS:
        raise SettingError(f"compress is {show(compress)}; 'none', 'meshopt' or 'draco' is needed")
    if sequence.sound is not None:
        left = "the sound is left out, for which mesh files have no place; gvpipe decode writes it beside them"
        return (*write(sequence.with_sound(None), path, start, skin, compress), left)
    is_compressed = compress != "none"
    if is_compressed and not is_glb(path):
        raise InputError(f"{path}: a compressed file is one .glb; give such a name, or leave the compression out")
    if suffix not in HOLD_MOVING and any(image.is_moving for image in sequence.images):
        still = sequence.with_looks(sequence.materials, tuple(image.frame(0) for image in sequence.images))
        said = (STILL.format(suffix),) if suffix in HOLD_PICTURES else ()
        return (*write(still, path, start, skin, compress), *said)
    if skin is not None:
        if not takes_skin(path):
            raise InputError(f"{path}: a skeleton is written as one .glb or USD file; give such a name, or leave the skin out")
        check_skin(sequence, skin, path)
        if not is_glb(path):
            if len(skin.clips) > 1:
                raise InputError(f"{path}: USD has one animation; write a file for each clip, or a .glb")
            return tuple(USD_SKIN_WRITER(sequence, Path(path), skin))
        return tuple(SKIN_WRITER(sequence, skin, Path(path), compress))
    if is_compressed:
        return tuple(GLB_WRITER(sequence, Path(path), compress))
    if suffix == ".vtu":
        return tuple(VTU_WRITER(sequence, Path(path), start))
    if sequence.volume is not None and suffix not in HOLD_VOLUMES:
        cells, inner = len(sequence.volume.cells.types), sequence.volume.n_points
        left = f"the volume's {cells} cells and {inner} inner points are left out; {', '.join(HOLD_VOLUMES)} hold them"
        return (*write(replace(sequence, volume=None), path, start), left)
    writer = WRITERS.get(suffix)
    # .glb may be a frame, too: of a pattern, or of a sequence of one
    is_frame = suffix in FRAME_FORMATS and (sequence.n_frames == 1 or match_pattern(path) is not None or os.path.isdir(path))
    is_folder = path.endswith(("/", os.sep)) and suffix != OPENVAT
    if writer is not None and not is_folder and not is_frame:
        return writer(sequence, Path(path)) or ()
    return write_frames(sequence, path, start)
