"""A sequence as a USD stage: meshes with time-sampled points, primvars, subsets, materials and textures.

Positions are in world space. Nodes above the meshes are written as transforms that move nothing, so that names come back.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.material import Image
from gvpipe.foundation import notes
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.atomic import atomic_path, temporary_folder, unnamed_path
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.io.damage import reason_of
from gvpipe.io.losses import NO_PARENTS, TURNED_NORMALS, renamed_note, shadow_note, shadowed, unit_note, wide_note
from gvpipe.io.scene.export import ExportMesh, export_meshes, uncovered
from gvpipe.io.scene.normals import SceneNormals
from gvpipe.io.usd.material_writer import MaterialWriter, frame_name
from gvpipe.io.usd.names import ADDED, identifier, name_prim
from gvpipe.io.usd.primvar_writer import primvar_names, write_field, write_normals, write_primvars
from gvpipe.io.usd.signature import EXTRA
from gvpipe.io.usd.skin_writer import is_first_frame, write_skeleton
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

ROOT = "root"  # of meshes that have no common node
StageMaker = Callable[[Path, str], tuple[str, ...]]  # writes a stage, given the folder of its images
CLOSE = 1e-4  # time codes: programs cut 0.9999988, which a float32 start time gives, down to 0


def write_usd(sequence: MeshSequence, path: Path, skin: Skin | None = None) -> tuple[str, ...]:
    """Write a sequence as .usda, .usdc, .usd (binary) or .usdz; returns what the format cannot hold.

    With a skin of it, the motion is a UsdSkel skeleton (`skin_writer`) in place of points that are sampled.
    Textures go into the folder ``NAME_textures`` beside the file, or into the .usdz.

    Raises:
        InputError: usd-core is missing, or a position is not finite.
        OutputError: the file cannot be written.
    """
    names = image_names(sequence)

    def make(stage: Path, textures: str) -> tuple[str, ...]:
        return write_stage(sequence, stage, path.stem, textures, skin, names)

    return write_folder(make, dict(zip(names, sequence.images, strict=True)), path)


def write_folder(make: StageMaker, images: Mapping[str, Image], path: Path) -> tuple[str, ...]:
    """Write a stage with the images beside it, or both into one .usdz; returns what the first function returns.

    Args:
        make: writes the stage to a path that exists, given the folder of the images.
        images: by the names of their files.
        path: of the result.

    Raises:
        InputError: usd-core is missing, or as ``make``.
        OutputError: a file cannot be written.
    """
    try:
        from pxr import Tf
    except ImportError as exc:
        raise InputError(f"{path}: {EXTRA}") from exc
    try:
        if path.suffix.lower() == ".usdz":
            return _write_package(make, images, path)
        with atomic_path(path) as temporary:
            folder = path.with_name(f"{path.stem}_textures")
            said = make(temporary, folder.name)
        _write_images(images, folder)
    except (Tf.ErrorException, RuntimeError) as exc:
        raise OutputError(f"cannot write {path}: {reason_of(exc)}; check the folder and the disk") from exc
    return said


def _write_package(make: StageMaker, images: Mapping[str, Image], path: Path) -> tuple[str, ...]:
    """A .usdz: a binary stage first, then its textures, neither compressed."""
    from pxr import Sdf, Usd

    zip_writer: Any = getattr(Sdf, "ZipFileWriter", None) or Usd.ZipFileWriter  # it moved
    with temporary_folder() as held:
        folder = Path(held)
        stage = folder / "scene.usdc"
        said = make(stage, "textures")
        _write_images(images, folder / "textures")
        with atomic_path(path) as temporary:
            package = folder / "package.usdz"
            writer = zip_writer.CreateNew(str(package))
            writer.AddFile(str(stage), f"{identifier(path.stem)}.usdc")
            for name in _files_of(images):
                writer.AddFile(str(folder / "textures" / name), f"textures/{name}")
            writer.Save()
            del writer
            shutil.copyfile(package, temporary)
    return said


def write_stage(
    sequence: MeshSequence, path: Path, name: str, textures: str, skin: Skin | None, pictures: Sequence[str]
) -> tuple[str, ...]:
    """Write a stage alone; returns what the format cannot hold.

    Args:
        sequence, path, skin: as of `write_usd`.
        name: of a mesh without one.
        textures: the folder of the images, as the stage names it.
        pictures: names of the images' files.
    """
    from pxr import Gf, UsdGeom, UsdSkel

    stage: Any = _new_stage(path)
    about = sequence.metadata
    start = first_code(about.start_time, sequence.fps)
    stage.SetTimeCodesPerSecond(sequence.fps)
    stage.SetFramesPerSecond(sequence.fps)
    stage.SetStartTimeCode(start)
    stage.SetEndTimeCode(start + sequence.n_frames - 1)
    UsdGeom.SetStageUpAxis(stage, about.up_axis.upper() if about.up_axis in ("y", "z") else "Y")
    UsdGeom.SetStageMetersPerUnit(stage, about.metres_per_unit or 1.0)
    meshes = export_meshes(sequence, name)
    has_parents = skin is not None and any(mesh.parent for mesh in meshes)
    if has_parents:  # USD moves no mesh that lies below another one by a skeleton
        meshes = [replace(mesh, parent="") for mesh in meshes]
    paths = _paths(meshes)
    root = paths[0].split("/")[1]
    top = (UsdGeom.Xform if skin is None else UsdSkel.Root).Define(stage, f"/{root}").GetPrim()
    stage.SetDefaultPrim(top)
    if any(path.count("/") > len(mesh.parent.split("/")) + bool(mesh.parent) for path, mesh in zip(paths, meshes, strict=True)):
        top.SetCustomDataByKey(ADDED, True)
    materials = MaterialWriter(stage, sequence, f"/{root}/Materials", textures, list(pictures), start)
    normals = SceneNormals(sequence, "USD")
    attributes = {name: each for name, each in normals.attributes.items() if name not in normals.fields}
    names = primvar_names({**attributes, **normals.fields})
    usual = {name: one for name, one in names.items() if one not in ("st", "normals", "displayColor")}
    own = {name: one for name, one in usual.items() if not (name.startswith("uv") and one == f"st{name[2:]}")}
    said = [
        *([NO_PARENTS] if has_parents else []),
        *(normals.notes if skin is None else ()),
        *shadow_note(shadowed(sequence), "USD"),
        *renamed_note(own.items(), "USD"),
        *unit_note(sequence, "USD"),
    ]
    drawn = [_define(stage, where, mesh, sequence, materials) for where, mesh in zip(paths, meshes, strict=True)]
    for each, mesh in zip(drawn, meshes, strict=True):
        said.extend(write_primvars(each, mesh, attributes, names))
    pairs = list(zip(drawn, meshes, strict=True))
    if skin is None:
        _write_frames(sequence, pairs, normals, start)
    else:
        for one, mesh in pairs:
            PointsWriter(one, start, is_sampled=False).write(0, np.ascontiguousarray(skin.bind[slice(*mesh.vertices)]))
        write_skeleton(stage, f"/{root}", skin, pairs, start, name)
        said += _write_bind_normals(sequence, pairs, normals, is_first_frame(skin))
        if sequence.origin.any():
            UsdGeom.Xformable(top).AddTranslateOp().Set(Gf.Vec3d(*sequence.origin.tolist()))
    for field_name, field in normals.fields.items():
        write_field(names[field_name], field, pairs, start)
    stage.GetRootLayer().Save()
    parts = [(mesh.name, where.rpartition("/")[2]) for where, mesh in zip(paths, meshes, strict=True)]
    return (*dict.fromkeys(said), *renamed_note(parts, "USD"), *_notes(sequence, meshes, skin is not None))


def first_code(start_time: float, fps: float) -> float:
    """The time code of a second: a whole number if it is close to one, else with six decimals."""
    code = start_time * fps
    return float(np.rint(code)) if abs(code - np.rint(code)) < CLOSE else float(np.rint(code * 1e6) / 1e6)


def _new_stage(path: Path) -> Any:
    """A stage in memory, saved under a name that exists already."""
    from pxr import Sdf, Usd

    path.unlink(missing_ok=True)  # the library makes the file
    kind = {".usda": "usda"}.get(path.suffix.lower(), "usdc")
    layer = Sdf.Layer.CreateNew(str(path), args={"format": kind} if path.suffix.lower() == ".usd" else {})
    return Usd.Stage.Open(layer)


def _define(stage: Any, where: str, mesh: ExportMesh, sequence: MeshSequence, materials: MaterialWriter) -> Any:
    """One mesh without points."""
    from pxr import UsdGeom, UsdShade, Vt

    parent = ""
    names = where.split("/")[1:-1]
    given = [name for name in mesh.parent.split("/") if name]
    for name, shown in zip(names, [*names[: len(names) - len(given)], *given], strict=True):
        parent += f"/{name}"
        if parent == f"/{names[0]}" or not stage.GetPrimAtPath(parent):
            name_prim(stage.GetPrimAtPath(parent) or UsdGeom.Xform.Define(stage, parent).GetPrim(), shown)
    drawn = UsdGeom.Mesh.Define(stage, where)
    name_prim(drawn.GetPrim(), mesh.name)
    drawn.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    drawn.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.counts, np.int32)))
    drawn.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.corners.astype(np.int32)))
    bound = [material for _, _, material in mesh.groups]
    if any(material is not None and sequence.materials[material].double_sided for material in bound):
        drawn.CreateDoubleSidedAttr(True)
    if len(mesh.groups) == 1:
        materials.bind(drawn.GetPrim(), bound[0])
        return drawn
    api = UsdShade.MaterialBindingAPI.Apply(drawn.GetPrim())
    for number, (first, stop, material) in enumerate(mesh.groups):
        faces = Vt.IntArray.FromNumpy(np.arange(first, stop, dtype=np.int32))
        materials.bind(api.CreateMaterialBindSubset(f"part{number}", faces).GetPrim(), material)
    api.SetMaterialBindSubsetsFamilyType(UsdGeom.Tokens.partition)
    return drawn


def _write_frames(sequence: MeshSequence, meshes: list[tuple[Any, ExportMesh]], normals: SceneNormals, start: float) -> None:
    """Points, extents and normals of every frame."""
    rows = [normals.rows(mesh) for _, mesh in meshes]
    held = [PointsWriter(drawn, start, sequence.n_frames > 1) for drawn, _ in meshes]
    for first, block in sequence.chunks():
        for i, frame in enumerate(block):
            whole = (frame + sequence.origin).astype(np.float32) if sequence.origin.any() else frame
            turned = normals.of(first + i, frame)
            for writer, (drawn, mesh), own in zip(held, meshes, rows, strict=True):
                writer.write(first + i, np.ascontiguousarray(whole[slice(*mesh.vertices)]))
                if turned is not None:
                    write_normals(drawn, normals.layer(turned, mesh, own), start + first + i)


def _write_bind_normals(
    sequence: MeshSequence, meshes: list[tuple[Any, ExportMesh]], normals: SceneNormals, is_first: bool
) -> list[str]:
    """Write normals of the bind pose, if it is the first frame; returns notes."""
    turned = normals.of(0, sequence.read(0, 1)[0])
    if turned is None:
        return []
    if not is_first:
        return ["normals are left out, since the skeleton's bind pose is not the first frame"]
    for drawn, mesh in meshes:
        write_normals(drawn, normals.layer(turned, mesh, normals.rows(mesh)), None)
    return [TURNED_NORMALS]


class PointsWriter:
    """Writes the points of one mesh, a sample per frame.

    USD interpolates between samples. So of frames that repeat each other the first and the last are written, and of a mesh that
    stands still the first.
    """

    def __init__(self, drawn: Any, start: float, is_sampled: bool) -> None:
        self._points, self._extent = drawn.CreatePointsAttr(), drawn.CreateExtentAttr()
        self._start, self._is_sampled = start, is_sampled
        self._last: Float32 | None = None
        self._last_frame = self._written = -1

    def write(self, frame: int, points: Float32) -> None:
        """Take the points ``(n, 3)`` of the next frame."""
        if self._last is None or not np.array_equal(points, self._last):
            if self._last is not None and self._written < self._last_frame:
                self._store(self._last_frame, self._last)
            self._store(frame, points)
            self._last = points
        self._last_frame = frame

    def _store(self, frame: int, points: Float32) -> None:
        from pxr import Usd, Vt

        time = Usd.TimeCode(self._start + frame) if self._is_sampled else Usd.TimeCode.Default()
        bounds = np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else np.zeros((2, 3), np.float32)
        self._points.Set(Vt.Vec3fArray.FromNumpy(points), time)
        self._extent.Set(Vt.Vec3fArray.FromNumpy(bounds), time)
        self._written = frame


def _paths(meshes: list[ExportMesh]) -> list[str]:
    """A path for each mesh, all below one root; names that USD does not allow are changed, equal paths numbered."""
    chains = [[*filter(None, mesh.parent.split("/")), mesh.name] for mesh in meshes]
    shared = len({chain[0] for chain in chains}) == 1 and all(len(chain) > 1 for chain in chains)
    result: list[str] = []
    taken: set[str] = set()
    for chain in chains:
        path = "/" + "/".join(identifier(name) for name in (chain if shared else [ROOT, *chain]))
        free, number = path, 1
        while free in taken:
            free, number = f"{path}_{number}", number + 1
        taken.add(free)
        result.append(free)
    return result


def image_names(sequence: MeshSequence) -> list[str]:
    """A file name for each image, none twice and none with a folder."""
    endings = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp", "image/x-exr": ".exr"}
    result: list[str] = []
    for number, image in enumerate(sequence.images):
        plain = Path(os.path.basename(image.name.replace("\\", "/")) or f"image{number}")
        ending = endings.get(image.frame(0).media_type, plain.suffix)
        stem = "".join(c if c.isalnum() or c in "-_" else "_" for c in plain.stem) or f"image{number}"
        name, count = f"{stem}{ending}", 1
        while name in result:
            name, count = f"{stem}_{count}{ending}", count + 1
        result.append(name)
    return result


def _write_images(images: Mapping[str, Image], folder: Path) -> None:
    if not images:
        return
    try:
        folder.mkdir(exist_ok=True)
    except OSError as exc:
        raise OutputError(f"cannot write {folder}: {exc.strerror}; choose another folder") from exc
    for name, (image, frame) in _files_of(images).items():
        with unnamed_path(folder / name) as temporary:
            temporary.write_bytes(image.frame(frame).data)


def _files_of(images: Mapping[str, Image]) -> dict[str, tuple[Image, int]]:
    """The files of images by name, each with its image and frame: one, or one for each frame of an image that moves."""
    files = {}
    for name, image in images.items():
        if image.pictures is None:
            files[name] = (image, 0)
        else:
            files |= {frame_name(name, frame): (image, frame) for frame in range(len(image.pictures))}
    return files


def _notes(sequence: MeshSequence, meshes: list[ExportMesh], has_skin: bool) -> tuple[str, ...]:
    said = [] if sequence.metadata.metres_per_unit else ["the length of a unit is unknown; the stage says 1 metre"]
    lost = uncovered(sequence, meshes)
    if lost:
        said.append(f"{lost} vertices belong to no part; USD holds meshes alone, so they were left out")
    said += wide_note(sequence, "USD")
    if sequence.origin.any() and not has_skin:
        said.append(f"USD holds float32 points; the origin {notes.show_origin(sequence.origin)} was added to them")
    if sequence.metadata.up_axis == "x":
        said.append("USD has no X-up stages; the stage says Y up, and positions are as they were")
    unlit = [material.name for material in sequence.materials if material.unlit]
    if unlit:
        said.append(f"UsdPreviewSurface has no unlit materials; {', '.join(unlit[:5])} are lit in the file")
    return tuple(said)
