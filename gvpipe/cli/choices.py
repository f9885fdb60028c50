"""What a user chooses of a sequence before it is written: parts, a frame rate. Reading it shows how far it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gvpipe.part_choice import parts_alone

if TYPE_CHECKING:
    from gvpipe.codec import Progress
    from gvpipe.sequence import MeshSequence


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
    return sequence.watched(lambda stop: progress(stage, stop / sequence.n_frames))
