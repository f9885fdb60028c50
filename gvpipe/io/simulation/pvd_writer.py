"""A sequence as ParaView's .pvd, which lists a file per frame with its time, in a folder of its own beside it.

Files are .vtp, or .vtu of a sequence with a volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import OutputError
from gvpipe.io.frames.writer import write_frames
from gvpipe.io.simulation.vtu_writer import write_grids
from gvpipe.model.sequence import MeshSequence

HEAD = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian"><Collection>\n'
TAIL = "</Collection></VTKFile>\n"


def write_pvd(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write ``walk.pvd`` and ``walk/walk_0000.vtp``..., or ``.vtu``: all of them, or none.

    Returns what the format cannot hold, a line each.

    Raises:
        OutputError: a file or the folder cannot be written.
    """
    digits = max(4, len(str(sequence.n_frames - 1)))
    name = path.stem.replace("%", "_").replace("#", "_").replace("$", "_")  # no second pattern in the name
    suffix = ".vtp" if sequence.volume is None else ".vtu"
    listed = "".join(
        f'<DataSet timestep="{time:.17g}" part="0" file={quoteattr(f"{name}/{name}_{frame:0{digits}d}{suffix}")}/>\n'
        for frame, time in enumerate(sequence.times)
    )
    with atomic_files(path.parent) as folder:
        try:
            if sequence.volume is None:
                notes = write_frames(sequence, str(folder / name / f"{name}_%0{digits}d.vtp"))
            else:
                notes = write_grids(sequence, lambda frame: folder / name / f"{name}_{frame:0{digits}d}.vtu")
        except OutputError as exc:
            raise OutputError(str(exc).replace(str(folder), str(path.parent)).partition("; frames ")[0]) from exc
        (folder / path.name).write_text(f"{HEAD}{listed}{TAIL}", "utf-8")
    return notes


def join_lists(lists: Sequence[Path], path: Path) -> None:
    """Write one .pvd that lists the files of several, which `write_pvd` wrote into its folder, in their order."""
    listed = (each.read_text("utf-8").removeprefix(HEAD).removesuffix(TAIL) for each in lists)
    path.write_text(f"{HEAD}{''.join(listed)}{TAIL}", "utf-8")
