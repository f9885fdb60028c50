"""Point caches: positions alone, with the triangles in a mesh file beside (PC2, MDD, NumPy's .npy).

PC2 (3ds Max, Maya, Blender), little-endian::

    [12 bytes] "POINTCACHE2\\0"    [32 bits] version, 1    [32 bits] vertices    [float] first frame
    [float] frames per sample     [32 bits] samples       then float32 x, y, z per vertex and sample

MDD (LightWave, Blender), big-endian::

    [32 bits] samples    [32 bits] vertices    [float] per sample: its time, seconds    then float32 x, y, z

A .npy holds ``(F, V, 3)``. Sources: Autodesk, 3ds Max SDK, point cache 2 format; NewTek, LightWave MDD plug-in.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Array, Float32
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import ASSUMED_FPS, DEFAULT_FPS, origin_left_out
from gvpipe.io.damage import reading
from gvpipe.io.options import ReadOptions
from gvpipe.model.sequence import MeshSequence

PC2_HEAD = struct.Struct("<12siiffi")
PC2_MAGIC, PC2_VERSION = b"POINTCACHE2\0", 1
MDD_HEAD = struct.Struct(">ii")
FASTEST = 1000.0  # samples a second above which times are none

MeshReader = Callable[["str | os.PathLike[str]"], MeshSequence]


@dataclass(frozen=True)
class Cache:
    """Positions of a cache, not loaded yet.

    Args:
        positions: ``(F, V, 3)`` mapped from the file.
        fps: samples a second, None if the file does not say.
        start: time of the first sample, seconds; of PC2, frames.
    """

    positions: NDArray[Any]
    fps: float | None = None
    start: float = 0.0


class CacheFrames:
    """Frames mapped from a file: ``(F, V, 3)``, converted to this machine's floats as they are sliced."""

    def __init__(self, mapped: NDArray[Any]) -> None:
        self._mapped = mapped
        self.shape: tuple[int, ...] = mapped.shape
        self.dtype = np.dtype(np.float64 if mapped.dtype.itemsize > 4 or mapped.dtype.kind in "iu" else np.float32)

    def __getitem__(self, key: slice, /) -> Array:
        return np.ascontiguousarray(self._mapped[key], self.dtype)


def read_pc2(path: Path, options: ReadOptions, read_mesh: MeshReader) -> MeshSequence:
    """Read a PC2 cache with the mesh of ``options.mesh``; frames are mapped, not loaded.

    Raises:
        InputError: no mesh is given, the file is not a PC2 or is cut short, the mesh has other vertices.
    """
    head = _head(path, PC2_HEAD.size)
    if len(head) < PC2_HEAD.size or not head.startswith(PC2_MAGIC):
        raise InputError(f"{path} is not a PC2 point cache, or is cut short; export it again")
    _, version, n_vertices, first, per_sample, n_samples = PC2_HEAD.unpack(head)
    if version != PC2_VERSION:
        raise InputError(f"{path} is a PC2 point cache of version {version}; version {PC2_VERSION} is understood")
    positions = _mapped(path, PC2_HEAD.size, (n_samples, n_vertices, 3), "<f4")
    start = first if np.isfinite(first) else 0.0
    note = () if per_sample == 1 else (f"the cache has a sample each {per_sample:g} frames; a sample is a frame here",)
    return _sequence(path, Cache(positions, None, start), options, read_mesh, note)


def read_mdd(path: Path, options: ReadOptions, read_mesh: MeshReader) -> MeshSequence:
    """Read an MDD cache with the mesh of ``options.mesh``; frames are mapped, not loaded.

    Raises:
        InputError: no mesh is given, the file is not an MDD or is cut short, the mesh has other vertices.
    """
    head = _head(path, MDD_HEAD.size)
    if len(head) < MDD_HEAD.size:
        raise InputError(f"{path} is not an MDD point cache, or is cut short; export it again")
    n_samples, n_vertices = MDD_HEAD.unpack(head)
    positions = _mapped(path, MDD_HEAD.size + 4 * max(n_samples, 0), (n_samples, n_vertices, 3), ">f4")
    times = np.fromfile(path, ">f4", n_samples, offset=MDD_HEAD.size).astype(np.float64)
    gap = float(np.median(np.diff(times))) if n_samples > 1 and np.isfinite(times).all() else 0.0
    fps = 1 / gap if gap * FASTEST > 1 else None
    fps = float(round(fps)) if fps and abs(fps - round(fps)) < 1e-2 else fps  # times are float32
    return _sequence(path, Cache(positions, fps, float(times[0]) if gap else 0.0), options, read_mesh)


