"""Sequences as GLB: a file for each frame, or one animated file.

In an animated file each distinct frame after the first is a morph target: what it adds to the first frame's positions and
normals. Vertices that do not move are left out (sparse accessors). A target has weight 1 in its frames and 0 in others. Weights
are linear between frames, so positions are interpolated.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.io.gltf.clips import FPS
from gvpipe.io.gltf.draco_writing import draco_notes
from gvpipe.io.gltf.glb import Glb, glb_at
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.morph_writing import write_deltas
from gvpipe.io.gltf.normal_writing import NORMAL
from gvpipe.io.gltf.quantizing import EXACT
from gvpipe.io.gltf.scene_writing import Prepared, Written, frame_attributes, normals_of, prepare, write_scene
from gvpipe.io.mesh import FrameEncoder
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import extent_of

MANY_TARGETS = 2048  # layers of a texture in most browsers, which hold a target each
ROUNDING = 1e-6  # of a normal: triangles that do not turn may turn it by as much
SMALL_INTEGERS = ("float32", "int8", "uint8", "int16", "uint16")


def encode_glb(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames, each a GLB with all attributes, parts, materials and images."""
    fields = tuple(
        name
        for name, one in sequence.fields.items()
        if one.domain == "vertex"
        and one.n_components <= 4
        and one.dtype.name in SMALL_INTEGERS
        and name not in sequence.attributes
    )
    prepared = prepare(sequence, fields)

    def encode(positions: Float32, values: Mapping[str, Array]) -> bytes:
        glb = Glb()
        own = () if prepared.normals is None else (prepared.normals.of(positions, values),)
        write_scene(glb, prepared, positions[prepared.split.sources], (*own, *frame_attributes(prepared, values)))
        data = glb.data()
        glb.close()
        return data

    return FrameEncoder(encode, fields, prepared.notes)


def write_animated(sequence: MeshSequence, path: Path, compress: str = "none") -> tuple[str, ...]:
    """Write a sequence as one animated GLB, or one frame as a still one; return what it cannot hold, a line each.

    Args:
        sequence: to be written.
        path: of the ``.glb``.
        compress: ``"meshopt"`` or ``"draco"``, with positions within `quantizing.EXACT`; or ``"none"``.

    Raises:
        InputError: it would be longer than a GLB can be.
        OutputError: the file cannot be written.
    """
    prepared = prepare(sequence, is_packed=compress == "meshopt")
    with glb_at(path, compress) as glb:
        n_targets = _write_animation(glb, prepared)
        said = draco_notes(glb) if glb.is_draco else ()
    return (*prepared.notes, *animation_notes(n_targets), *said)


@dataclass(eq=False)
class Targets:
    """Morph targets of a mesh: their accessors by attribute, and the one of each frame, -1 for none.

    Args:
        written: the mesh.
        step: of positions, where they are packed.
    """

    written: Written
    step: float
    accessors: list[dict[str, int]] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)
    known: dict[bytes, int] = field(default_factory=dict)

    def add(self, glb: Glb, deltas: Mapping[str, Float32]) -> None:
        """Add a frame, which differs from the first by ``deltas (W, 3)`` of each attribute; equal frames share a target."""
        own = {name: values[self.written.shape.start : self.written.shape.stop] for name, values in deltas.items()}
        if not any(values.any() for values in own.values()):
            self.frames.append(-1)
            return
        digest = hashlib.sha256(b"".join(values.tobytes() for values in own.values())).digest()
        if digest not in self.known:
            self.known[digest] = len(self.accessors)
            self.accessors.append({name: write_deltas(glb, values, name, self.step) for name, values in own.items()})
        self.frames.append(self.known[digest])


def _write_animation(glb: Glb, prepared: Prepared) -> int:
    """Add the scene and its animation; returns the largest number of morph targets of a mesh."""
    moving = write_moving(glb, prepared)
    if prepared.sequence.n_frames > 1:
        _write_channels(glb, prepared.sequence, moving)
    return most_targets(moving)


