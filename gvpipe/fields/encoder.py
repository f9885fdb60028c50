"""A field's section from its frames, segment by segment."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gvpipe.fields.derived import Positions, Span, motion_of
from gvpipe.fields.graph import FieldGraph
from gvpipe.fields.head import Head, longest_segment
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.segment import MODES, Place, cost
from gvpipe.fields.segment_encoder import encode_segment
from gvpipe.fields.values import MAX_COMPONENTS, FieldBound, check_finite, narrow
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import InputError

Read = Callable[[int, int], Array]
Progress = Callable[[float], None]

SHARE = 0.5  # of the budget of a file of the section's size, that a segment may take; the rest is the mesh's


def encode_field(
    read: Read,
    n_frames: int,
    mesh: FieldMesh | FieldGraph,
    bound: FieldBound,
    name: str = "field",
    *,
    positions: Positions | None = None,
    holes: bool = False,
    modes: tuple[str, ...] = MODES,
    progress: Progress | None = None,
    n_beside: int = 0,
) -> bytes:
    """Return the section of a field.

    Examples:
        >>> mesh = FieldMesh(np.array([[0, 1, 2]], np.int32), 3)
        >>> heat = np.linspace(20, 80, 12, dtype=np.float32).reshape(4, 3, 1)
        >>> section = encode_field(lambda a, b: heat[a:b], 4, mesh, FieldBound(0.5))
        >>> from gvpipe.fields.reader import FieldReader
        >>> bool(np.abs(FieldReader(section, 4, mesh, "heat").read(0, 4) - heat).max() <= 0.5)
        True

    Args:
        read: ``read(start, stop)`` returns frames ``(stop - start, R, C)``; asked for each segment in order, and again from the
            start where segments become shorter.
        n_frames: F, at least 1.
        mesh: the R rows.
        bound: on every value.
        name: of the field, for messages.
        positions: ``positions(start, stop)`` returns the mesh's decoded positions ``(stop - start, V, 3)``, in the order of the
            mesh's vertices; None: the field is coded without them.
        holes: whether NaN is kept, instead of refused.
        modes: of `gvpipe.fields.segment.MODES`; the smallest is chosen for each segment.
        progress: called with the share that is done.
        n_beside: bytes of the file beside this section, as far as they are known.

    Where values take few bytes, segments become shorter: a reader decodes one within the budget of a small file.

    Raises:
        InputError: frames of a wrong shape or type, NaN or infinity.
    """
    if n_frames < 1:
        raise InputError(f"field {name!r} has no frames; leave it out")
    first = narrow(_checked(read(0, 1), (0, 1), mesh, name))
    n_components = first.shape[2]
    if not 0 < n_components <= MAX_COMPONENTS:
        raise InputError(f"field {name!r} has {n_components} components; 1 to {MAX_COMPONENTS} are possible")
    head = Head(first.dtype, n_components, longest_segment(mesh.n_rows, n_components))
    motion = None if positions is None else motion_of(positions, n_frames, mesh)
    while True:
        segments, least = [], (math.inf, 0)
        for start, stop in pairwise(head.bounds(n_frames)):
            values = narrow(_checked(read(start, stop), (start, stop), mesh, name))
            if values.dtype != first.dtype or values.shape[2] != n_components:
                raise InputError(
                    f"field {name!r}: frames {start} to {stop - 1} have {values.shape[2]} components of type {values.dtype}, "
                    f"the first has {n_components} of type {first.dtype}; make them alike"
                )
            missing = check_finite(values, start, name, holes)
            span = None
            if motion is not None:
                least = min(least, _smallest_frame(values, start))
                span = Span(motion, start, stop, tuple(sorted({0, least[1]})))
            place = Place(mesh.causal, name, span)
            segments.append(encode_segment(values, missing, bound, place, modes))
            if progress is not None:
                progress(stop / n_frames)
        section = head.pack(segments)
        longest = _affordable(head, n_frames, mesh.n_rows, len(section) + n_beside)
        if longest >= min(head.longest, n_frames):
            return section
        head = replace(head, longest=longest)


def _affordable(head: Head, n_frames: int, n_rows: int, n_bytes: int) -> int:
    """Frames of a segment that a reader decodes within the budget of a file of ``n_bytes``."""
    longest, budget = min(head.longest, n_frames), Budget(n_bytes)
    n_values = longest * n_rows * head.components
    memory, seconds = cost(n_values, n_values, n_values, head.dtype)
    part = SHARE / max(memory / budget.memory, seconds / budget.seconds, SHARE)
    return max(1, int(longest * part))


def _smallest_frame(values: Array, start: int) -> tuple[float, int]:
    """The sum of magnitudes, and the number, of the frame of ``values (n, R, C)`` in which these are smallest."""
    sums = [float(np.nansum(np.abs(frame.astype(np.float64)))) for frame in values]
    smallest = int(np.argmin(sums))
    return sums[smallest], start + smallest


def _checked(values: Array, span: tuple[int, int], mesh: FieldMesh | FieldGraph, name: str) -> Array:
    start, stop = span
    values = np.asarray(values)
    if values.ndim != 3 or values.shape[:2] != (stop - start, mesh.n_rows):
        raise InputError(
            f"field {name!r}: frames {start} to {stop - 1} have shape {values.shape}; "
            f"({stop - start}, {mesh.n_rows}, components) is needed, one row per {mesh.domain}"
        )
    return values
