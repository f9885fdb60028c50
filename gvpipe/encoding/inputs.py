"""Where the frames to encode come from, and who may code segments of them."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from gvpipe.coding.codec import Codec
from gvpipe.container.sources import is_remote, is_stored
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.cores import count_cores
from gvpipe.foundation.errors import InputError
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.warp import warped
from gvpipe.playback.files import Source, frame_range, read
from gvpipe.runtime.segment_map import segments_mapped_by
from gvpipe.tasks.executor import Executor
from gvpipe.tasks.segments import RemoteSegments, SharedSegments


def open_source(
    source: MeshSequence | Source,
    path: StrPath,
    fps: float | None,
    options: dict[str, Any],
) -> MeshSequence:
    """The sequence to encode, which must not be the file to write; ``options`` are those of `read`."""
    if isinstance(source, MeshSequence):
        frames = options["frames"]
        source = source if frames is None else source.part(*frame_range(source, *frames))
        source = source if options["warp"] is None else warped(source, options["warp"])
        return source if fps is None else source.with_fps(fps)
    if not isinstance(source, list | tuple):
        check_path(source, "gvpipe.encode's source", "a MeshSequence or ")
    if is_among(path, source):
        raise InputError(f"{path} is the input too, which it would replace with a coarser copy; choose another name")
    return read(source, fps, **options)


def open_with_inside(
    source: MeshSequence | Source, path: StrPath, fps: float | None, options: dict[str, Any], volume: bool | None
) -> tuple[MeshSequence, bool, tuple[str, ...]]:
    """The sequence to encode, whether its volume is left out where it costs too much, and a note on what was chosen by now."""
    from gvpipe.asset_coding.volume_choice import MOST_NUMBERS, count_note, times_the_surface, without_volume

    sequence = open_source(source, path, fps, {**options, "volume": bool(volume)})
    if volume is False:
        return without_volume(sequence), False, ()
    times = times_the_surface(sequence)
    if volume or isinstance(source, MeshSequence) or times is None or sequence.volume is not None:
        return sequence, False, ()
    if times > MOST_NUMBERS:
        return sequence, False, (count_note(times),)
    try:
        return read(source, fps, **{**options, "volume": True}), True, ()
    except InputError:  # of what lies inside alone
        return sequence, False, ()


@contextlib.contextmanager
def segments_coded_by(
    executor: Executor | None, sequence: MeshSequence, source: MeshSequence | Source, options: dict[str, Any], is_shared: bool
) -> Iterator[None]:
    """Let an executor code segments of a sequence that was read from ``source`` with the ``options`` of `read`.

    ``is_shared``: not before they prove to be much work.
    """
    if executor is None:
        yield
        return
    reopen = None if isinstance(source, MeshSequence) else partial(read, _absolute(source), **options)
    if reopen and options["mesh"] is not None:
        reopen = partial(reopen, mesh=_absolute(options["mesh"]))
    remote = RemoteSegments(executor, sequence, reopen)
    with segments_mapped_by(SharedSegments(remote) if is_shared else remote):
        yield


def may_share(given: Codec | Sequence[Codec], source: MeshSequence | Capture | Source) -> bool:
    """Whether workers may code segments: of a source that they can read, by a codec whose segments are independent."""
    is_path = not isinstance(source, MeshSequence | Capture)
    return isinstance(given, Codec) and given.maps_segments and is_path and count_cores() > 1


def _absolute(source: Source) -> Source:
    """The same paths for processes whose current folder is another."""
    if isinstance(source, list | tuple):
        return [_absolute_path(one) for one in source]
    return _absolute_path(check_path(source, "the input"))


def _absolute_path(path: StrPath) -> StrPath:
    return path if is_remote(path) or is_stored(path) else os.path.abspath(path)


def is_among(path: StrPath, source: MeshSequence | Capture | Source) -> bool:
    """Whether the output is one of the inputs."""
    if isinstance(source, MeshSequence | Capture) or not os.path.exists(path):
        return False
    sources = [source] if isinstance(source, str | os.PathLike) else source
    return any(os.path.exists(one) and os.path.samefile(one, path) for one in sources)
