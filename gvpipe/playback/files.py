"""Mesh sequences from files and to files: ``gvpipe.read`` and ``gvpipe.write``.

Nothing heavy is imported here, so that the process of a library starts first, and what a file does not need never loads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

from gvpipe.container.sources import VIDEO_SUFFIXES, is_remote
from gvpipe.foundation.arguments import StrPath, check_path, show
from gvpipe.foundation.errors import InputError, SeveralShots, TopologyChange

if TYPE_CHECKING:
    from gvpipe.io.options import RunMemory
    from gvpipe.io.runs import Run
    from gvpipe.model.capture import Capture
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin
    from gvpipe.playback.player import Player

Source = StrPath | Sequence[StrPath]


def read(
    path: Source,
    fps: float | None = None,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    *,
    unlimited: bool = False,
    real_time: bool = False,
    warp: str | None = None,
    volume: bool | None = False,
    texture: StrPath | None = None,
) -> MeshSequence:
    """Read a mesh sequence, or a geometry video as one.

    Args:
        path: an ``.npz``, an ``.mp4``, a scene (animated glTF, USD, Alembic), a point cache (``.pc2``, ``.mdd``, ``.npy``), or
            frame files as a folder, a glob, a ``%04d`` pattern, a list or one file.
        fps: frames per second; overrides the file's. Frame files have 30 by default, glTF files the rate of their keys.
        clip: name of the animation to read, of a glTF or FBX file that has several; None: the first.
        mesh: a file with the triangles of a point cache.
        frames: first frame that is read, and the one after the last (None: all that follow).
        unlimited: as for `open`, of a geometry video; of a USD file, whether it may take any memory.
        real_time: whether steps of a simulation keep their clock; else those that are shorter than 1/240 s or longer than 2 s
            become a film of 25 frames a second. The times are kept either way.
        warp: a field of displacements that moves the vertices, ``"NAME"`` or ``"NAME:SCALE"``.
        volume: whether what lies inside of a simulation's surface is read, too: volume cells, inner points, and their numbers.
            None: where there is something.
        texture: a picture for each frame, in place of the texture of the base colour: a folder, a glob or a pattern of
            pictures, or a video.

    Raises:
        InputError, FormatError: the path or what it holds cannot be used.
        SettingError: ``warp`` is of another form.
        TypeError: it is no path.
    """
    sequence = _read(path, fps, clip, mesh, frames, unlimited, real_time, bool(volume))
    if volume is None and has_inside(sequence):
        sequence = _read(path, fps, clip, mesh, frames, unlimited, real_time, True)
    if texture is not None:
        sequence = add_texture(sequence, texture, frames)
    if warp is None:
        return sequence
    from gvpipe.model.warp import warped

    return warped(sequence, warp)


def add_texture(sequence: MeshSequence, texture: StrPath, frames: tuple[int, int | None] | None = None) -> MeshSequence:
    """Return a sequence with the pictures of a folder, a pattern or a video as its base colour, one for each frame.

    Args:
        sequence: with texture coordinates.
        texture: names the pictures.
        frames: those of a longer film that the sequence has.

    Raises:
        InputError: the pictures cannot be used, or there are no texture coordinates.
    """
    from gvpipe.io.picture_rows import open_pictures
    from gvpipe.model.moving_texture import with_pictures

    pictures = open_pictures(check_path(texture, "the texture"), len(sequence), frames)
    return with_pictures(sequence, pictures, _texture_name(texture))


def add_texture_to_shots(capture: Capture, texture: StrPath, frames: tuple[int, int | None] | None = None) -> Capture:
    """Return a capture whose shots have the pictures of their frames; the rest is as of `add_texture`."""
    from gvpipe.asset.moving import SomePictures
    from gvpipe.io.picture_rows import open_pictures
    from gvpipe.model.capture import Capture
    from gvpipe.model.moving_texture import with_pictures

    pictures = open_pictures(check_path(texture, "the texture"), len(capture), frames)
    name, starts = _texture_name(texture), capture.starts
    shots = [
        with_pictures(shot, SomePictures(pictures, start, start + len(shot)), name)
        for shot, start in zip(capture.shots, starts, strict=True)
    ]
    return Capture(shots, capture.name, sound=capture.sound)


def _texture_name(texture: StrPath) -> str:
    """What an image is called: the name of its files without numbers."""
    return Path(os.fspath(texture)).stem.rstrip("_-. %0d#*") or "texture"


def has_inside(sequence: MeshSequence) -> bool:
    """Whether its source has volume cells, which were not read."""
    from gvpipe.io.left_behind import VOLUME_CELLS, count_of

    return count_of(sequence.not_carried, VOLUME_CELLS) > 0


def _read(
    path: Source,
    fps: float | None,
    clip: str | None,
    mesh: StrPath | None,
    frames: tuple[int, int | None] | None,
    unlimited: bool,
    real_time: bool,
    volume: bool,
    memory: RunMemory | None = None,
) -> MeshSequence:
    from gvpipe.io.reading import read as read_sequence

    if isinstance(path, list | tuple):
        for file in path:
            check_path(file, "a file of gvpipe.read's list")
        if len(path) != 1:
            return read_sequence(path, fps, clip, mesh, frames, unlimited, real_time, volume, memory)
        path = path[0]
    one = check_path(path, "what gvpipe.read is given", "a list of frame files or ")
    if not is_video(one):
        return read_sequence(one, fps, clip, mesh, frames, unlimited, real_time, volume, memory)
    if clip is not None:
        raise InputError(f"{one} has no clips; clip={clip!r} is for a single .glb or .gltf")
    if mesh is not None:
        raise InputError(f"{one} has triangles of its own; mesh={os.fspath(mesh)!r} is for point caches")
    sequence = read_video(one, frames, unlimited=unlimited)
    return sequence if fps is None else sequence.with_fps(fps)


def read_video(path: StrPath, frames: tuple[int, int | None] | None = None, *, unlimited: bool = False) -> MeshSequence:
    """A geometry video, or some frames of it, as a sequence that decodes what is read.

    Raises:
        TopologyChange: it is a capture, and the frames lie in several of its shots.
        InputError, FormatError: as `read`.
    """
    from gvpipe.playback.player import Player

    try:
        sequence = Player(path, unlimited=unlimited).sequence()
    except SeveralShots:
        capture = read_capture(path, frames=frames, unlimited=unlimited)
        if len(capture.shots) == 1:
            return capture.shots[0]
        start = 0 if frames is None else frames[0]
        what = f"{path}: vertices or triangles change at frame {start + capture.starts[1]}"
        raise TopologyChange.at(what, start + capture.starts[1], start) from None
    return sequence if frames is None else sequence.part(*frame_range(sequence, *frames))


def read_capture(
    path: Source,
    fps: float | None = None,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    *,
    unlimited: bool = False,
    real_time: bool = False,
    warp: str | None = None,
    volume: bool = False,
) -> Capture:
    """Read an input whose vertices or triangles may change: a row of shots, each with a connectivity of its own.

    The arguments are those of `read`. An input that keeps its connectivity is a capture of one shot.

    Raises:
        InputError, FormatError: the path or what it holds cannot be used.
    """
    from gvpipe.io.runs import at_one_rate
    from gvpipe.model.capture import Capture, some_frames

    if is_video(path) and clip is None and mesh is None and warp is None:
        from gvpipe.playback.capture_player import CapturePlayer

        return some_frames(CapturePlayer(path, unlimited=unlimited).capture(), frames, fps)
    how: dict[str, Any] = {"unlimited": unlimited, "real_time": real_time, "warp": warp, "volume": volume}
    runs = read_runs(path, fps, clip, mesh, frames, **how)
    name = path if isinstance(path, str | os.PathLike) else path[0]
    return Capture(at_one_rate(runs), os.fspath(name))


def is_video(path: Source) -> TypeGuard[StrPath]:
    """Whether an input is one geometry video, by its name."""
    return isinstance(path, str | os.PathLike) and (Path(path).suffix.lower() in VIDEO_SUFFIXES or is_remote(path))


def read_runs(
    path: Source,
    fps: float | None = None,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    *,
    unlimited: bool = False,
    real_time: bool = False,
    warp: str | None = None,
    volume: bool | None = False,
) -> list[Run]:
    """Read an input whose vertices or triangles may change, as one sequence for each run of frames where they do not.

    The arguments are those of `read`. A run has ``start``, ``stop`` and ``sequence``.

    Raises:
        InputError, FormatError: the path or what it holds cannot be used.
    """
    from gvpipe.io.options import RunMemory
    from gvpipe.io.runs import Run, find_runs

    if is_video(path) and clip is None and mesh is None and warp is None:
        capture = read_capture(path, fps, frames=frames, unlimited=unlimited)
        begin = 0 if frames is None else frames[0]
        spans = zip(capture.starts, capture.lengths, capture.shots, strict=True)
        return [Run(begin + start, begin + start + length, shot) for start, length, shot in spans]
    memory = RunMemory()

    def run(span: tuple[int, int | None] | None) -> MeshSequence:
        sequence = _read(path, fps, clip, mesh, span, unlimited, real_time, bool(volume), memory)
        if volume is None and has_inside(sequence):
            sequence = _read(path, fps, clip, mesh, span, unlimited, real_time, True, memory)
        return sequence

    runs = find_runs(run, frames)
    if warp is None:
        return runs
    from gvpipe.model.warp import warped

    return [replace(run, sequence=warped(run.sequence, warp)) for run in runs]


def write(sequence: MeshSequence, path: StrPath, start: int = 0, skin: Skin | None = None, compress: str = "none") -> list[str]:
    """Write a mesh sequence as ``.npz``, or as frame files named by a pattern (``out/%04d.obj``), numbered from ``start``.

    With a ``skin`` of it (`gvpipe.skin`, `Player.skin`), a ``.glb`` has its skeleton in place of morph targets. Frames are
    then as the skeleton moves them. With ``compress="meshopt"`` a ``.glb`` is compressed (EXT_meshopt_compression): positions
    that a skeleton moves have 16 bits where that will do, normals 8, keys what their error allows; vertices and triangles come
    in another order. ``"draco"`` compresses meshes alone (KHR_draco_mesh_compression), which morph targets and keys are not.

    Returns notes: what the format cannot hold, a line each.

    Raises:
        InputError: the path names no format that can be written, or none that has a skeleton or a compression.
        OutputError: a file cannot be written; nothing half-written is left.
        SettingError: a compression that is not known.
        TypeError: the first argument is no sequence, the second no path, or the skin none.
    """
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin

    if not isinstance(sequence, MeshSequence):
        raise TypeError(f"gvpipe.write's sequence is {show(sequence)}; a MeshSequence is needed")
    check_path(path, "gvpipe.write's path")
    if skin is not None and not isinstance(skin, Skin):
        raise TypeError(f"gvpipe.write's skin is {show(skin)}; a Skin is needed, as of gvpipe.skin")
    from gvpipe.io.writing import write as write_sequence

    return list(write_sequence(sequence, path, start, skin, compress))


def frame_range(video: Player | MeshSequence, start: int, stop: int | None) -> tuple[int, int]:
    """Return the range with its end filled in; raises `InputError` unless it holds frames of the video, and only those."""
    stop = len(video) if stop is None else stop
    if not 0 <= start < stop <= len(video):
        from gvpipe.playback.player import Player

        name = video.path if isinstance(video, Player) else video.name
        raise InputError(f"{name}: frames {start}:{stop} asked for; 0 <= start < stop <= {len(video)} is needed")
    return start, stop
