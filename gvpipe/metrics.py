"""How far a distorted sequence is from its reference, in the measures that the field reports.

`compare` walks both sequences once, a block of frames at a time, so that neither needs to fit in memory. Formulas,
units, sources and limits of every number are in ``docs/metrics.md``; STED is in `gvpipe.sted`, the surface distance
in `gvpipe.surface`.

Sources: Z. Karni and C. Gotsman, Compression of soft-body animation sequences, 2004 (``kg``); M. Sattler, R. Sarlette
and R. Klein, Simple and efficient compression of animation sequences, 2005 (``da``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from gvpipe.errors import InputError
from gvpipe.matching import canonical_triangles, match_vertices
from gvpipe.sequence import MeshSequence
from gvpipe.sted import Sted
from gvpipe.surface import Hausdorff
from gvpipe.topology import unique_edges

BLOCK_BYTES = 4 << 20  # float64 positions of one side worked on at a time: the temporaries of a block stay in cache

Float64 = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Comparison:
    """The distances between two sequences; ``None`` where a quotient has no meaning (see `docs/metrics.md`).

    Model units: ``rmse``, ``max``, ``hausdorff`` and both values per frame. Fractions of the reference's frame-0
    bounding-box diagonal: ``rmse_diag``, ``max_diag``. Percent: ``kg`` and ``da``. Without unit: the ``sted`` values.
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

    def to_json(self) -> dict[str, object]:
        """The same values under the same names, ready for `json.dumps`; what is not defined is ``null``."""
        return asdict(self)


def compare(reference: MeshSequence, distorted: MeshSequence, progress: Progress | None = None) -> Comparison:
    """Measure ``distorted`` against ``reference``, vertex by vertex, frame by frame.

    Args:
        reference: the original; lengths are divided by its size.
        distorted: as many frames and vertices, the same triangles in any order.
        progress: called with (frames done, frames in all) after each block.

    Raises:
        InputError: the two differ in their number of frames or vertices or in their triangles, so that no vertex of
            one answers to a vertex of the other.
    """
    distorted = aligned(reference, distorted)
    n_frames = reference.n_frames
    edges = unique_edges(reference.faces)
    diagonal = _diagonal(reference)
    sted = Sted(edges, reference.n_vertices, diagonal)
    hausdorff = Hausdorff(reference.faces, edges, reference.n_vertices)
    errors = _VertexErrors()
    step = max(1, BLOCK_BYTES // (24 * reference.n_vertices))
    for first, chunk in reference.chunks():
        other = distorted.read(first, first + len(chunk))
        for start in range(0, len(chunk), step):
            a = chunk[start : start + step].astype(np.float64)  # (n, V, 3), n frames
            b = other[start : start + step].astype(np.float64)
            distance = np.linalg.norm(a - b, axis=2)  # (n, V)
            errors.add(a, distance)
            sted.add(a, b)
            hausdorff.add(a, b, distance)
            if progress is not None:
                progress(first + start + len(a), n_frames)
    rmse, mean, largest = (np.concatenate(parts) for parts in (errors.rmse, errors.mean, errors.largest))
    spatial, temporal = sted.spatial(), sted.temporal()
    return Comparison(
        rmse=float(rmse.mean()),
        rmse_diag=_ratio(rmse.mean(), diagonal),
        max=float(largest.max()),
        max_diag=_ratio(largest.max(), diagonal),
        kg=_ratio(100 * math.sqrt(errors.squared_error), math.sqrt(errors.squared_spread)),
        da=_ratio(100 * mean.mean(), diagonal),
        sted=sted.combined(),
        sted_spatial=spatial,
        sted_temporal=temporal,
        hausdorff=hausdorff.result(),
        frames=[{"rmse": float(r), "max": float(m)} for r, m in zip(rmse, largest, strict=True)],
    )


class _VertexErrors:
    """Sums over blocks of frames: per-frame values, and the two Frobenius norms of the Karni-Gotsman error."""

    def __init__(self) -> None:
        self.rmse: list[Float64] = []  # each (n,), model units
        self.mean: list[Float64] = []
        self.largest: list[Float64] = []
        self.squared_error = 0.0
        self.squared_spread = 0.0

    def add(self, a: Float64, distance: Float64) -> None:
        squared = np.einsum("fv,fv->f", distance, distance)
        self.rmse.append(np.sqrt(squared / distance.shape[1]))
        self.mean.append(distance.mean(axis=1))
        self.largest.append(distance.max(axis=1))
        self.squared_error += float(squared.sum())
        centred = a - a.mean(axis=1, keepdims=True)
        self.squared_spread += float(np.einsum("fvc,fvc->", centred, centred))


def _ratio(value: float, size: float) -> float | None:
    """``value / size``; against size 0 no error stays 0 and any other has no meaning."""
    if size > 0:
        return float(value / size)
    return 0.0 if value == 0 else None


def _diagonal(reference: MeshSequence) -> float:
    frame = reference.read(0, 1)[0].astype(np.float64)
    return float(np.linalg.norm(np.ptp(frame, axis=0)))


def aligned(reference: MeshSequence, distorted: MeshSequence) -> MeshSequence:
    """Return ``distorted`` in the reference's vertex order, or raise `InputError` if the two do not belong together."""
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
        return distorted
    pairing = match_vertices(reference, distorted)
    if pairing is None:
        raise InputError(
            f"{reference.name} and {distorted.name} both have {reference.n_vertices} vertices and "
            f"{len(reference.faces)} triangles, but not the same triangles, in whatever vertex order; compare a sequence with "
            "what was made from it"
        )
    return distorted.reordered(np.argsort(pairing), reference.faces)
