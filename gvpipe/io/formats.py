"""The mesh formats a frame file may have, by extension."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gvpipe.io.late import late

if TYPE_CHECKING:
    from gvpipe.io.mesh import EncoderMaker, Loader
    from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True)
class FrameFormat:
    """How frames of one format are read and written.

    Args:
        loader: makes a loader for one sequence.
        encoder: makes an encoder of frames (`gvpipe.io.mesh.FrameEncoder`) for one sequence. None: read only.
        timed: given a sequence whose files may tell their times, the files, the rate asked for and whether the clock is kept,
            returns it with its times (`gvpipe.io.simulation.file_times.timed`). None: files of this format tell none.
    """

    loader: Callable[[], Loader]
    encoder: EncoderMaker | None = None
    timed: Callable[[MeshSequence, Sequence[Path], float | None, bool], MeshSequence] | None = None


VTK_XML = (".vtp", ".vtu", ".vts", ".vtr", ".vti", ".pvtp", ".pvtu")
BLOCKS = (".vtm", ".vtpc")  # that name files of their blocks
STEPS = (".vtk", *VTK_XML, *BLOCKS)  # of simulations, that lists with times may name
BY_MESHIO = (
    ".msh", ".inp", ".bdf", ".fem", ".nas", ".mesh", ".meshb", ".su2", ".avs", ".vol", ".f3grid", ".mdpa", ".tec",
)  # fmt: skip
VOLUMES = (*STEPS, *BY_MESHIO)  # whose cells may have an inside
TIMED = late("simulation.file_times", "timed")

FRAME_FORMATS = {
    ".obj": FrameFormat(late("obj.reader", "ObjLoader"), late("obj.writer", "encode_obj")),
    ".ply": FrameFormat(late("ply.reader", "PlyLoader"), late("ply.writer", "encode_ply")),
    ".stl": FrameFormat(late("stl", "StlLoader"), late("stl", "encode_stl")),
    ".off": FrameFormat(late("off.reader", "OffLoader"), late("off.writer", "encode_off")),
    ".glb": FrameFormat(late("gltf", "GltfLoader"), late("gltf", "encode_glb")),
    ".gltf": FrameFormat(late("gltf", "GltfLoader")),
    ".vtk": FrameFormat(late("simulation.frame_loader", "legacy_loader"), timed=TIMED),
    **dict.fromkeys(VTK_XML, FrameFormat(late("simulation.frame_loader", "xml_loader"), timed=TIMED)),
    ".vtp": FrameFormat(late("simulation.frame_loader", "xml_loader"), late("simulation.vtp_writer", "encode_vtp"), TIMED),
    **dict.fromkeys(BLOCKS, FrameFormat(late("simulation.frame_loader", "block_loader"))),
    **dict.fromkeys(BY_MESHIO, FrameFormat(late("simulation.frame_loader", "meshio_loader"))),
}


def format_names(formats: dict[str, FrameFormat] = FRAME_FORMATS) -> str:
    """``.obj, .ply, ...``, for messages."""
    return ", ".join(formats)
