"""What a parser may give: finite numbers of the shape that was promised, indices in range, and text in one line."""

from __future__ import annotations

import unicodedata

import numpy as np

from fuzz.parts import BrokenPromise
from gvpipe.foundation.arrays import Array
from gvpipe.grids.volume import Volume
from gvpipe.model.sequence import MeshSequence

LONGEST_MESSAGE = 1000  # characters
UNSHOWN = ("Cc", "Cs", "Zl", "Zp")  # Unicode's categories of what no terminal should be sent
FRAMES = 3  # of each field that are read


def check_positions(positions: Array, shape: tuple[int, ...]) -> None:
    """Raise `BrokenPromise` unless positions are finite, float32 and of a shape."""
    if positions.shape != shape or positions.dtype != np.float32:
        raise BrokenPromise(f"positions are {positions.shape} {positions.dtype}, not {shape} float32")
    if not np.isfinite(positions).all():
        raise BrokenPromise("positions are not finite")


def check_faces(faces: Array, n_vertices: int) -> None:
    """Raise `BrokenPromise` unless triangles are int32, and their vertices are there."""
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype != np.int32:
        raise BrokenPromise(f"triangles are {faces.shape} {faces.dtype}")
    if faces.size and (faces.min() < 0 or faces.max() >= n_vertices):
        raise BrokenPromise(f"triangles refer to vertices {faces.min()}..{faces.max()} of {n_vertices}")


def check_asset(sequence: MeshSequence, infinite: bool = False) -> None:
    """Read what lies beside positions.

    Args:
        sequence: that has it.
        infinite: whether fields may be infinite, as in files of simulations; encoders refuse them later.

    Raises:
        BrokenPromise: numbers are not finite, but for the holes of fields (NaN).
    """
    for name, attribute in sequence.attributes.items():
        values = np.asarray(attribute)
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise BrokenPromise(f"attribute {name!r} is not finite")
    for name, field in sequence.fields.items():
        for start in {0, max(0, len(sequence) - FRAMES)}:
            frames = np.asarray(field[start : start + FRAMES])
            if not infinite and frames.dtype.kind == "f" and np.isinf(frames).any():
                raise BrokenPromise(f"field {name!r} is infinite")
    if sequence.volume is not None:
        _check_volume(sequence.volume, len(sequence), sequence.n_vertices)
    if sequence.polygons is not None and int(np.sum(np.asarray(sequence.polygons) - 2)) != len(sequence.faces):
        raise BrokenPromise("polygons and triangles do not fit")
    for part in sequence.parts:
        if not 0 <= part.triangles[0] <= part.triangles[1] <= len(sequence.faces):
            raise BrokenPromise(f"part {part.name!r} has triangles {part.triangles} of {len(sequence.faces)}")
    for note in sequence.notes:
        check_text(note)
    _ = sequence.materials, [image.data for image in sequence.images], sequence.metadata


def _check_volume(volume: Volume, n_frames: int, n_vertices: int) -> None:
    nodes = volume.cells.nodes
    if len(nodes) and not 0 <= nodes.min() <= nodes.max() < n_vertices + volume.n_points:
        raise BrokenPromise(f"cells refer to points {nodes.min()}..{nodes.max()} of {n_vertices + volume.n_points}")
    points = np.asarray(volume.points[max(0, n_frames - FRAMES) : n_frames])
    if not np.isfinite(points).all():
        raise BrokenPromise("points inside are not finite")
    for name, field in (*volume.point_fields.items(), *volume.cell_fields.items()):
        frames = np.asarray(field[0:FRAMES])
        if frames.dtype.kind == "f" and np.isinf(frames).any():
            raise BrokenPromise(f"field {name!r} inside is infinite")


def check_text(text: str) -> None:
    """Raise `BrokenPromise` unless a message is one line of moderate length that a terminal shows as it is."""
    if not text or len(text) > LONGEST_MESSAGE:
        raise BrokenPromise(f"a message of {len(text)} characters: {text[:100]!r}")
    if any(unicodedata.category(character) in UNSHOWN for character in text):
        raise BrokenPromise(f"a message with control characters: {text[:200]!r}")
