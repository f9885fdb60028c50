"""The formats that hold a whole sequence in one file, by extension."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from gvpipe.io.alembic import read_alembic, write_alembic
from gvpipe.io.fbx import read_fbx
from gvpipe.io.gltf import read_animated, write_animated
from gvpipe.io.npz import read_npz, write_npz
from gvpipe.io.openvat import write_openvat
from gvpipe.io.options import ReadOptions
from gvpipe.io.point_cache import read_mdd, read_npy, read_pc2, write_mdd, write_npy, write_pc2
from gvpipe.io.pvd_writer import write_pvd
from gvpipe.io.simulation.ensight import read_ensight
from gvpipe.io.simulation.exodus import read_exodus
from gvpipe.io.simulation.vtkhdf import read_vtkhdf
from gvpipe.io.simulation.xdmf import read_xdmf
from gvpipe.io.step_lists import read_step_list
from gvpipe.io.usd import read_usd, write_usd
from gvpipe.io.vtkhdf_writer import write_vtkhdf
from gvpipe.sequence import MeshSequence

MeshReader = Callable[[str | os.PathLike[str]], MeshSequence]
SceneReader = Callable[[Path, ReadOptions], MeshSequence | None]  # None for a file that is one frame
SceneWriter = Callable[[MeshSequence, Path], tuple[str, ...] | None]  # what the format cannot hold, a line each

USD = (".usda", ".usdc", ".usd", ".usdz")
SCENES = (*USD, ".abc")  # whose topology may change
GLTF = (".glb", ".gltf")
SIMULATIONS: dict[str, SceneReader] = {
    **dict.fromkeys((".pvd", ".series"), read_step_list),
    **dict.fromkeys((".vtkhdf", ".hdf"), read_vtkhdf),
    **dict.fromkeys((".xdmf", ".xmf"), read_xdmf),
    **dict.fromkeys((".e", ".exo", ".ex2"), read_exodus),
    **dict.fromkeys((".case", ".encas"), read_ensight),
}
OPENVAT = ".openvat"
HAVE_CLIPS = (*GLTF, ".fbx")

WRITERS: dict[str, SceneWriter] = {
    ".npz": write_npz,
    ".glb": write_animated,
    **dict.fromkeys(USD, write_usd),
    ".abc": write_alembic,
    ".pc2": write_pc2,
    ".mdd": write_mdd,
    ".npy": write_npy,
    ".pvd": write_pvd,
    ".vtkhdf": write_vtkhdf,
    OPENVAT: write_openvat,
}


def scene_readers(read_mesh: MeshReader) -> dict[str, SceneReader]:
    """Readers by extension; ``read_mesh`` reads the mesh that belongs to a point cache."""
    return {
        ".npz": lambda path, options: read_npz(path, options.fps),
        **dict.fromkeys(GLTF, read_animated),
        **dict.fromkeys(USD, read_usd),
        ".abc": read_alembic,
        ".fbx": read_fbx,
        **SIMULATIONS,
        ".pc2": lambda path, options: read_pc2(path, options, read_mesh),
        ".mdd": lambda path, options: read_mdd(path, options, read_mesh),
        ".npy": lambda path, options: read_npy(path, options, read_mesh),
    }
