"""Sequences as GLB with a skeleton: the bind pose once, and keys of the joints.

A joint's motion is affine: two nodes (`gvpipe.io.scene.affine_nodes`), so that it is exact in every engine that multiplies
matrices down the tree. Or it is rigid, and one node below its parent's. Inverse bind matrices take positions to the joints'
pivots. The meshes are roots, as glTF wants skinned ones; one node above all joints turns and scales the scene.

Corrective shapes are morph targets, which glTF adds before joints move a vertex; every mesh has those that change it.

A packed file has positions of 16 bits, whose lattice the inverse bind matrices undo, and keys as fine as they need to be.

Source: Khronos, glTF 2.0 specification, sections 3.7.3 (skins) and 3.11 (animations).
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Float32, Float64, Int32, Int64, UInt16
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.attribute_writing import GltfAttribute
from gvpipe.io.gltf.clips import FPS
from gvpipe.io.gltf.draco_writing import draco_notes
from gvpipe.io.gltf.glb import Filtered, Glb, glb_at
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.meshopt.writing import QUATERNION_BITS, pack_quaternions
from gvpipe.io.gltf.morph_writing import write_deltas
from gvpipe.io.gltf.quantizing import EXACT, FULL, POSITION_BITS, steps_of
from gvpipe.io.gltf.scene_writing import Prepared, Written, normals_of, prepare, write_scene
from gvpipe.io.losses import NO_PARENTS, TURNED_NORMALS
from gvpipe.io.scene.affine_nodes import AffineNodes, Keys, find_keys, moves
from gvpipe.mesh.lattice import Lattice
from gvpipe.model.clips import Clip
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin, extent_of

MAX_JOINTS = 1 << 16  # numbers of joints have 16 bits
STANDS = 1e-9  # of a rotation or a scale, and of the bind pose's extent for a translation: what differs by less stands still
LEAST_BITS = 4  # of quaternions
COMPARED = 16  # frames, of those that lie evenly, and of those where joints are farthest from rest
TINY, FLAT = 1e-100, 1e-6  # FLAT: of a cube's volume
ANGLE = 1.3  # radians: what rounding turns a rotation by, times the largest integer


def write_skinned(sequence: MeshSequence, skin: Skin, path: Path, compress: str = "none") -> tuple[str, ...]:
    """Write a sequence as the skin moves it; return what the file cannot hold, a line each.

    Args:
        sequence: its triangles, attributes, parts and materials.
        skin: of its vertices, and of as many frames.
        path: of the ``.glb``.
        compress: ``"meshopt"``: by EXT_meshopt_compression and KHR_mesh_quantization; ``"draco"``: the bind pose by
            KHR_draco_mesh_compression; or ``"none"``.

    Raises:
        InputError: the skin has too many joints, or the file would be longer than a GLB can be.
        OutputError: the file cannot be written.
    """
    if skin.joints > MAX_JOINTS:
        raise InputError(f"{path}: {skin.joints} joints; glTF holds {MAX_JOINTS}, so make the skin with fewer")
    prepared = prepare(sequence, is_packed=compress == "meshopt", is_skinned=True)
    with glb_at(path, compress) as glb:
        _write(glb, prepared, skin)
        said = draco_notes(glb) if glb.is_draco else ()
    parents = any(shape.parent for shape in prepared.split.shapes)
    turned = prepared.normals is not None
    return (*prepared.notes, *said, *((NO_PARENTS,) if parents else ()), *((TURNED_NORMALS,) if turned else ()))


def _write(glb: Glb, prepared: Prepared, skin: Skin) -> None:
    sources = prepared.split.sources
    name = prepared.sequence.metadata.texts.get("clip") or "animation"
    clips = skin.clips or (Clip(name, 0, skin.n_frames),)
    near = _with_used_vertices(skin, prepared.sequence.faces)
    extent = extent_of(near.bind)
    keys = find_keys(near.part(clips[0].start, clips[0].stop))
    limit = max(keys.precision, EXACT * extent)
    rounded = replace(skin, weights=(_as_fractions(skin.weights) / FULL).astype(np.float32))
    is_near = _farthest(skin, rounded) <= limit
    weights = _as_fractions(skin.weights[sources]) if is_near else skin.weights[sources]
    joints = skin.indices[sources].astype(np.uint8 if skin.joints <= 256 else np.uint16)
    influences = GltfAttribute("JOINTS_0", joints), GltfAttribute("WEIGHTS_0", weights, is_near)
    normals = normals_of(prepared, 0, prepared.sequence.read(0, 1)[0])
    if normals is not None:
        normals = replace(normals, values=_to_bind(skin, sources, normals.values))
    shown = influences if normals is None else (normals, *influences)
    lattice = Lattice.over(skin.bind, POSITION_BITS) if glb.is_packed else None
    positions: Array = skin.bind[sources]
    if lattice is not None:
        integers = lattice.quantise(skin.bind)
        if _farthest(skin, replace(skin, bind=lattice.points_at(integers).astype(np.float32))) <= limit:
            positions = integers[sources].astype(np.uint16)
        else:
            lattice = None
    rounding = limit / _stretch(skin, np.arange(len(skin.bind))) if glb.is_draco else 0.0
    written = write_scene(glb, prepared, positions, shown, is_skinned=True, step=rounding, is_morphed=len(skin.shapes) > 0)
    for one in written:
        glb.tree["nodes"][one.node]["skin"] = 0
    unit = 1.0 if lattice is None else lattice.step
    step = keys.precision / max(np.sqrt(len(skin.shapes)), 1) / _stretch(skin, np.flatnonzero(skin.shapes.any(axis=(0, 2))))
    shaped = _write_shapes(glb, written, skin, sources, unit, step / unit)
    if skin.parents is None:
        numbers = [_write_joint(glb, keys.nodes, j) for j in range(skin.joints)]
        tops = [outer for outer, _ in numbers]
    else:
        numbers, tops = _write_tree(glb, keys.nodes, skin.parents)
    root = glb.append("nodes", {"name": "skeleton", "children": tops, **prepared.place})
    inverse = glb.array(_inverse_binds(keys.pivots, lattice))
    glb.append("skins", {"joints": [inner for _, inner in numbers], "skeleton": root, "inverseBindMatrices": inverse})
    glb.tree["scenes"][0]["nodes"].append(root)
    rest = AffineNodes(*(each[0] for each in keys.nodes))
    longest = float(np.linalg.norm(skin.shapes, axis=2).max(initial=0))
    for clip in clips:
        own = keys if clip is clips[0] else find_keys(near.part(clip.start, clip.stop))
        number = _write_keys(glb, prepared.sequence.fps, clip.name, own, rest, numbers, extent)
        _write_shape_keys(
            glb, number, prepared.sequence.fps, skin.shape_weights[clip.start : clip.stop], shaped, step / (longest or 1.0)
        )


def _write_shapes(
    glb: Glb, written: list[Written], skin: Skin, sources: Int64, unit: float, step: float
) -> list[tuple[int, Int64]]:
    """Add morph targets to meshes; returns nodes that have some, and which shapes ``(c,)`` these are.

    Args:
        written: the meshes.
        sources: ``(W,)``, the skin's vertex of each that is written.
        unit: of the file's positions.
        step: how far off packed targets may be, in such units.
    """
    shaped = []
    for one in written:
        own = skin.shapes[:, sources[one.shape.start : one.shape.stop]] / np.float32(unit)
        used = np.flatnonzero(own.any(axis=(1, 2)))
        if not len(used):
            continue
        mesh = glb.tree["meshes"][one.mesh]
        mesh["weights"] = _plain(skin.shape_weights[0, used])
        targets = [{"POSITION": write_deltas(glb, own[number], "POSITION", step)} for number in used]
        for primitive in mesh["primitives"]:
            primitive["targets"] = targets
        shaped.append((one.node, used))
    return shaped


def _write_shape_keys(
    glb: Glb, animation: int, fps: float, weights: Float64, shaped: list[tuple[int, Int64]], step: float
) -> None:
    """Add the weights ``(F, C)`` of corrective shapes to an animation, a key in each frame; within a step in packed files."""
    if not shaped:
        return
    tree = glb.tree["animations"][animation]
    times = glb.block((np.arange(len(weights)) / fps).astype(np.float32)[:, None], bounds=True)
    known: dict[bytes, int] = {}
    for node, used in shaped:
        if used.tobytes() not in known:
            values = weights[:, used].reshape(-1, 1)
            filtered = steps_of(values, step) if glb.is_packed else None
            known[used.tobytes()] = len(tree["samplers"])
            tree["samplers"].append({"input": times, "output": glb.block(values.astype(np.float32), filtered=filtered)})
        tree["channels"].append({"sampler": known[used.tobytes()], "target": {"node": node, "path": "weights"}})


def _stretch(skin: Skin, changed: Int64) -> float:
    """How much longer joints make what is added to vertices ``(n,)``, at most, in some of the frames; at least 1."""
    blends = (skin.blended(k)[changed, :, :3] for k in _some_frames(skin)) if len(changed) else ()
    return max(1.0, *(math.sqrt(np.square(each).sum(axis=(1, 2)).max() / 3) for each in blends), 1.0)


def _with_used_vertices(skin: Skin, faces: Int32) -> Skin:
    """A skin that has vertices of no triangle where some other one is: how exact a file is does not hang on them."""
    used = np.unique(faces)
    bind = np.full_like(skin.bind, skin.bind[used[0]])
    bind[used] = skin.bind[used]
    return replace(skin, bind=bind)


def _farthest(skin: Skin, other: Skin) -> float:
    """How far apart vertices of two skins of the same joints are, at most, in some of the frames.

    Weights and positions in fewer bits are near where joints are, and far where joints part.
    """
    size = extent_of(skin.bind) or 1.0
    frames = _some_frames(skin)
    off = ((skin.evaluate(k).astype(np.float64) - other.evaluate(k)) / size for k in frames)
    return size * max(float(np.linalg.norm(each, axis=1).max(initial=0)) for each in off)


def _some_frames(skin: Skin) -> list[int]:
    """Frames that lie evenly, and those where joints are farthest from rest."""
    moved = np.abs(skin.transforms - np.eye(4))
    moved[..., :3, 3] /= extent_of(skin.bind) or 1.0
    wildest = np.argsort(-moved.max(axis=(1, 2, 3)))[:COMPARED]
    found: list[int] = np.unique([*np.linspace(0, skin.n_frames - 1, COMPARED).astype(int), *wildest]).tolist()
    return found


def _inverse_binds(pivots: Float64, lattice: Lattice | None) -> Float32:
    """``(J, 16)``, each by columns: from the file's positions to those about each joint's pivot."""
    step, origin = (1.0, np.zeros(3)) if lattice is None else (lattice.step, np.array(lattice.origin))
    result = np.tile(np.diag([step, step, step, 1.0]), (len(pivots), 1, 1))
    result[:, :3, 3] = origin - pivots
    return np.swapaxes(result, 1, 2).reshape(-1, 16).astype(np.float32)


def _to_bind(skin: Skin, sources: Int64, normals: Array) -> Float32:
    """Normals ``(W, 3)`` of the first frame, as the bind pose has them: ``A^-1 n``.

    Engines turn normals by the joints' matrices as they are (three.js, Babylon.js), not by their inverse transpose. So ``A``
    takes them to the frame. Those of vertices that a joint flattens stay as they are.
    """
    blended = np.einsum("wi,wiab->wab", skin.weights[sources], skin.transforms[0, skin.indices[sources], :3, :3])
    is_flat = np.abs(np.linalg.det(blended)) < FLAT * np.maximum(np.abs(blended).max(axis=(1, 2)), TINY) ** 3
    blended[is_flat] = np.eye(3)
    turned = np.linalg.solve(blended, normals.astype(np.float64)[:, :, None])[:, :, 0]
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.where(length > 0, turned / np.where(length > 0, length, 1), normals).astype(np.float32)


def _as_fractions(weights: Float32) -> UInt16:
    """Weights ``(W, 4)`` in 1/65535, which add up to exactly 1: the largest one takes what rounding leaves."""
    rounded = np.rint(weights.astype(np.float64) * FULL).astype(np.int64)
    rows, largest = np.arange(len(weights)), weights.argmax(axis=1)
    rounded[rows, largest] += FULL - rounded.sum(axis=1)
    return rounded.astype(np.uint16)


def _write_tree(glb: Glb, nodes: AffineNodes, parents: Int32) -> tuple[list[tuple[int, int]], list[int]]:
    """Joints that have parents, a node each, as they are in the first frame: each node twice, and those of the roots."""
    first = len(glb.tree["nodes"])
    for j in range(len(parents)):
        below = [first + int(child) for child in np.flatnonzero(parents == j)]
        glb.append("nodes", {"name": f"joint_{j}"} | ({"children": below} if below else {}) | _placed(nodes, j))
    return [(first + j, first + j) for j in range(len(parents))], [first + int(j) for j in np.flatnonzero(parents < 0)]


def _placed(nodes: AffineNodes, j: int) -> Json:
    return {
        "translation": _plain(nodes.translations[0, j]),
        "rotation": _plain(nodes.rotations[0, j]),
        "scale": _plain(nodes.scales[0, j]),
    }


def _write_joint(glb: Glb, nodes: AffineNodes, j: int) -> tuple[int, int]:
    """The two nodes of a joint as they are in the first frame: the outer one, and the joint itself below it."""
    inner = glb.append("nodes", {"name": f"joint_{j}", "rotation": _plain(nodes.inner[0, j])})
    return glb.append("nodes", {"name": f"joint_{j}_frame", "children": [inner], **_placed(nodes, j)}), inner


def _write_keys(
    glb: Glb, fps: float, name: str, keys: Keys, rest: AffineNodes, numbers: list[tuple[int, int]], extent: float
) -> int:
    """Add an animation: keys of what moves, or is not as at rest ``(J, ...)``; one that is, has keys of its first joint.

    Returns its number.
    """
    times = (np.arange(len(keys.is_key)) / (keys.per_frame * fps)).astype(np.float32)[:, None]
    samplers: list[Json] = []
    channels: list[Json] = []
    known: dict[bytes, int] = {}  # times are written once for all joints that share them

    def add(node: int, path: str, is_key: Bool, values: Float64, step: float) -> None:
        shown = is_key.tobytes()
        if shown not in known:
            known[shown] = glb.block(times[is_key], bounds=True)
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        write = _write_rotations if path == "rotation" else _write_vectors
        samplers.append({"input": known[shown], "output": write(glb, values[is_key], step)})  # LINEAR, as by default

    for j, (outer, inner) in enumerate(numbers):
        reach = max(float(keys.reach[j]), STANDS * extent, TINY)
        scaled = keys.precision / reach
        turned = scaled / max(1.0, float(np.abs(keys.nodes.scales[:, j]).max()))  # an angle
        moved = [
            (outer, "translation", keys.nodes.translations, rest.translations, STANDS * extent, keys.precision),
            (outer, "rotation", keys.nodes.rotations, rest.rotations, STANDS, turned),
            (outer, "scale", keys.nodes.scales, rest.scales, STANDS, scaled),
        ]
        if inner != outer:
            moved.append((inner, "rotation", keys.nodes.inner, rest.inner, STANDS, turned))
        for node, path, values, still, tolerance, step in moved:
            if moves(values[:, j], still[j], tolerance):
                add(node, path, keys.is_key[:, j], values[:, j], step)
    if not channels:
        add(numbers[0][0], "translation", keys.is_key[:, 0], keys.nodes.translations[:, 0], keys.precision)
    return glb.append("animations", {"name": name, "samplers": samplers, "channels": channels, "extras": {FPS: fps}})


def _write_vectors(glb: Glb, values: Float64, step: float) -> int:
    """Add translations or scales ``(n, 3)``, within a step where the file is packed."""
    return glb.block(values.astype(np.float32), filtered=steps_of(values, step) if glb.is_packed else None)


def _write_rotations(glb: Glb, values: Float64, angle: float) -> int:
    """Add quaternions ``(n, 4)``, within an angle: as integers of 16 bits where these hold it."""
    if angle * (1 << (QUATERNION_BITS - 1)) < ANGLE:
        return glb.block(values.astype(np.float32))
    bits = max(int(np.ceil(np.log2(ANGLE / angle))) + 1, LEAST_BITS)
    filtered = Filtered(pack_quaternions(values, bits), "QUATERNION") if glb.is_packed else None
    return glb.block(np.rint(32767 * values).astype(np.int16), normalized=True, filtered=filtered)


def _plain(values: Array) -> list[float]:
    """Numbers as float32 has them, in few digits; the rest pose is the first frame."""
    return [float(str(each)) for each in values.astype(np.float32)]
