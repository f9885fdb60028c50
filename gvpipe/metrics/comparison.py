"""How far a distorted sequence is from its reference, in the measures that the field reports.

`compare` walks both sequences once, a block of frames at a time, so that neither needs to fit in memory. Formulas,
units, sources and limits of every number are in ``docs/metrics.md``; STED is in `gvpipe.metrics.sted`, the surface distance
in `gvpipe.metrics.hausdorff`.

Sources: Z. Karni and C. Gotsman, Compression of soft-body animation sequences, 2004 (``kg``); M. Sattler, R. Sarlette
and R. Klein, Simple and efficient compression of animation sequences, 2005 (``da``).
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Integers
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.topology import unique_edges
from gvpipe.metrics.asset_errors import AssetErrors, compare_attributes, compare_fields, compare_volumes
from gvpipe.metrics.correspondence import canonical_triangles, match_vertices
from gvpipe.metrics.hausdorff import Hausdorff
from gvpipe.metrics.sted import Sted
from gvpipe.metrics.vertex_errors import BLOCK_BYTES, VertexErrors, frame_diagonal, ratio
from gvpipe.model.sequence import MeshSequence

FramesDone = Callable[[int, int], None]
"""Called with the frames done, and the frames in all."""


@dataclass(frozen=True)
class Comparison:
    """The distances between two sequences; ``None`` where a quotient has no meaning (see `docs/metrics.md`).

    Model units: ``rmse``, ``max``, ``hausdorff`` and both values per frame. Fractions of the reference's frame-0
    bounding-box diagonal: ``rmse_diag``, ``max_diag``. Percent: ``kg`` and ``da``. Without unit: the ``sted`` values.
    ``attributes`` and ``fields`` have the largest and mean error of each, in its own unit, degrees for normals and tangents;
    ``volume`` has those of what lies inside of the surface.
    """

    rmse: float
    rmse_diag: float | None
    max: float
    max_diag: float | None
    kg: float | None
    da: float | None
    sted: float | None
    sted_spatial: float | None
    sted_temporal: float | None
    hausdorff: float | None
    frames: list[dict[str, float]]
    attributes: AssetErrors = field(default_factory=dict)
    fields: AssetErrors = field(default_factory=dict)
    volume: AssetErrors = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """The same values under the same names, ready for `json.dumps`; what is not defined is ``null``."""
        return asdict(self)

    def of(self, reference: object, distorted: object) -> Comparison:
        """The same, which notebooks show with players of both sides: paths, or objects, as long as others hold them."""
        object.__setattr__(self, "_sides", [_held(each) for each in (reference, distorted)])
        return self

    @property
    def sides(self) -> list[Any]:
        """What was compared, reference first; [] if it is gone, or was never told."""
        sides = [side() if isinstance(side, weakref.ref) else side for side in self.__dict__.get("_sides", ())]
        return [] if any(side is None for side in sides) else sides

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_sides"}

    def _repr_html_(self) -> str:
        from gvpipe.metrics.comparison_page import comparison_html

        return comparison_html(self.to_json())

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        from gvpipe.model.notebook import mimebundle

        return mimebundle(self)


def _held(given: object) -> Any:
    return given if isinstance(given, str | os.PathLike | list | tuple) else weakref.ref(given)


def compare(reference: MeshSequence, distorted: MeshSequence, progress: FramesDone | None = None) -> Comparison:
    """Measure ``distorted`` against ``reference``, vertex by vertex, frame by frame.

    Args:
        reference: the original; lengths are divided by its size.
        distorted: as many frames and vertices, the same triangles in any order.
        progress: called with (frames done, frames in all) after each block.

    Raises:
        InputError: the two differ in their number of frames or vertices or in their triangles, so that vertices do not
            correspond.
        TypeError: one of them is no sequence.

    Examples:
        >>> import gvpipe
        >>> corners = np.array([[[0, 0, 0], [3, 0, 0], [0, 4, 0]]], float)  # one frame; its diagonal is 5
        >>> still = gvpipe.MeshSequence(corners, [[0, 1, 2]])
        >>> raised = gvpipe.MeshSequence(corners + [0, 0, 0.5], [[0, 1, 2]])
        >>> errors = gvpipe.compare(still, raised)
        >>> errors.rmse, errors.rmse_diag
        (0.5, 0.1)
    """
    for role, given in (("reference", reference), ("distorted", distorted)):
        if not isinstance(given, MeshSequence):
            raise TypeError(f"compare's {role} is {show(given)}; a MeshSequence is needed, such as gvpipe.read(path)")
    given, pairing = distorted, pair_vertices(reference, distorted)
    distorted = distorted if pairing is None else distorted.reordered(np.argsort(pairing), reference.faces)
    n_frames = reference.n_frames
    edges = unique_edges(reference.faces)
    diagonal = frame_diagonal(reference)
    sted = Sted(edges, reference.n_vertices, diagonal)
    hausdorff = Hausdorff(reference.faces, edges, reference.n_vertices)
    errors = VertexErrors()
    step = max(1, BLOCK_BYTES // (24 * reference.n_vertices))
    apart = distorted.origin - reference.origin
    for first, chunk in reference.exact_chunks():
        other = distorted.read_exact(first, first + len(chunk)) + apart
        for start in range(0, len(chunk), step):
            a, b = chunk[start : start + step], other[start : start + step]  # (n, V, 3), n frames
            distance = np.linalg.norm(a - b, axis=2)  # (n, V)
            errors.add(a, distance)
            sted.add(a, b)
            hausdorff.add(a, b, distance)
            if progress is not None:
                progress(first + start + len(a), n_frames)
    found = errors.result(diagonal)
    spatial, temporal = sted.spatial(), sted.temporal()
    same = np.arange(reference.n_vertices) if pairing is None else pairing
    return Comparison(
        **asdict(found),
        da=ratio(100 * errors.mean.mean(), diagonal),
        sted=sted.combined(),
        sted_spatial=spatial,
        sted_temporal=temporal,
        hausdorff=hausdorff.result(),
        frames=[{"rmse": float(r), "max": float(m)} for r, m in zip(errors.rmse, errors.largest, strict=True)],
        attributes=compare_attributes(reference, given, same),
        fields=compare_fields(reference, given, same),
        volume=compare_volumes(reference, given),
    )


def aligned(reference: MeshSequence, distorted: MeshSequence) -> MeshSequence:
    """Return ``distorted`` in the reference's vertex order; raises `InputError` as `pair_vertices`."""
    pairing = pair_vertices(reference, distorted)
    return distorted if pairing is None else distorted.reordered(np.argsort(pairing), reference.faces)


def pair_vertices(reference: MeshSequence, distorted: MeshSequence) -> Integers | None:
    """Return ``(V,)`` the reference's vertex of each vertex of ``distorted``; None if they are in the same order.

    Raises:
        InputError: the two do not belong together.
    """
    counts = (
        ("frames", reference.n_frames, distorted.n_frames),
        ("vertices", reference.n_vertices, distorted.n_vertices),
        ("triangles", len(reference.faces), len(distorted.faces)),
    )
    for what, ours, theirs in counts:
        if ours != theirs:
            raise InputError(
                f"{reference.name} has {ours} {what}, {distorted.name} has {theirs}; equal numbers are needed, since "
                "vertices are compared by index"
            )
    if np.array_equal(canonical_triangles(reference.faces), canonical_triangles(distorted.faces)):
        return None
    pairing = match_vertices(reference, distorted)
    if pairing is None:
        raise InputError(
            f"{reference.name} and {distorted.name} both have {reference.n_vertices} vertices and "
            f"{len(reference.faces)} triangles, but not the same triangles, in whatever vertex order; compare a sequence with "
            "what was made from it"
        )
    return pairing
