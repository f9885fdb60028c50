"""``gvpipe.write``: a sequence or a capture to mesh files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.errors import InputError
from gvpipe.playback import files

if TYPE_CHECKING:
    from gvpipe.model.capture import Capture
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin


def write(
    sequence: MeshSequence | Capture, path: StrPath, start: int = 0, skin: Skin | None = None, compress: str = "none"
) -> list[str]:
    """Write a mesh sequence as ``.npz``, or as frame files named by a pattern (``out/%04d.obj``), numbered from ``start``.

    With a ``skin`` of it (`gvpipe.skin`, `Player.skin`), a ``.glb`` has its skeleton in place of morph targets. Frames are
    then as the skeleton moves them. With ``compress="meshopt"`` a ``.glb`` is compressed (EXT_meshopt_compression): positions
    that a skeleton moves have 16 bits where that will do, normals 8, keys what their error allows; vertices and triangles come
    in another order. ``"draco"`` compresses meshes alone (KHR_draco_mesh_compression), which morph targets and keys are not.

    A `Capture` becomes one file where the format can hold changing triangles (USD, Alembic, glTF, VTKHDF, a .pvd), numbered
    frames where the path is a pattern, and else a file for each shot: ``NAME-000.npz``.

    Returns notes: what the format cannot hold, a line each.

    Raises:
        InputError: the path names no format that can be written, or none that has a skeleton or a compression; or there is a
            skin, and the first argument is a capture of several shots.
        OutputError: a file cannot be written; nothing half-written is left.
        SettingError: a compression that is not known.
        TypeError: the first argument is no sequence, the second no path, or the skin none.
    """
    from gvpipe.model.capture import Capture

    if not isinstance(sequence, Capture):
        return files.write(sequence, path, start, skin, compress)
    check_path(path, "gvpipe.write's path")
    if len(sequence.shots) == 1:
        return files.write(sequence.shots[0], path, start, skin, compress)
    if skin is not None:
        count = len(sequence.shots)
        raise InputError(f"{path}: a skin moves one mesh, and {sequence.name} has {count} shots; write one of them")
    from gvpipe.captures.writing import write_capture_files

    return write_capture_files(sequence, path, start, compress)[1]
