"""Clips: the animations of a file, by name, as curves of its nodes' translations, rotations, scales and morph weights.

Source: Khronos, glTF 2.0 specification, section 3.11 (animations).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.io.damage import unknown_name
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.interpolation import MODES, Curve
from gvpipe.io.gltf.json_fields import Json, child, index, indices, integer, objects, text
from gvpipe.io.gltf.pointers import animated_property

WIDTHS = {
    "translation": 3,
    "rotation": 4,
    "scale": 3,
    "visible": 1,
}  # components of an animated property; weights have any number
VALUE_TYPES = ("SCALAR", "VEC3", "VEC4")
LATEST = 1e7  # seconds
FPS = "fps"  # among the extras of animations that gvpipe writes
MOST_FPS = 100_000


@dataclass(frozen=True, eq=False)
class Clip:
    """An animation.

    Args:
        name: its own, or ``"animation_2"`` by its number.
        curves: by node and property.
        fps: frames per second that the file states, as gvpipe's own do; 0 for none.
    """

    name: str
    curves: dict[tuple[int, str], Curve]
    fps: float = 0.0

    @property
    def start(self) -> float:
        """Time of the first key, seconds."""
        return min((float(curve.times[0]) for curve in self.curves.values()), default=0.0)

    @property
    def stop(self) -> float:
        """Time of the last key, seconds."""
        return max((float(curve.times[-1]) for curve in self.curves.values()), default=0.0)

    @property
    def keys(self) -> Float64:
        """Times of all keys, seconds, rising; 0 for a clip without curves."""
        return np.unique(np.concatenate([curve.times for curve in self.curves.values()] or [np.zeros(1)]))


NO_CLIP = Clip("", {})


def clip_names(document: Document) -> list[str]:
    """Names of the file's animations that move a mesh: not those of cameras and lights alone."""
    moving, n_nodes = moving_nodes(document), len(document.items("nodes"))
    return [
        text(clip, "name") or f"animation_{number}"
        for number, clip in enumerate(document.items("animations"))
        if any(
            node in moving or node >= n_nodes  # which is refused when it is read
            for channel in objects(clip, "channels", f"animation_{number}")
            for node, _ in animated_property(document, child(channel, "target", "a channel"), "a channel")
        )
    ]


def moving_nodes(document: Document) -> set[int]:
    """Nodes whose properties move a mesh: those that show one, joints of their skins, and all above them."""
    nodes, skins = document.items("nodes"), document.items("skins")
    above = {
        one: number for number, node in enumerate(nodes) for one in indices(node, "children", f"node {number}", len(nodes))
    }
    pending = [number for number, node in enumerate(nodes) if "mesh" in node]
    for number in list(pending):
        skin = index(nodes[number], "skin", f"node {number}", len(skins))
        pending += [] if skin is None else indices(skins[skin], "joints", f"skin {skin}", len(nodes))
    found: set[int] = set()
    while pending:
        number = pending.pop()
        if number not in found:
            found.add(number)
            pending += [above[number]] if number in above else []
    return found


def find_clip(document: Document, name: str | None) -> int:
    """The number of the animation of that name; of the first that moves anything for None.

    Raises:
        InputError: there is none of that name.
    """
    names = [text(clip, "name") or f"animation_{number}" for number, clip in enumerate(document.items("animations"))]
    chosen = clip_names(document)[0] if name is None else name
    if chosen not in names:
        raise unknown_name("clip", chosen, names)
    return names.index(chosen)


def clip_times(accessors: Accessors, name: str) -> tuple[float, float]:
    """First and last second of the keys of an animation; raises `ValueError`."""
    clip, where = accessors.document.item("animations", find_clip(accessors.document, name))
    inputs = {integer(one, "input", where) for one in objects(clip, "samplers", where)}
    keys = [accessors.read_floats(one, ("SCALAR",), where) for one in sorted(inputs)]
    every = np.concatenate([np.zeros((int(not keys), 1), np.float32), *keys])
    return float(every.min()), float(every.max())


def read_clip(accessors: Accessors, number: int, morph_counts: dict[int, int]) -> Clip:
    """Read an animation; raises `ValueError`.

    Args:
        accessors: of the file.
        number: of the animation.
        morph_counts: how many morph targets a node's mesh has; weights of other nodes are left out.
    """
    clip, where = accessors.document.item("animations", number)
    samplers = objects(clip, "samplers", where)
    n_nodes = len(accessors.document.items("nodes"))
    curves: dict[tuple[int, str], Curve] = {}
    for i, channel in enumerate(objects(clip, "channels", where)):
        name = f"{where}, channel {i}"
        target = child(channel, "target", name)
        index(target, "node", name, n_nodes)
        for node, path in animated_property(accessors.document, target, name):
            if node >= n_nodes:
                raise ValueError(f"{name} moves node {node}, but there are only {n_nodes}")
            width = WIDTHS.get(path) or (morph_counts.get(node, 0) if path == "weights" else 0)
            if not width:
                continue  # of a mesh that is not shown, say
            sampler = samplers[integer(channel, "sampler", name, most=len(samplers) - 1)]
            curves[node, path] = _read_curve(accessors, sampler, width, path, name)
    extras = clip.get("extras")
    stated = extras.get(FPS) if isinstance(extras, dict) else None
    fps = float(stated) if isinstance(stated, int | float) and 0 < stated <= MOST_FPS else 0.0
    return Clip(text(clip, "name") or f"animation_{number}", curves, fps)


def _read_curve(accessors: Accessors, sampler: Json, width: int, path: str, name: str) -> Curve:
    mode = "STEP" if path == "visible" else text(sampler, "interpolation", "LINEAR")
    if mode not in MODES:
        raise ValueError(f"{name} is interpolated by {mode!r}; one of {', '.join(MODES)} is needed")
    times = accessors.read_floats(integer(sampler, "input", name), ("SCALAR",), f"{name}, times")[:, 0].astype(np.float64)
    if not (np.abs(times) <= LATEST).all() or (np.diff(times) < 0).any():
        raise ValueError(f"{name}: its times do not rise, or are not finite")
    values = accessors.read_floats(integer(sampler, "output", name), VALUE_TYPES, f"{name}, values").astype(np.float64)
    shape = (len(times), 3, width) if mode == "CUBICSPLINE" else (len(times), width)
    if values.size != np.prod(shape):
        raise ValueError(f"{name} has {values.size} numbers for {len(times)} keys of {width}; {np.prod(shape)} are needed")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} has values that are not finite")
    return Curve(times, values.reshape(shape), mode, path == "rotation")


def key_rate(clip: Clip, jump: float) -> float:
    """How many keys a second the densest curve has; keys closer than ``jump`` seconds are one. A clip may state it itself."""
    if clip.fps:
        return clip.fps
    gaps: list[Float64] = [np.diff(curve.times) for curve in clip.curves.values()]
    apart = [gap[gap > jump].min() for gap in gaps if (gap > jump).any()]
    return 1 / float(min(apart)) if apart else 0.0
