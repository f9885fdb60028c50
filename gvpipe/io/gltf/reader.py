"""glTF files as frames and as sequences: a still file is a frame, an animated one a sequence.

Frames of a clip are evaluated when they are read, so a long clip needs no more memory than a short one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from gvpipe.asset.attribute import guess_kind
from gvpipe.foundation.arrays import Array, Float32, Float64, Floats
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.foundation.notes import DEFAULT_FPS
from gvpipe.io.damage import reading
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.clips import Clip, clip_names, clip_times, key_rate
from gvpipe.io.gltf.document import load_document
from gvpipe.io.gltf.json_fields import rounded_up
from gvpipe.io.gltf.poses import Poses
from gvpipe.io.gltf.scene import OpenScene, Scene, open_scene, read_scene
from gvpipe.io.gltf.scene_attributes import attribute_names, scene_attributes
from gvpipe.io.gltf.turns import find_turns
from gvpipe.io.mesh import FrameValues, Mesh
from gvpipe.io.options import NO_OPTIONS, ReadOptions
from gvpipe.model.origin import choose_origin
from gvpipe.model.sequence import MeshSequence

MAX_FRAMES = 1_000_000
JUMP = 1 / 240  # seconds: keys closer than this are a jump, not a rate
NEAR_KEY = 1e-3  # frames
LOW_RATE = 24.0  # keys per second below which movement between keys would be lost
NEAR = 5e-4  # part by which a rate of keys, found from float32 times, may miss an integer


class GltfLoader:
    """Loads the frames of one sequence; after the first, without what is the same in all of them."""

    def __init__(self) -> None:
        self._is_first = True

    def __call__(self, path: Path) -> Mesh:
        """Load one still file, binary or text by its first bytes, whatever its name.

        Raises:
            InputError: it is animated.
            ValueError: it cannot be read; the caller names the file.
        """
        document = load_document(path)
        clips = clip_names(document)
        if clips:
            raise InputError(
                f"{path} holds {len(clips)} animation{'s' * (len(clips) > 1)}, so it is a sequence of its own and no frame "
                f"of one; give it alone, as a file"
            )
        scene = read_scene(document, is_still=True, moving_alone=not self._is_first)
        self._is_first = False
        stored = scene.poses.as_stored()
        attributes = cache(lambda: scene_attributes(scene))
        names = attribute_names(scene)
        return Mesh(
            scene.poses.at(np.zeros(1))[0] if stored is None else stored,
            scene.faces,
            {name: attributes()[name] for name in names if _is_static(name)},
            scene.notes,
            None,
            scene.parts,
            scene.materials,
            scene.images,
            scene.metadata,
            {name: partial(_values, attributes, name) for name in names if not _is_static(name)},
            scene.not_carried,
        )


def _is_static(name: str) -> bool:
    """Whether an attribute is the same in all frames of a series."""
    return name.startswith(("uv", "tangent"))


def _values(attributes: Callable[[], dict[str, Array]], name: str) -> FrameValues:
    values = attributes()[name]
    return FrameValues(values, "vertex", guess_kind(name, values))


class ClipFrames:
    """Positions ``(F, V, 3)`` of a clip, evaluated as they are sliced.

    Args:
        poses: the scene.
        clip: what moves it.
        times: ``(F,)`` of the frames, seconds (`times_of`).
        dtype: float32, or float64 if positions need an origin.
        changes_at: number of the frame before which these ended, where other meshes are shown; None: there is none.
    """

    def __init__(self, poses: Poses, times: Float64, dtype: type[np.floating], changes_at: int | None = None) -> None:
        self._poses, self._times, self.changes_at = poses, times, changes_at
        self.dtype = np.dtype(dtype)
        self.shape: tuple[int, ...] = (len(times), poses.n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Floats:
        with np.errstate(over="ignore"):  # refused later
            return self._poses.at(self._times[key]).astype(self.dtype, copy=False)


def times_of(clip: Clip, fps: float) -> Float64:
    """Seconds ``(F,)`` of the frames of a clip.

    A frame within `NEAR_KEY` frames of a key shows that key: times of keys are float32, those of frames are not.
    """
    every = clip.keys
    times = np.minimum(clip.start + np.arange(frame_count(clip, fps)) / fps, clip.stop)
    after = np.clip(np.searchsorted(every, times), 1, max(1, len(every) - 1))
    for index in (after - 1, np.minimum(after, len(every) - 1)):
        keys = every[index]
        times = np.where(np.abs(keys - times) * fps < NEAR_KEY, keys, times)
    return np.asarray(times)


def frame_count(clip: Clip, fps: float) -> int:
    """Frames from the first key to the last; the last frame shows the last key."""
    return rounded_up((clip.stop - clip.start) * fps) + 1


def read_animated(path: Path, options: ReadOptions = NO_OPTIONS) -> MeshSequence | None:
    """Read an animated file as a sequence; None if nothing in it is animated and no clip is asked for.

    Args:
        path: of the file.
        options: frames per second, by default the rate of its densest keys, at least 24; the clip, by default the first.

    Raises:
        InputError: it cannot be read, or has no such clip.
    """
    with reading(path, path.suffix[1:].upper()):
        document = options.keep("document", lambda: load_document(path))
        names = options.keep("names", lambda: clip_names(document))
        if not names and options.clip is None:
            return None
        opened = options.keep("scene", lambda: open_scene(document, options.clip))
        return _sequence(path, opened, options, names)


def read_clips(path: Path) -> list[tuple[str, float, float]]:
    """Name, first and last second of each of the file's animations that move anything; raises `InputError`."""
    with reading(path, path.suffix[1:].upper()):
        accessors = Accessors(load_document(path))
        return [(name, *clip_times(accessors, name)) for name in clip_names(accessors.document)]


