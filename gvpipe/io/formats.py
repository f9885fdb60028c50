"""The mesh formats a frame file may have, by extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gvpipe.arrays import Float64, Int32
from gvpipe.io.gltf import GltfLoader, encode_glb
from gvpipe.io.mesh import Attributes, Encoder, Loader
from gvpipe.io.obj import ObjLoader, encode_obj
from gvpipe.io.off import OffLoader, encode_off
from gvpipe.io.ply import encode_ply, load_ply
from gvpipe.io.stl import StlLoader, encode_stl


@dataclass(frozen=True)
class FrameFormat:
    """How frames of one format are read and written.

    Args:
        loader: makes a loader for one sequence.
        encoder: makes a writer for one sequence from faces, attributes, the number of vertices and the origin. The writer
            adds the origin to positions; `InputError` if the format cannot hold the sums. None: read only.
    """

    loader: Callable[[], Loader]
    encoder: Callable[[Int32, Attributes, int, Float64], Encoder] | None = None


FRAME_FORMATS = {
    ".obj": FrameFormat(ObjLoader, encode_obj),
    ".ply": FrameFormat(lambda: load_ply, encode_ply),
    ".stl": FrameFormat(StlLoader, encode_stl),
    ".off": FrameFormat(OffLoader, encode_off),
    ".glb": FrameFormat(GltfLoader, encode_glb),
    ".gltf": FrameFormat(GltfLoader),
}


def format_names(formats: dict[str, FrameFormat] = FRAME_FORMATS) -> str:
    """``.obj, .ply, ...``, for messages."""
    return ", ".join(formats)