def write_moving(glb: Glb, prepared: Prepared) -> list[Targets]:
    """Add the scene and its morph targets; returns those of the meshes that move."""
    sequence, sources = prepared.sequence, prepared.split.sources
    first = sequence.read(0, 1)[0]
    base, normals = first[sources], normals_of(prepared, 0, first)
    step = EXACT / 2 * extent_of(first)  # of the base and of what targets add to it
    scene = write_scene(glb, prepared, base, () if normals is None else (normals,), step=step, is_morphed=sequence.n_frames > 1)
    if sequence.n_frames == 1:
        return []
    targets = [Targets(one, step) for one in scene]
    for start, block in sequence.chunks():
        for i, frame in enumerate(block):
            deltas = {"POSITION": frame[sources] - base}
            own = normals_of(prepared, start + i, frame)
            if normals is not None and own is not None:
                turns = own.values - normals.values
                turns[np.abs(turns).max(axis=1) < ROUNDING] = 0
                deltas[NORMAL] = turns
            for one in targets:
                one.add(glb, deltas)
    moving = [one for one in targets if one.accessors]
    for one in moving:
        mesh = glb.tree["meshes"][one.written.mesh]
        mesh["weights"] = [0] * len(one.accessors)
        for primitive in mesh["primitives"]:
            primitive["targets"] = one.accessors
    return moving


def most_targets(moving: list[Targets]) -> int:
    """The largest number of morph targets of a mesh."""
    return max((len(one.accessors) for one in moving), default=0)


def weight_channels(glb: Glb, moving: list[Targets], times: Float64) -> list[tuple[Json, Json]]:
    """A sampler and a target for the weights of each moving mesh, given the seconds ``(F,)`` of its frames."""
    if not moving:
        return []
    time = glb.array(times.astype(np.float32)[:, None], bounds=True)
    return [
        (
            {"input": time, "output": _write_weights(glb, one), "interpolation": "LINEAR"},
            {"node": one.written.node, "path": "weights"},
        )
        for one in moving
    ]


def write_animation(glb: Glb, sequence: MeshSequence, channels: list[tuple[Json, Json]]) -> None:
    """Add the animation, named as that which the sequence was read from."""
    animation = {
        "name": sequence.metadata.texts.get("clip") or "animation",
        "samplers": [sampler for sampler, _ in channels],
        "channels": [{"sampler": i, "target": target} for i, (_, target) in enumerate(channels)],
        "extras": {FPS: sequence.fps},
    }
    glb.append("animations", animation)


def _write_channels(glb: Glb, sequence: MeshSequence, moving: list[Targets]) -> None:
    """Add the animation of the weights; a scene without movement has one of its first node, which says how long it is."""
    times = np.arange(sequence.n_frames) / sequence.fps
    channels = weight_channels(glb, moving, times)
    if not moving:
        root = glb.tree["scenes"][0]["nodes"][0]
        place = np.array([glb.tree["nodes"][root].get("translation", [0, 0, 0])] * 2, np.float32)
        ends = glb.array(times[[0, -1]].astype(np.float32)[:, None], bounds=True)
        sampler: Json = {"input": ends, "output": glb.array(place), "interpolation": "STEP"}
        channels = [(sampler, {"node": root, "path": "translation"})]
    write_animation(glb, sequence, channels)


def _write_weights(glb: Glb, targets: Targets) -> int:
    """The weights of all targets in all frames, one after the other: ``(F M, 1)``, zeros but for one a frame."""
    frames = np.array(targets.frames)
    shown = np.flatnonzero(frames >= 0)
    n_targets = len(targets.accessors)
    places = shown * n_targets + frames[shown]
    return glb.sparse(np.ones((len(places), 1), np.float32), places, (len(frames) * n_targets, 1))


def animation_notes(n_targets: int) -> tuple[str, ...]:
    """What viewers cannot show."""
    if n_targets <= MANY_TARGETS:
        return ()
    return (f"it has {n_targets} morph targets; many viewers show at most {MANY_TARGETS}",)