def read_poses(path: Path, clip: str | None = None) -> Poses:
    """The scene of a file, to be posed at any times: of its first clip, or at rest for ``clip=""``; raises `ValueError`."""
    document = load_document(path)
    return read_scene(document, clip or None, is_still=clip == "" or not clip_names(document)).poses


def _sequence(path: Path, opened: OpenScene, options: ReadOptions, names: list[str]) -> MeshSequence:
    rate, note = (options.fps, ()) if options.fps is not None else _choose_rate(opened.clip)
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: fps is {rate}; a number above 0 is needed")
    n_frames = frame_count(opened.clip, rate)
    if n_frames > MAX_FRAMES:
        raise InputError(f"{path} would have {n_frames} frames at {rate:g} per second; at most {MAX_FRAMES}, so lower fps")
    scene, times, changes_at = _chosen(path, opened, options, rate)
    first: Float64 = scene.poses.at(times[:1])
    with np.errstate(over="ignore"):
        small: Float32 = first.astype(np.float32)
    needs_origin = bool(np.isfinite(small).all() and choose_origin(first).any())
    frames = ClipFrames(scene.poses, times, np.float64 if needs_origin else np.float32, changes_at)
    others = [name for name in names if name != scene.clip.name]
    if others:
        listed = ", ".join(others[:8]) + (f" and {len(others) - 8} more" if len(others) > 8 else "")
        note = (*note, f"clip {scene.clip.name!r} was read; others of the file: {listed} (clip, --clip)")
    return MeshSequence(
        frames,
        scene.faces,
        rate,
        scene_attributes(scene),
        str(path),
        notes=(*note, *scene.notes),
        parts=scene.parts,
        materials=scene.materials,
        images=scene.images,
        metadata=scene.metadata,
        not_carried=scene.not_carried,
    )


def _chosen(path: Path, opened: OpenScene, options: ReadOptions, rate: float) -> tuple[Scene, Float64, int | None]:
    """The scene, the times of its frames, and the frame before which those end, where other meshes take their turn."""
    times = options.keep("times", lambda: times_of(opened.clip, rate))
    first, stop = options.span(len(times), str(path))
    nodes = [each.node for each in opened.shown]
    turns = options.keep("turns", lambda: find_turns(opened.nodes, opened.clip, nodes, times))
    if turns is None:
        return options.keep("whole", opened.all), times if options.memory is None else times[first:stop], None
    end = turns.run(first, stop)
    own = [number for number, group in enumerate(turns.groups) if group == turns.shown[first]]
    if options.memory is None:  # a caller takes the frames that are asked for
        if end < stop:
            raise TopologyChange.at(f"{path}: its meshes take turns, and at frame {end} others are shown", end, first)
        return opened.some(own, float(times[first])), times, None
    return opened.some(own, float(times[first])), times[first:end], end if end < stop else None


def _choose_rate(clip: Clip) -> tuple[float, tuple[str, ...]]:
    """Frames per second for a clip, and a note that says why."""
    if clip.fps:
        return clip.fps, ()
    found = key_rate(clip, JUMP)
    if found < LOW_RATE * (1 - NEAR):
        far = f"its keys are {1 / found:.3g} s apart" if found else "it has single keys"
        return DEFAULT_FPS, (f"{far}; it was sampled at {DEFAULT_FPS:g} frames per second (fps, --fps)",)
    whole = round(found)
    rate = float(whole) if abs(found - whole) <= NEAR * found else found
    return rate, (f"it was sampled at the rate of its keys, {rate:g} frames per second (fps, --fps)",)
