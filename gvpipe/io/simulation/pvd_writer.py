"""A sequence as ParaView's .pvd, which lists a .vtp file per frame with its time, in a folder of its own beside it."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from gvpipe.asset.metadata import TIMES
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import OutputError
from gvpipe.io.frames.writer import write_frames
from gvpipe.model.sequence import MeshSequence


def write_pvd(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write ``walk.pvd`` and ``walk/walk_0000.vtp``...: all of them, or none.

    Returns what the format cannot hold, a line each.

    Raises:
        OutputError: a file or the folder cannot be written.
    """
    digits = max(4, len(str(sequence.n_frames - 1)))
    name = path.stem.replace("%", "_").replace("#", "_").replace("$", "_")  # no second pattern in the name
    listed = "".join(
        f'<DataSet timestep="{time:.17g}" part="0" file={quoteattr(f"{name}/{name}_{frame:0{digits}d}.vtp")}/>\n'
        for frame, time in enumerate(frame_times(sequence))
    )
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian"><Collection>\n'
    with atomic_files(path.parent) as folder:
        try:
            notes = write_frames(sequence, str(folder / name / f"{name}_%0{digits}d.vtp"))
        except OutputError as exc:
            raise OutputError(str(exc).replace(str(folder), str(path.parent)).partition("; frames ")[0]) from exc
        (folder / path.name).write_text(f"{head}{listed}</Collection></VTKFile>\n", "utf-8")
    return notes


def frame_times(sequence: MeshSequence) -> Float64:
    """``(F,)`` seconds of the frames: those that the metadata's text has where the steps were uneven, else by the rate."""
    even = sequence.metadata.start_time + np.arange(sequence.n_frames) / sequence.fps
    try:
        kept = np.array(sequence.metadata.texts.get(TIMES, "").split(), np.float64)
    except ValueError:
        return np.asarray(even)
    return kept if len(kept) == sequence.n_frames and np.isfinite(kept).all() else np.asarray(even)
