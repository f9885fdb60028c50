"""Vertex animation textures in the layout of OpenVAT, an extension of Blender, for shaders of game engines.

A folder ``walk.openvat`` holds four files:

- ``walk.glb``: the mesh of the first frame, metres, Y up. Its second uv set addresses the textures, a pixel for each vertex.
- ``walk_vat.png``: 16 bits a channel; what each frame adds to the first frame's positions.
- ``walk_vnrm.png``: the same for normals n, as (n + 1) / 2.
- ``walk-remap_info.json``: the range of the differences, and the number of frames.

Vertex i of frame f has the pixel in column ``i % width`` and row ``(i // width) * frames + f``, counted from the top. A shader
adds f / height to the second uv set. Textures have Blender's axes, Z up. A position is
mesh + B(Min + (Max - Min) pixel / 65535), with B(x, y, z) = (x, z, -y).

Source: OpenVAT 1.1, sharpen3d/openvat on GitHub. A departure: Min and Max are exact, where OpenVAT rounds them to tenths.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import with_uv
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.attributes.surface_normals import surface_normals
from gvpipe.foundation.arrays import Array, Float32, Float64, UInt16
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.normal_writing import SplitNormals
from gvpipe.io.gltf.scene_writing import world_matrix
from gvpipe.io.gltf.split import Split, split_vertices
from gvpipe.io.gltf.writer import encode_glb
from gvpipe.io.losses import lost_notes
from gvpipe.io.normals.of_frames import frame_normals
from gvpipe.model.sequence import MeshSequence

LARGEST = 8192  # pixels of a side: what graphics cards and engines take everywhere
FULL = 65535
BLENDER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # from Y up to Z up
HELD = ("normal", "parts", "materials", "metadata")
UV, VAT = "uv", "uv1"  # the mesh's own texture coordinates, and those of the animation


def write_openvat(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write a sequence as a folder of textures and the mesh that shows them; returns what is not held, a line each.

    Raises:
        InputError: it has no triangles, or too many vertices and frames for a texture.
        OutputError: the folder or a file cannot be written.
    """
    if not len(sequence.faces):
        raise InputError(f"{sequence.name} has no triangles; a mesh that shows the textures needs one")
    split = split_vertices(sequence)
    width, height = texture_size(len(split.sources), sequence.n_frames, str(path))
    place = Placement(width, height, sequence.n_frames)
    turn = world_matrix(sequence.metadata)
    reader = _Frames(sequence, split, turn)
    low, high = reader.bounds()
    base, kept = _base(sequence, split, turn, reader, place.uv(len(split.sources)))
    base = replace(base, parts=tuple(replace(part, name=path.stem) for part in base.parts))
    encoder = encode_glb(base, path.stem)
    positions, normals = _textures(reader, place, low, high)
    files = {
        f"{path.stem}.glb": encoder.encode(base.read(0, 1)[0], {}),
        f"{path.stem}_vat.png": positions,
        f"{path.stem}_vnrm.png": normals,
        f"{path.stem}-remap_info.json": _remap_info(low, high, sequence.n_frames),
    }
    with atomic_files(path) as folder:
        for name, data in files.items():
            (folder / name).write_bytes(data)
    return _notes(sequence, turn, kept, float((high - low).max()) / FULL / 2)


class Placement:
    """Where the pixels of vertices are: textures of ``width`` x ``height`` pixels, for ``n_frames`` frames."""

    def __init__(self, width: int, height: int, n_frames: int) -> None:
        self.width, self.height, self.n_frames = width, height, n_frames

    def blank(self) -> UInt16:
        """A texture without values: ``(height, width, 3)``."""
        return np.zeros((self.height, self.width, 3), np.uint16)

    def fill(self, texture: UInt16, frame: int, pixels: UInt16) -> None:
        """Set the pixels ``(W, 3)`` of a frame in a texture."""
        for block, first in enumerate(range(0, len(pixels), self.width)):
            row = pixels[first : first + self.width]
            texture[block * self.n_frames + frame, : len(row)] = row

    def uv(self, n_vertices: int) -> Float64:
        """Texture coordinates ``(W, 2)`` of the first frame's pixels, from the lower left."""
        block, column = np.divmod(np.arange(n_vertices), self.width)
        return np.stack([(column + 0.5) / self.width, 1 - (block * self.n_frames + 0.5) / self.height], axis=1)


