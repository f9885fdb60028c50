"""Reads the simulation and FBX files of a folder of assets, and prints what was read and how far it is from its reference.

    python tools/check_simulations.py ../shared/data
    python tools/check_simulations.py ../shared/data --vtk     # also against the package vtk, where it is installed

A distance is the largest of a vertex at any time of the reference, as part of the reference's diagonal. "vertices": vertex by
vertex in the same order. "surface": of a volume mesh only the surface is read, so that each vertex's trajectory is compared
with the nearest of the reference. Blender's references are metres, so positions are scaled by the file's unit first.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from gvpipe.foundation.errors import InputError
from gvpipe.io import read
from gvpipe.model.sequence import MeshSequence, describe

Array = NDArray[Any]


@dataclass(frozen=True)
class Asset:
    """A file to read.

    Args:
        path: below ``assets``.
        reference: name in ``reference``, or "".
        clip: take of an FBX file.
        first: number of the file's first frame, for references that count frames.
        metres: whether the reference is in metres.
        meshes: those that are compared; (): all.
    """

    path: str
    reference: str = ""
    clip: str | None = None
    first: int | None = None
    metres: bool = False
    meshes: tuple[str, ...] = ()


ASSETS = (
    Asset("sim/can_vtkhdf/can-vtu.hdf"),
    Asset("sim/dolfinx_xdmf/checkpoint.xdmf"),
    Asset("sim/dolfinx_xdmf/no_checkpoint.xdmf"),
    Asset("sim/dolfinx_xdmf/mesh.xdmf"),
    Asset("sim/ensight_blow1/blow1_ascii.case"),
    Asset("sim/ensight_blow1/blow1_bin.case"),
    Asset("sim/ensight_blow2/blow2_ascii.case", "ensight_blow2"),
    Asset("sim/ensight_blow2/blow2_bin.case", "ensight_blow2"),
    Asset("sim/exomerge_exodus/exomerge_unit_test.e", "exomerge_exodus"),
    Asset("sim/mug_exodus/mug.e", "mug_exodus"),
    Asset("sim/noh_exodus/noh.exo", "noh_exodus"),
    Asset("sim/singleSphere_pvd/singleSphereAnimation.pvd"),
    Asset("sim/vec_anim_vtk/vecAnim*.vtk"),
    Asset("sim/wavy_pvd/wavy.pvd"),
    Asset("sim/wavy_vtu_series/mesh.vtu.series", "wavy_vtu_series"),
    *(Asset("fbx/blender_sausage/blender_279_sausage_7400_binary.fbx", f"blender_sausage_blender_279_sausage_{name}_frames",
            f"Skeleton|{name.title()}", first) for name, first in (("base", 0), ("spin", 0), ("wiggle", 1))),
    Asset("fbx/bunny_walk_fbx/bunny_walk.fbx", "bunny_walk_blender", None, None, True),
    Asset("fbx/maya_blend_inbetween/maya_blend_inbetween_7500_binary.fbx", "maya_blend_inbetween_frames"),
    Asset("fbx/maya_dq_weights/maya_dq_weights_7500_binary.fbx", "maya_dq_weights_frames"),
    *(Asset("fbx/maya_game_sausage_combined/maya_game_sausage_7500_binary_combined.fbx",
            f"maya_game_sausage_combined_maya_game_sausage_{name}_frames", name, first)
      for name, first in (("deform", 0), ("spin", 0), ("wiggle", 1))),
    Asset("fbx/maya_instanced_skin/maya_instanced_skin_7700_binary.fbx", "maya_instanced_skin_frames"),
    Asset("fbx/maya_kenney_character/maya_kenney_character_7700_binary.fbx", "maya_kenney_character_frames"),
    # Blender wrote a take per object and action, and the cloth of its last frame alone
    Asset("fbx/mix1_fbx/mix1.fbx", "mix1_blender", "ball|ballAction", 0, True, ("ball", "ball instance", "static cube")),
    Asset("fbx/mix1_fbx/mix1.fbx", "mix1_blender", "pivot|pivotAction", 0, True, ("mirrored monkey", "static cube")),
    Asset("pointcache/max_cache_box_pc2/max_cache_box_7500_binary.fbx", "max_cache_box_pc2_frames"),
    Asset("pointcache/maya_cache_sine/maya_cache_sine_7500_binary.fbx", "maya_cache_sine_frames"),
)  # fmt: skip
VTK_READERS = {".vtp": "vtkXMLPolyDataReader", ".vtu": "vtkXMLUnstructuredGridReader", ".vts": "vtkXMLStructuredGridReader",
               ".hdf": "vtkHDFReader", ".vtkhdf": "vtkHDFReader", ".xdmf": "vtkXdmfReader", ".case": "vtkGenericEnSightReader",
               ".e": "vtkExodusIIReader", ".exo": "vtkExodusIIReader"}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with assets/ and reference/")
    parser.add_argument("--vtk", action="store_true", help="compare first frames with the package vtk, where it is installed")
    given = parser.parse_args()
    for asset in ASSETS:
        print(_line(asset, given.data, given.vtk))


def _line(asset: Asset, data: Path, with_vtk: bool) -> str:
    name = asset.path + (f" ({asset.clip})" if asset.clip else "")
    try:
        sequence = read_asset(asset, data / "assets" / asset.path)
        parts = [f"{name}: {describe(sequence)}", f"{len(sequence.parts)} parts"]
        sequence.read(0, len(sequence))
    except InputError as exc:
        return f"{name}: refused: {str(exc).replace(str(data / 'assets'), '')}"
    for what, names in (("fields", list(sequence.fields)), ("attributes", list(sequence.attributes))):
        parts.append(
            f"{len(names)} {what}" + (f" ({', '.join(names[:4])}{', ...' if len(names) > 4 else ''})" if names else "")
        )
    if asset.reference:
        parts.append(from_reference(sequence, asset, data / "reference" / f"{asset.reference}.npz"))
    if with_vtk:
        parts.append(from_vtk(sequence, data / "assets" / asset.path))
    return ", ".join(parts)


def read_asset(asset: Asset, path: Path) -> MeshSequence:
    """Read one asset; raises `InputError`."""
    return read(path, clip=asset.clip)


def from_reference(sequence: MeshSequence, asset: Asset, path: Path) -> str:
    """The largest distance at the reference's times, in words."""
    held = np.load(path)
    expected: Array = held["positions"].astype(np.float64)
    if "frames" in held.files and (asset.meshes or not asset.metres):
        first = round(sequence.metadata.start_time * sequence.fps) if asset.first is None else asset.first
        frames = held["frames"].astype(int) - first - bool(asset.meshes)  # Blender's first frame is 1
    else:
        frames = frames_at(sequence, held["times"])
    if (frames < 0).any() or (frames >= len(sequence)).any():
        kept = (frames >= 0) & (frames < len(sequence))
        expected, frames = expected[kept], frames[kept]
        if not kept.any():
            return f"no time of the reference lies in its {len(sequence)} frames"
    scale = (sequence.metadata.metres_per_unit or 1.0) if asset.metres else 1.0
    found = np.stack([sequence.read_absolute(frame, frame + 1)[0] for frame in frames]) * scale
    if asset.meshes:
        found, expected = of_meshes(sequence, found, held, expected, asset.meshes)
    return f"{len(frames)} reference times: {distance(found, expected)}"


