"""How far two surfaces are from each other, whose vertices and triangles do not correspond.

Both ways are measured, from each surface to the other, and the larger counts. Distances are exact, from points to triangles:
P. Cignoni, C. Rocchini and R. Scopigno, Metro: measuring error on simplified surfaces, 1998; N. Aspert, D. Santa-Cruz and
T. Ebrahimi, MESH: measuring errors between surfaces using the Hausdorff distance, 2002. D1 and D2 are MPEG's
(`gvpipe.metrics.point_clouds`). Formulas and sources are in ``docs/metrics.md``.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.point_clouds import GRID, Cloud, cloud_errors, make_clouds, psnr
from gvpipe.metrics.surface_samples import sample_by_area
from gvpipe.metrics.triangle_tree import TriangleTree, build_tree, find_nearest
from gvpipe.metrics.vertex_errors import ratio
from gvpipe.runtime.ahead import beside

SAMPLES = 100_000  # points of each surface
QUANTILE = 0.99


@dataclass(frozen=True)
class SurfaceErrors:
    """Distances between two surfaces, of both ways the larger; None: no meaning, or not measured.

    Model units: ``rms``, the root mean square, ``p99``, the 99 % quantile, and ``max``, the largest, at samples and vertices;
    ``mesh_rms``, the root mean square over the area. The same as parts of a diagonal: ``_diag``. Squared model units:
    ``d1_mse``, from point to point, and ``d2_mse``, from point to plane. Of these the peak signal-to-noise ratio in decibels,
    at most 99.99: ``d1_psnr``, ``d2_psnr``.
    """

    rms: float
    rms_diag: float | None
    p99: float
    p99_diag: float | None
    max: float
    max_diag: float | None
    d1_mse: float | None
    d1_psnr: float | None
    d2_mse: float | None
    d2_psnr: float | None
    mesh_rms: float
    mesh_rms_diag: float | None

    def to_json(self) -> dict[str, Any]:
        """The same values under the same names, ready for `json.dumps`; what is not defined is ``null``."""
        return asdict(self)


class Scale(NamedTuple):
    """What errors are measured by.

    Args:
        diagonal: of the box that errors are parts of, model units.
        low: ``(3,)`` the corner of the box that holds the grid of D1 and D2.
        peak: the longest side of that box, model units: the peak of the ratios.
    """

    diagonal: float
    low: Float64
    peak: float


class Surface:
    """Points and triangles of one frame, checked, with what searches and samples take.

    Args:
        points: ``(V, 3)``, model units.
        faces: ``(T, 3)``, T > 0.
        name: for messages.

    Raises:
        InputError: no triangle, a point that is not finite, an index out of range, another shape.
    """

    def __init__(self, points: Any, faces: Any, name: str) -> None:
        self.points = _as_points(points, name)
        faces = _as_triangles(faces, len(self.points), name)
        self.corners = self.points[faces]
        self.used = self.points[np.unique(faces)]
        self._tree: TriangleTree | None = None

    @property
    def tree(self) -> TriangleTree:
        """The tree over its triangles, built when it is first asked for."""
        if self._tree is None:
            self._tree = build_tree(self.corners)
        return self._tree


def surface_distances(
    points_a: Floats,
    faces_a: Integers,
    points_b: Floats,
    faces_b: Integers,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    grid: int = GRID,
    scale: Scale | None = None,
) -> SurfaceErrors:
    """Measure how far two surfaces are from each other.

    Args:
        points_a, points_b: ``(V, 3)``, model units; each has its own V.
        faces_a, faces_b: ``(T, 3)``, T > 0; each has its own T. Vertices without triangles do not count.
        samples: points of each surface, even by area, at which distances are measured beside its vertices.
        seed: of the samples; the same seed gives the same numbers.
        grid: lines along the longest side of the box, of the point clouds of D1 and D2; 0 leaves both out, which takes a
            fifth of the time.
        scale: what errors are measured by; of ``points_a`` if it is not given.

    Raises:
        InputError: no triangle, a point that is not finite, an index out of range, another shape, no sample.

    Examples:
        >>> square = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], float)  # its diagonal is 5
        >>> errors = surface_distances(square, [[0, 1, 2], [0, 2, 3]], square + [0, 0, 0.5], [[0, 1, 3], [1, 2, 3]], grid=64)
        >>> errors.rms, errors.max_diag, errors.d1_mse
        (0.5, 0.1, 0.25)
    """
    if samples < 1 or (grid != 0 and grid < 2):
        raise InputError(
            f"{samples} samples and a grid of {grid} lines; 1 or more and 2 or more are needed (0 lines: no D1, D2)"
        )
    one, other = Surface(points_a, faces_a, "the first surface"), Surface(points_b, faces_b, "the second surface")
    return measure(one, other, scale or scale_of(one.points), samples=samples, seed=seed, grid=grid)


def measure(
    one: Surface, other: Surface, scale: Scale, *, samples: int = SAMPLES, seed: int = 0, grid: int = GRID
) -> SurfaceErrors:
    """As `surface_distances`, of two `Surface`, by a given scale. Each way has a thread."""
    clouds = make_clouds(one.corners, other.corners, scale.low, scale.peak, grid) if grid else None
    with beside(lambda: _one_way(one, other, samples, seed, clouds)) as there:
        back = _one_way(other, one, samples, seed, clouds and clouds[::-1])
        rms, p99, largest, mesh_rms, *d1_d2 = np.maximum(there(), back).tolist()
    d1, d2 = (None if math.isnan(each) else each for each in d1_d2)
    return SurfaceErrors(
        rms,
        ratio(rms, scale.diagonal),
        p99,
        ratio(p99, scale.diagonal),
        largest,
        ratio(largest, scale.diagonal),
        d1,
        psnr(d1, scale.peak),
        d2,
        psnr(d2, scale.peak),
        mesh_rms,
        ratio(mesh_rms, scale.diagonal),
    )


def scale_of(points: Float64) -> Scale:
    """The scale of the box of ``points (V, 3)``."""
    low = points.min(axis=0)
    sides = points.max(axis=0) - low
    return Scale(float(np.linalg.norm(sides)), low, float(sides.max()))


def _one_way(source: Surface, target: Surface, samples: int, seed: int, clouds: tuple[Cloud, Cloud] | None) -> Float64:
    """``rms``, ``p99``, ``max``, ``mesh_rms``, ``d1_mse`` and ``d2_mse`` ``(6,)`` of one way; NaN: not measured."""
    by_area = sample_by_area(source.corners, samples, seed).points
    distances = find_nearest(target.tree, np.concatenate([by_area, source.used])).distances
    squared = np.square(distances)
    rms, mesh_rms = (math.sqrt(float(part.mean())) for part in (squared, squared[: len(by_area)]))
    d1, d2 = cloud_errors(*clouds, target.tree) if clouds else (math.nan, math.nan)
    return np.array([rms, np.quantile(distances, QUANTILE), distances.max(), mesh_rms, d1, d2])


def _as_points(given: Any, name: str) -> Float64:
    points = np.asarray(given, np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{name} has points of shape {points.shape}; (vertices, 3) is needed")
    if not np.isfinite(points).all():
        vertex = int(np.argwhere(~np.isfinite(points).all(axis=1))[0, 0])
        raise InputError(f"{name}: vertex {vertex} is {points[vertex].tolist()}; every coordinate must be a finite number")
    return points


def _as_triangles(given: Any, n_vertices: int, name: str) -> Integers:
    faces = np.asarray(given)
    if faces.size == 0:
        raise InputError(f"{name} has no triangles; there is no distance to an empty surface")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(f"{name} has faces of shape {faces.shape} and type {faces.dtype}; (triangles, 3) integers are needed")
    if faces.min() < 0 or faces.max() >= n_vertices:
        bad = int(np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))[0])
        raise InputError(f"{name}: triangle {bad} is {faces[bad].tolist()}; indices must lie in 0..{n_vertices - 1}")
    return faces
