"""What later frames of a series have that the first has not: materials and texture coordinates are those of the first.

A few files are read as if each were the first, and compared. Material files of OBJ are compared in all frames, since scanners
write one for each (`gvpipe.io.obj.changes`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gvpipe.foundation.errors import InputError
from gvpipe.io.fetching import is_elsewhere
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.frame_files import load_mesh
from gvpipe.io.left_behind import met_later
from gvpipe.io.mesh import Mesh

if TYPE_CHECKING:
    from gvpipe.io.obj.moving import Moving

HAVE_LOOKS = (".obj", ".ply", ".gltf", ".glb")
SAMPLES = 3  # files that are compared with the first
CHANGES = "materials and textures of later frames"


def moving_looks(first: Mesh, files: Sequence[Path], start: int) -> Moving | None:
    """Images that each frame has a picture of its own for (`gvpipe.io.obj.moving`); None where there are none.

    Raises:
        InputError: a picture has another size than the first.
    """
    if files[0].suffix.lower() != ".obj" or not first.images or any(map(is_elsewhere, files)):
        return None
    from gvpipe.io.obj.moving import moving_images

    return moving_images(files, first.materials, first.images, start)


def changing_looks(first: Mesh, files: Sequence[Path], is_moving: bool = False) -> tuple[str, ...]:
    """What is not carried of later frames, by name; files that cannot be read are passed over, since their readers say so.

    Args:
        first: the first file.
        files: all, in frame order.
        is_moving: whether materials and pictures of later frames are known, and carried.
    """
    suffix = files[0].suffix.lower()
    if suffix not in HAVE_LOOKS or len(files) < 2:
        return ()
    found = dict.fromkeys(_changing_files(files)) if suffix == ".obj" and not is_moving else {}
    for number in np.unique(np.linspace(1, len(files) - 1, SAMPLES).astype(int)).tolist():
        if is_elsewhere(files[number]):
            continue
        with contextlib.suppress(InputError):
            found |= dict.fromkeys(_compared(first, load_mesh(FRAME_FORMATS[suffix].loader(), files[number], number)))
    if is_moving:
        found.pop(CHANGES, None)
    return tuple(found)


def _changing_files(files: Sequence[Path]) -> tuple[str, ...]:
    from gvpipe.io.obj.changes import have_changing_materials

    return (CHANGES,) if have_changing_materials(files) else ()


def _compared(first: Mesh, later: Mesh) -> list[str]:
    """What differs, by name; numbers that become fields aside."""
    names = sorted({*first.attributes, *later.attributes} - {*first.animated, *later.animated})
    differing = [name for name in names if _as_bytes(first.attributes.get(name)) != _as_bytes(later.attributes.get(name))]
    found = [f"{name} of later frames" for name in differing]
    if _looks(first) != _looks(later):
        found.append(CHANGES)
    return [*found, *met_later(first.not_carried, later.not_carried)]


def _looks(mesh: Mesh) -> tuple[Any, ...]:
    """Materials, pictures, and which triangles show which."""
    pictures = tuple(image.data for image in mesh.images)
    return mesh.materials, pictures, tuple((part.triangles, part.material) for part in mesh.parts)


def _as_bytes(values: Any) -> tuple[bytes, ...]:
    """An attribute, or its plain numbers, to be compared."""
    arrays = (getattr(values, "values", values), getattr(values, "indices", None))
    return tuple(b"" if each is None else np.ascontiguousarray(each).tobytes() for each in arrays)