def texture_size(n_vertices: int, n_frames: int, where: str) -> tuple[int, int]:
    """Width and height of the smallest texture, powers of two, the squarest of several.

    Raises:
        InputError: none holds a pixel for each vertex and frame.
    """
    sizes = []
    for width in (1 << k for k in range(LARGEST.bit_length())):
        rows = -(-n_vertices // width) * n_frames
        height = 1 << (rows - 1).bit_length()
        sizes.append((width * height, max(width, height), width, height))
    fitting = [each for each in sizes if each[1] <= LARGEST]
    if not fitting:
        raise InputError(
            f"{where}: {n_vertices} vertices in {n_frames} frames need a texture of more than {LARGEST} x {LARGEST} pixels; "
            "write fewer frames (--frames), one part (--part), or a coarser level (--lod)"
        )
    return min(fitting)[2:]


class _Frames:
    """Differences of positions and normals, for the vertices that a GLB needs, in the textures' axes and metres."""

    def __init__(self, sequence: MeshSequence, split: Split, turn: Float64) -> None:
        self._sequence, self._split = sequence, split
        self._turn = BLENDER @ turn
        self._rotation = self._turn / np.cbrt(abs(np.linalg.det(self._turn)))
        self._first = sequence.read(0, 1)[0]
        frames = frame_normals(sequence)
        self._normals = None if frames is None else SplitNormals(frames, split, not len(frames.first))
        self.notes = self._normals.notes if self._normals else ()

    def bounds(self) -> tuple[Float64, Float64]:
        """Smallest and largest differences ``(3,)`` of all frames."""
        low, high = np.zeros(3), np.zeros(3)
        for _, block in self._sequence.chunks():
            for frame in block:
                change = self.change(frame)
                low, high = np.minimum(low, change.min(axis=0)), np.maximum(high, change.max(axis=0))
        return low, high

    def change(self, positions: Float32) -> Float64:
        """What a frame ``(V, 3)`` adds to the first one: ``(W, 3)``."""
        moved = (positions.astype(np.float64) - self._first) @ self._turn.T
        return np.asarray(moved[self._split.sources])

    def normals(self, frame: int, positions: Float32) -> Float64:
        """Unit normals ``(W, 3)`` of a frame: the sequence's, else those of its smooth surface."""
        sequence = self._sequence
        if self._normals is None:
            smooth = surface_normals(positions[None], sequence.faces, sequence.faces.reshape(-1), "angle")[0]
            own = np.zeros((sequence.n_vertices, 3), np.float32)
            own[: len(smooth)] = smooth
            rows = own[self._split.sources]
        else:
            fields = {"normal": sequence.fields["normal"].read(frame, frame + 1)[0]} if self._normals.is_field else {}
            rows = self._normals.of(positions, fields).values
        return np.asarray(rows @ self._rotation.T)

    def blocks(self) -> list[tuple[int, int]]:
        """Spans of frames."""
        return list(self._sequence.spans())

    def read(self, start: int, stop: int) -> Float32:
        """Frames of the sequence."""
        return self._sequence.read(start, stop)


def _textures(frames: _Frames, place: Placement, low: Float64, high: Float64) -> tuple[bytes, bytes]:
    """The two textures as PNG."""
    from gvpipe.media.png import encode_png16

    positions, normals = place.blank(), place.blank()
    scale = np.where(high > low, FULL / np.where(high > low, high - low, 1), 0)
    for start, stop in frames.blocks():
        for i, frame in enumerate(frames.read(start, stop)):
            place.fill(positions, start + i, _rounded((frames.change(frame) - low) * scale))
            place.fill(normals, start + i, _rounded((frames.normals(start + i, frame) + 1) * (FULL / 2)))
    return encode_png16(positions), encode_png16(normals)


def _rounded(values: Float64) -> UInt16:
    return np.clip(np.rint(values), 0, FULL).astype(np.uint16)


def _remap_info(low: Float64, high: Float64, n_frames: int) -> bytes:
    info = {"os-remap": {"Min": low.tolist(), "Max": high.tolist(), "Frames": n_frames}}
    return (json.dumps(info, indent=4) + "\n").encode()


def _base(
    sequence: MeshSequence, split: Split, turn: Float64, frames: _Frames, address: Float64
) -> tuple[MeshSequence, tuple[str, ...]]:
    """The mesh of the first frame as one object, with the ``address (W, 2)`` of its pixels; the attributes that it keeps."""
    first = sequence.read(0, 1)[0]
    positions = (first @ turn.T)[split.sources].astype(np.float32)
    n_vertices = len(positions)
    own_uv = next((name for name in sorted(sequence.attributes) if sequence.attributes[name].kind == "uv"), "")
    attributes: dict[str, Attribute] = {}
    for name, values in split.attributes.items():
        given = sequence.attributes[name]
        if given.kind not in ("uv", "normal", "tangent"):
            attributes[name] = Attribute(values, "vertex", given.kind, unit=given.unit)
    uv: Array = split.attributes[own_uv] if own_uv in split.attributes else np.zeros((n_vertices, 2))
    attributes[UV] = Attribute(np.asarray(uv, np.float32), "vertex", "uv")
    attributes[VAT] = Attribute(address, "vertex", "uv")
    back = frames.normals(0, first) @ BLENDER
    attributes["normal"] = Attribute(back.astype(np.float32), "vertex", "normal")
    groups = [(faces + shape.start, material) for shape in split.shapes for faces, material in shape.primitives]
    ends = np.cumsum([len(faces) for faces, _ in groups]).tolist()
    parts = tuple(
        Part("mesh", (0, n_vertices), (end - len(faces), end), material)
        for (faces, material), end in zip(groups, ends, strict=True)
    )
    given = with_uv(sequence.materials, [own_uv])
    renamed: list[dict[str, Any]] = [
        {role: replace(texture, uv=UV) for role, texture in each.textures.items()} for each in given
    ]
    materials = tuple(replace(each, **textures) for each, textures in zip(given, renamed, strict=True))
    base = MeshSequence(
        positions[None],
        np.concatenate([faces for faces, _ in groups]).astype(np.int32),
        sequence.fps,
        attributes,
        sequence.name,
        turn @ sequence.origin,
        parts=parts,
        materials=materials,
        images=sequence.images,
        metadata=Metadata("y", 1.0, texts=sequence.metadata.texts),
    )
    return base, tuple(name for name in (*attributes, own_uv) if name in sequence.attributes)


def _notes(sequence: MeshSequence, turn: Float64, kept: tuple[str, ...], precision: float) -> tuple[str, ...]:
    said = [f"positions are rounded to 16 bits of their range, by {precision:.2g} metres at most"]
    if not np.array_equal(turn, np.eye(3)):
        said.append("OpenVAT is in metres, and its mesh has Y up; the scene was turned or scaled")
    if sequence.n_frames > 1:
        said.append(f"OpenVAT has no frame rate; give the shader {sequence.fps:g} frames per second")
    return (*said, *lost_notes(sequence, "OpenVAT", (*HELD, *kept)))
