"""What a user chooses of a sequence before it is written: frames, parts, a frame rate. Reading it shows how far it is."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from gvpipe.model.part_choice import parts_alone

if TYPE_CHECKING:
    from gvpipe.foundation.progress import Progress
    from gvpipe.model.sequence import MeshSequence


def parse_frames(text: str | None) -> tuple[int, int | None] | None:
    """``10:50`` as ``(10, 50)``; raises `click.UsageError`."""
    if text is None:
        return None
    first, colon, last = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return int(first or 0), int(last) if last else None
    except ValueError as exc:
        raise click.UsageError(f"--frames {text}: A:B is needed, such as --frames 10:50") from exc


def parse_texture(pictures: str | None, video: str | None) -> str | None:
    """What ``--texture`` or ``--texture-video`` names; raises `click.UsageError`."""
    from gvpipe.io.picture_rows import VIDEOS

    if pictures is not None and video is not None:
        raise click.UsageError("give --texture or --texture-video, not both")
    if video is not None and not video.lower().endswith(VIDEOS):
        raise click.UsageError(f"--texture-video {video}: a video is needed ({', '.join(VIDEOS)}); pictures go with --texture")
    return video if pictures is None else pictures


def parse_bytes(option: str, text: str) -> int:
    """``500MB`` as 500,000,000: a number of bytes, kB, MB, GB or TB; raises `click.UsageError`."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?(|k|M|G|T)B?", text, re.ASCII | re.IGNORECASE)
    count = int(float(found[1]) * 1000 ** " kmgt".index(found[2].lower() or " ")) if found else 0
    if count < 1:
        raise click.UsageError(f"{option} {text}: a number of bytes is needed, such as {option} 500MB")
    return count


def chosen_frames(start: int | None, stop: int | None, frames: str | None) -> tuple[int, int | None]:
    """First frame and the one after the last, of --start and --stop or of --frames; raises `click.UsageError`."""
    if frames is not None and (start is not None or stop is not None):
        raise click.UsageError("give --frames A:B, or --start and --stop, not both")
    return parse_frames(frames) or (start or 0, stop)


def chosen(
    sequence: MeshSequence, parts: Sequence[str], fps: float | None, stage: str, progress: Progress | None
) -> MeshSequence:
    """Return the parts of some names, or all for none, at another frame rate if one is given.

    Args:
        stage: name of what is shown while frames are read.
        progress: called with it and the part of the frames that is read.

    Raises:
        InputError: no such part, or no such frame rate.
    """
    if parts:
        sequence = parts_alone(sequence, parts)
    if fps is not None:
        sequence = sequence.with_fps(fps)
    if progress is None:
        return sequence
    furthest = 0

    def told(stop: int) -> None:
        nonlocal furthest  # archives are sampled before they are written, which is no step back
        furthest = max(furthest, stop)
        progress(stage, furthest / sequence.n_frames)

    return sequence.watched(told)
