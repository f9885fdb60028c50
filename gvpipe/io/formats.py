"""The mesh formats a frame file may have, by extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gvpipe.io.gltf import GltfLoader, encode_glb
from gvpipe.io.mesh import EncoderMaker, Loader
from gvpipe.io.obj import ObjLoader, encode_obj
from gvpipe.io.off import OffLoader, encode_off
from gvpipe.io.ply import encode_ply, load_ply
from gvpipe.io.simulation.frame_loader import SurfaceLoader
from gvpipe.io.simulation.legacy import load_legacy
from gvpipe.io.simulation.xml_grids import load_xml_grid
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
    ".ply": FrameFormat(lambda: load_ply, encode_ply),
    ".stl": FrameFormat(StlLoader, encode_stl),
    ".off": FrameFormat(OffLoader, encode_off),
    ".glb": FrameFormat(GltfLoader, encode_glb),
    ".gltf": FrameFormat(GltfLoader),
    ".vtk": FrameFormat(lambda: SurfaceLoader(load_legacy)),
    **{
        suffix: FrameFormat(lambda: SurfaceLoader(load_xml_grid))
        for suffix in (".vtp", ".vtu", ".vts", ".vtr", ".vti", ".pvtp", ".pvtu")
    },
}


def format_names(formats: dict[str, FrameFormat] = FRAME_FORMATS) -> str:
    """``.obj, .ply, ...``, for messages."""
    return ", ".join(formats)
