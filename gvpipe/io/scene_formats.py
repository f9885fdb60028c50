"""The formats that hold a whole sequence in one file, by extension."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Optional

from gvpipe.io.late import late
from gvpipe.io.options import ReadOptions

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence

MeshReader = Callable[[str | os.PathLike[str]], "MeshSequence"]
SceneReader = Callable[[Path, ReadOptions], Optional["MeshSequence"]]  # None for a file that is one frame
SceneWriter = Callable[["MeshSequence", Path], tuple[str, ...] | None]  # what the format cannot hold, a line each

USD = (".usda", ".usdc", ".usd", ".usdz")
SCENES = (*USD, ".abc")  # whose topology may change
IN_PROCESSES = (*SCENES, ".fbx")  # their readers start one, then turn what is raised into errors themselves
GLTF = (".glb", ".gltf")
SIMULATIONS: dict[str, SceneReader] = {
    **dict.fromkeys((".pvd", ".series"), late("simulation.step_lists", "read_step_list")),
    **dict.fromkeys((".vtkhdf", ".hdf"), late("simulation.vtkhdf", "read_vtkhdf")),
    **dict.fromkeys((".xdmf", ".xmf"), late("simulation.xdmf", "read_xdmf")),
    **dict.fromkeys((".e", ".exo", ".ex2", ".exii"), late("simulation.exodus", "read_exodus")),
    **dict.fromkeys((".case", ".encas"), late("simulation.ensight", "read_ensight")),
    **dict.fromkeys((".foam", ".cgns", ".cas", ".nek5000"), late("simulation.vtk_objects", "read_by_vtk")),
}
MARKERS = (".foam",)  # empty files that say what lies beside them
OPENVAT = ".openvat"
POINT_CACHES = (".pc2", ".mdd", ".npy")
HAVE_CLIPS = (*GLTF, ".fbx")
SCENE_SUFFIXES = (".npz", *SCENES, ".fbx", *SIMULATIONS, *POINT_CACHES)  # that are no frames

WRITERS: dict[str, SceneWriter] = {
    ".npz": late("npz.archive", "write_npz"),
    ".glb": late("gltf", "write_animated"),
    **dict.fromkeys(USD, late("usd.writer", "write_usd")),
    ".abc": late("alembic.writer", "write_alembic"),
    ".pc2": late("point_cache", "write_pc2"),
    ".mdd": late("point_cache", "write_mdd"),
    ".npy": late("point_cache", "write_npy"),
    ".pvd": late("simulation.pvd_writer", "write_pvd"),
    ".vtkhdf": late("simulation.vtkhdf_writer", "write_vtkhdf"),
    ".xdmf": late("simulation.xdmf_writer", "write_xdmf"),
    OPENVAT: late("openvat", "write_openvat"),
}


def scene_readers(read_mesh: MeshReader) -> dict[str, SceneReader]:
    """Readers by extension; ``read_mesh`` reads the mesh that belongs to a point cache."""
    return {
        ".npz": lambda path, options: late("npz.archive", "read_npz")(path, options.fps),
        **dict.fromkeys(GLTF, late("gltf", "read_animated")),
        **dict.fromkeys(USD, late("usd.process", "read_usd")),
        ".abc": late("alembic.process", "read_alembic"),
        ".fbx": late("fbx.process", "read_fbx"),
        **SIMULATIONS,
        ".pc2": lambda path, options: late("point_cache", "read_pc2")(path, options, read_mesh),
        ".mdd": lambda path, options: late("point_cache", "read_mdd")(path, options, read_mesh),
        ".npy": lambda path, options: late("point_cache", "read_npy")(path, options, read_mesh),
    }
