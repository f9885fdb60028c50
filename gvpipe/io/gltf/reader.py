"""glTF files as frames and as sequences: a still file is a frame, an animated one a sequence.

Frames of a clip are evaluated when they are read, so a long clip needs no more memory than a short one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from gvpipe.asset.attribute import guess_kind
from gvpipe.foundation.arrays import Array, Float32, Float64, Floats, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import DEFAULT_FPS
from gvpipe.io.damage import reading
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.clips import Clip, clip_names, clip_times, key_rate
from gvpipe.io.gltf.document import load_document
from gvpipe.io.gltf.json_fields import rounded_up
from gvpipe.io.gltf.poses import Poses
from gvpipe.io.gltf.scene import Scene, read_scene
from gvpipe.io.gltf.scene_attributes import attribute_names, scene_attributes
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

    A frame within `NEAR_KEY` frames of a key shows that key: times of keys are float32, those of frames are not.

    Args:
        poses: the scene.
        clip: what moves it.
        fps: frames per second.
        dtype: float32, or float64 if positions need an origin.
    """

    def __init__(self, poses: Poses, clip: Clip, fps: float, dtype: type[np.floating]) -> None:
        self._poses, self._clip, self._fps, self._keys = poses, clip, fps, clip.keys
        self.dtype = np.dtype(dtype)
        self.shape: tuple[int, ...] = (frame_count(clip, fps), poses.n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Floats:
        frames = np.arange(*key.indices(self.shape[0]))
        with np.errstate(over="ignore"):  # refused later
            return self._poses.at(self._times(frames)).astype(self.dtype, copy=False)

    def _times(self, frames: Int64) -> Float64:
        times = np.minimum(self._clip.start + frames / self._fps, self._clip.stop)
        after = np.clip(np.searchsorted(self._keys, times), 1, max(1, len(self._keys) - 1))
        for index in (after - 1, np.minimum(after, len(self._keys) - 1)):
            keys = self._keys[index]
            times = np.where(np.abs(keys - times) * self._fps < NEAR_KEY, keys, times)
        return times


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
        document = load_document(path)
        names = clip_names(document)
        if not names and options.clip is None:
            return None
        return _sequence(path, read_scene(document, options.clip), options.fps, names)


def read_clips(path: Path) -> list[tuple[str, float, float]]:
    """Name, first and last second of each of the file's animations that move anything; raises `InputError`."""
    with reading(path, path.suffix[1:].upper()):
        accessors = Accessors(load_document(path))
        return [(name, *clip_times(accessors, name)) for name in clip_names(accessors.document)]


def read_poses(path: Path, clip: str | None = None) -> Poses:
    """The scene of a file, to be posed at any times: of its first clip, or at rest for ``clip=""``; raises `ValueError`."""
    document = load_document(path)
    return read_scene(document, clip or None, is_still=clip == "" or not clip_names(document)).poses


def _sequence(path: Path, scene: Scene, fps: float | None, names: list[str]) -> MeshSequence:
    rate, note = (fps, ()) if fps is not None else _choose_rate(scene.clip)
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: fps is {rate}; a number above 0 is needed")
    n_frames = frame_count(scene.clip, rate)
    if n_frames > MAX_FRAMES:
        raise InputError(f"{path} would have {n_frames} frames at {rate:g} per second; at most {MAX_FRAMES}, so lower fps")
    first: Float64 = scene.poses.at(np.array([scene.clip.start]))
    with np.errstate(over="ignore"):
        small: Float32 = first.astype(np.float32)
    needs_origin = bool(np.isfinite(small).all() and choose_origin(first).any())
    frames = ClipFrames(scene.poses, scene.clip, rate, np.float64 if needs_origin else np.float32)
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
