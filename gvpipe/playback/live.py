"""Geometry videos that are written while their frames come, from a capture or a simulation."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from types import TracebackType
from typing import Any

import numpy as np

from gvpipe.coding.codec import Codec, LiveCoder
from gvpipe.coding.registry import codec_class, codec_ids, make_codec
from gvpipe.container.live_writer import LiveWriter
from gvpipe.container.segments import MAX_SEGMENT
from gvpipe.container.sources import check_video_target
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.arrays import Array, Float32, Integers
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.model.origin import narrow
from gvpipe.model.sequence import MeshSequence, check_finite
from gvpipe.rendering.poster import make_poster

FRAMES = "the frames"  # their name in messages
CLIP_SECONDS = 1.0  # of a clip, unless its frames are set: who watches is at most two clips behind


class LiveEncoder:
    """Writes a geometry video whose frames come one by one. A context manager, which finishes the file.

    At any moment the file opens up to its last whole clip, and pages play it while it grows (`docs/cli.md`). Its layout is
    ``live`` until it is finished; then it is an ordinary file in the stream layout. If the process is killed, the clips stay.

    Memory is that of one clip. The frame that completes a clip waits until the clip is coded and on the disk.

    Args:
        path: the ``.mp4`` to write, a new name: it is written in place from the first frame on, so no older file would be safe.
        faces: ``(T, 3)`` triangles.
        fps: frames per second.
        codec: id of one that can code frames as they come: ``"pdct"``.
        settings: of the codec, by name; by default clips last a second.

    Raises:
        SettingError: a setting is out of range, or the codec cannot do this.
        InputError: the path is taken, or the frame rate is no positive number.
    """

    def __init__(self, path: StrPath, faces: Integers, fps: float = 30.0, codec: str = "pdct", **settings: Any) -> None:
        check_video_target(path, "the file to write")
        self.path, self.fps = os.fspath(path), _checked_fps(fps)
        _check_free(self.path)
        self._faces: Any = faces
        self._codec = _live_codec(codec, self.fps, settings)
        self._coder: LiveCoder | None = None
        self._writer: LiveWriter | None = None
        self._frames: list[Float32] = []
        self._first: MeshSequence | None = None
        self._is_closed = False
        self.n_frames = 0  # taken so far

    @property
    def n_written(self) -> int:
        """Frames that are in the file."""
        return 0 if self._writer is None else self._writer.n_frames

    @property
    def clip_frames(self) -> int:
        """Frames of each clip but the last."""
        return int(getattr(self._codec, "clip_frames", 1)) if self._coder is None else self._coder.clip_frames

    def append(self, positions: Array) -> None:
        """Take the next frame, ``(V, 3)``, model units.

        Raises:
            InputError: it has another number of vertices than frame 0, a coordinate is not finite, or the file is full.
            OutputError: the file cannot be written; it opens up to its last whole clip.
        """
        if self._is_closed:
            raise InputError(f"{self.path} is finished; open another for more frames")
        if self._first is None:
            self._begin(np.asarray(positions))
        self._frames.append(self._checked(np.asarray(positions)))
        self.n_frames += 1
        if len(self._frames) == self.clip_frames:
            self._flush()

    def close(self) -> None:
        """Write the last, shorter clip, and finish the file. Without a frame no file is written."""
        if self._is_closed:
            return
        self._is_closed = True
        if self._writer is None:
            return
        try:
            if self._frames:
                self._flush()
        finally:
            try:
                if self._writer.n_clips:
                    self._writer.finish()
            finally:
                self._writer.close()

    def __enter__(self) -> LiveEncoder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _begin(self, positions: Array) -> None:
        """Write the file up to its first clip."""
        if positions.ndim != 2:
            raise InputError(f"frame 0 has shape {positions.shape}; (vertices >= 1, 3) is needed")
        _check_free(self.path)
        first = MeshSequence(positions[None], self._faces, self.fps, name=FRAMES)
        frame = first.read(0, 1)[0]
        coder = self._codec.start_live(frame, first.faces, self.fps)
        x, y, z = first.origin.tolist()
        bitstream = replace(coder.bitstream, origin=(x, y, z))
        self._writer = LiveWriter(
            self.path,
            bitstream,
            coder.name,
            coder.most_clips,
            lambda n_frames: make_poster(frame, first.faces, self.fps, n_frames),
        )
        self._coder, self._first = coder, first

    def _checked(self, positions: Array) -> Float32:
        assert self._first is not None and self._coder is not None
        wanted = (self._first.n_vertices, 3)
        if positions.shape != wanted:
            raise InputError(
                f"frame {self.n_frames} has shape {positions.shape}, frame 0 has {wanted}; the mesh must not change: go on in "
                "another file, or encode all frames as a capture when they are there"
            )
        if self.n_frames >= self._coder.most_clips * self.clip_frames:
            raise InputError(
                f"{self.path} is full: {self._coder.most_clips} clips of {self.clip_frames} frames; go on in another file, or "
                "start with longer clips (segment)"
            )
        if positions.dtype.kind not in "fiu":
            raise InputError(f"frame {self.n_frames} has type {positions.dtype}; numbers are needed")
        frame = narrow(np.array(positions[None]), self._first.origin)  # a copy: loops write each frame into one array
        check_finite(frame, FRAMES, self.n_frames)
        result: Float32 = frame[0]
        return result

    def _flush(self) -> None:
        assert self._coder is not None and self._writer is not None
        frames, self._frames = np.stack(self._frames), []
        self._writer.add(self._coder.encode(frames), len(frames))


def open_live(path: StrPath, faces: Integers, fps: float = 30.0, codec: str = "pdct", **settings: Any) -> LiveEncoder:
    """Start a geometry video whose frames come one by one; see `LiveEncoder`.

    Examples:
        >>> with gvpipe.open_live("capture.mp4", faces, fps=24) as live:  # doctest: +SKIP
        ...     for positions in source:  # (V, 3)
        ...         live.append(positions)
    """
    return LiveEncoder(path, faces, fps, codec, **settings)


def _live_codec(codec: str, fps: float, settings: dict[str, Any]) -> Codec:
    if "clip" not in settings and "segment" not in settings:
        settings = {**settings, "segment": min(max(1, round(CLIP_SECONDS * fps)), MAX_SEGMENT)}
    made = make_codec(codec, settings, ("path", "faces", "fps", "codec"))
    if not made.codes_live:
        others = " or ".join(name for name in codec_ids() if codec_class(name).codes_live)
        raise SettingError(f"codec {codec} needs all frames at once; {others} codes them as they come")
    return made


def _checked_fps(fps: float) -> float:
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0 < fps < math.inf:
        raise InputError(f"fps is {fps!r}; a positive number is needed")
    return float(fps)


def _check_free(path: str) -> None:
    """Refuse a path where something is already: a failed or killed capture would have destroyed it."""
    if os.path.lexists(path):
        raise InputError(f"{path} is there already, and a live file is written in place; give a new name, or remove it")