def read_npy(path: Path, options: ReadOptions, read_mesh: MeshReader) -> MeshSequence:
    """Read an array ``(F, V, 3)`` with the mesh of ``options.mesh``; frames are mapped, not loaded.

    Raises:
        InputError: no mesh is given, the file is not an array of numbers of that shape, the mesh has other vertices.
    """
    with reading(path, ".npy", remedy="write it by numpy.save"):
        array = np.lib.format.open_memmap(path, mode="r")  # numpy.load would open archives, too
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype.kind not in "fiu":
        raise InputError(f"{path} has shape {array.shape} and type {array.dtype}; (frames, vertices, 3) numbers are needed")
    return _sequence(path, Cache(array), options, read_mesh)


def write_pc2(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write positions as PC2; returns what it cannot hold.

    Raises:
        OutputError: the file cannot be written.
    """
    first = sequence.metadata.start_time * sequence.fps
    head = PC2_HEAD.pack(PC2_MAGIC, PC2_VERSION, sequence.n_vertices, first, 1.0, sequence.n_frames)
    return _write(sequence, path, head, "<f4", "PC2")


def write_mdd(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write positions as MDD; returns what it cannot hold.

    Raises:
        OutputError: the file cannot be written.
    """
    times = sequence.metadata.start_time + np.arange(sequence.n_frames) / sequence.fps
    head = MDD_HEAD.pack(sequence.n_frames, sequence.n_vertices) + times.astype(">f4").tobytes()
    return _write(sequence, path, head, ">f4", "MDD")


def write_npy(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write positions as a NumPy array ``(F, V, 3) float32``; returns what it cannot hold.

    Raises:
        OutputError: the file cannot be written.
    """
    import io

    stream = io.BytesIO()
    shape = (sequence.n_frames, sequence.n_vertices, 3)
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return _write(sequence, path, stream.getvalue(), "<f4", "NPY")


def _write(sequence: MeshSequence, path: Path, head: bytes, dtype: str, name: str) -> tuple[str, ...]:
    with unnamed_path(path) as temporary, open(temporary, "wb") as file:
        file.write(head)
        for _, block in sequence.chunks():
            file.write(np.ascontiguousarray(block, dtype).data)
    notes = (f"{name} holds positions alone; write one frame as a mesh file too, and read them together (mesh=, --mesh)",)
    return (*notes, origin_left_out(sequence.origin.tolist())) if sequence.origin.any() else notes


def _sequence(
    path: Path, cache: Cache, options: ReadOptions, read_mesh: MeshReader, notes: tuple[str, ...] = ()
) -> MeshSequence:
    if options.mesh is None:
        raise InputError(f"{path} holds positions alone; name a file with its triangles too (mesh=, --mesh base.obj)")
    mesh = read_mesh(options.mesh)
    n_vertices = cache.positions.shape[1]
    if mesh.n_vertices != n_vertices:
        raise InputError(f"{path} has {n_vertices} vertices, its mesh {os.fspath(options.mesh)} has {mesh.n_vertices}")
    fps = options.fps or cache.fps
    assumed = () if fps or len(cache.positions) == 1 else (ASSUMED_FPS,)
    rate = fps or DEFAULT_FPS
    start = cache.start if path.suffix.lower() != ".pc2" else cache.start / rate
    kept = tuple(note for note in mesh.notes if note != ASSUMED_FPS and "read alone" not in note)  # of the mesh it is meant
    return MeshSequence(
        CacheFrames(cache.positions),
        mesh.faces,
        rate,
        mesh.attributes,
        str(path),
        notes=(*kept, *notes, *assumed),
        parts=mesh.parts,
        polygons=mesh.polygons,
        materials=mesh.materials,
        images=mesh.images,
        metadata=replace(mesh.metadata, start_time=start, source=path.name),
    )


def _head(path: Path, size: int) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(size)
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror}; check the path") from exc


def _mapped(path: Path, offset: int, shape: tuple[int, int, int], dtype: str) -> Float32:
    """Map positions from a file whose header says how many there are, if that is how long it is."""
    if shape[0] < 1 or shape[1] < 1:
        raise InputError(f"{path} has {shape[0]} samples of {shape[1]} vertices; at least one of each is needed")
    needed, held = offset + 12 * shape[0] * shape[1], os.path.getsize(path)
    if held < needed:
        raise InputError(
            f"{path} says that it has {shape[0]} samples of {shape[1]} vertices, {needed} bytes, but has {held}; "
            "it is another format or cut short, so export it again"
        )
    mapped: Float32 = np.memmap(path, dtype, "r", offset, shape)
    return mapped