def of_meshes(sequence: MeshSequence, found: Array, held: Any, expected: Array, names: tuple[str, ...]) -> tuple[Array, Array]:
    """Positions of some meshes, as read and as the reference has them."""
    spans = {part.name: part.vertices for part in sequence.parts}
    theirs = held["mesh_names"].tolist()
    ours = [found[:, slice(*spans[name])] for name in names]
    numbers = [theirs.index(name) for name in names]
    others = [expected[:, held["mesh_offsets"][number] : held["mesh_offsets"][number + 1]] for number in numbers]
    return np.concatenate(ours, axis=1), np.concatenate(others, axis=1)


def frames_at(sequence: MeshSequence, times: Array) -> Array:
    """The frames at given times, seconds; of uneven steps by their times."""
    text = sequence.metadata.texts.get("times")
    own = np.array(text.split(), float) if text else sequence.metadata.start_time + np.arange(len(sequence)) / sequence.fps
    return np.array([int(np.argmin(np.abs(own - time))) for time in times])


def distance(found: Array, expected: Array) -> str:
    """The largest distance of trajectories ``(n, V, 3)``, as part of the diagonal."""
    diagonal = float(np.linalg.norm(np.ptp(expected[0], axis=0)))
    if found.shape == expected.shape:
        direct = float(np.linalg.norm(found - expected, axis=2).max()) / diagonal
        if direct < 1e-3:
            return f"vertices {direct:.1e}"
    rows = [block.transpose(1, 0, 2).reshape(block.shape[1], -1) for block in (found, expected)]
    near = KDTree(rows[1]).query(rows[0])[1]
    apart = np.linalg.norm(found - expected[:, near], axis=2).max(axis=0) / diagonal
    where = f"; {(apart > 1e-5).sum()} of {len(apart)} vertices beyond 1e-5" if apart.max() > 1e-5 else ""
    return f"surface {apart.max():.1e}{where}"


def from_vtk(sequence: MeshSequence, path: Path) -> str:
    """The distance of the first frame from what the package vtk reads, in words."""
    points = vtk_points(path)
    return "" if points is None else f"vtk: {distance(sequence.read_absolute(0, 1), points[None])}"


def vtk_points(path: Path) -> Array | None:
    """All points of the first step that vtk reads, ``(N, 3)``, or None where it has no reader or is not installed."""
    if path.suffix in (".pvd", ".series"):
        path = sorted(path.parent.rglob("*0.v??"))[0]
    if path.suffix not in VTK_READERS:
        return None
    try:
        import vtkmodules.all as vtk
        from vtkmodules.util.numpy_support import vtk_to_numpy
    except ImportError:
        return None
    if not hasattr(vtk, VTK_READERS[path.suffix]):
        return None
    reader = getattr(vtk, VTK_READERS[path.suffix])()
    (reader.SetCaseFileName if path.suffix == ".case" else reader.SetFileName)(str(path))
    reader.UpdateInformation()
    if path.suffix in (".e", ".exo"):
        return None  # its references are of all steps
    reader.Update()
    output = reader.GetOutputDataObject(0)
    if isinstance(output, vtk.vtkCompositeDataSet):
        walk, blocks = output.NewIterator(), []
        walk.InitTraversal()
        while not walk.IsDoneWithTraversal():
            blocks.append(vtk_to_numpy(walk.GetCurrentDataObject().GetPoints().GetData()))
            walk.GoToNextItem()
        return np.concatenate(blocks).astype(np.float64)
    return np.asarray(vtk_to_numpy(output.GetPoints().GetData()), np.float64)


if __name__ == "__main__":
    main()
