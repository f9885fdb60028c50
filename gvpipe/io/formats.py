"""The mesh formats a frame file may have, by extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gvpipe.io.gltf import GltfLoader, encode_glb
from gvpipe.io.mesh import EncoderMaker, Loader
from gvpipe.io.obj import ObjLoader
from gvpipe.io.obj_writer import encode_obj
from gvpipe.io.off import OffLoader
from gvpipe.io.off_writer import encode_off
from gvpipe.io.ply import PlyLoader
from gvpipe.io.ply_writer import encode_ply
from gvpipe.io.simulation.frame_loader import STEP_LOADERS
from gvpipe.io.simulation.vtp_writer import encode_vtp
from gvpipe.io.stl import StlLoader, encode_stl


@dataclass(frozen=True)
class FrameFormat:
    """How frames of one format are read and written.

    Args:
        loader: makes a loader for one sequence.
        encoder: makes an encoder of frames (`gvpipe.io.mesh.FrameEncoder`) for one sequence. None: read only.
    """

    loader: Callable[[], Loader]
    encoder: EncoderMaker | None = None


FRAME_FORMATS = {
    ".obj": FrameFormat(ObjLoader, encode_obj),
    ".ply": FrameFormat(PlyLoader, encode_ply),
    ".stl": FrameFormat(StlLoader, encode_stl),
    ".off": FrameFormat(OffLoader, encode_off),
    ".glb": FrameFormat(GltfLoader, encode_glb),
    ".gltf": FrameFormat(GltfLoader),
    **{suffix: FrameFormat(loader, encode_vtp if suffix == ".vtp" else None) for suffix, loader in STEP_LOADERS.items()},
}


def format_names(formats: dict[str, FrameFormat] = FRAME_FORMATS) -> str:
    """``.obj, .ply, ...``, for messages."""
    return ", ".join(formats)
