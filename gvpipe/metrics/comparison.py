"""How far a distorted sequence is from its reference, in the measures that the field reports.

`compare` walks both sequences once, a block of frames at a time, so that neither needs to fit in memory. Formulas,
units, sources and limits of every number are in ``docs/metrics.md``; STED is in `gvpipe.metrics.sted`, the surface distance
in `gvpipe.metrics.hausdorff`. Where vertices do not correspond, surfaces are compared (`gvpipe.metrics.surface_comparison`).

Sources: Z. Karni and C. Gotsman, Compression of soft-body animation sequences, 2004 (``kg``); M. Sattler, R. Sarlette
and R. Klein, Simple and efficient compression of animation sequences, 2005 (``da``).
"""

from __future__ import annotations

import math
import os
import weakref
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Integers
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.topology import unique_edges
from gvpipe.metrics.asset_errors import AssetErrors, compare_attributes, compare_fields, compare_volumes
from gvpipe.metrics.frame_metrics import FrameMetric, FrameMetrics, check_metrics, need_surfaces, unpaired_metrics
from gvpipe.metrics.hausdorff import Hausdorff
from gvpipe.metrics.pairing import Unpaired, pair_vertices
from gvpipe.metrics.sted import Sted
from gvpipe.metrics.surface_comparison import (
    CaptureSurfaces,
    SequenceSurfaces,
    SurfaceComparison,
    compare_surfaces,
)
from gvpipe.metrics.texture_errors import TextureErrors, compare_surface_colours, compare_textures
from gvpipe.metrics.vertex_errors import BLOCK_BYTES, VertexErrors, frame_diagonal, ratio
from gvpipe.model.capture import Capture
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

    ``surface`` has the distances of surfaces, where they were asked for or vertices do not correspond. ``unpaired`` says why
    vertices do not, else it is empty. If they do not, ``rmse`` and ``max`` are NaN, other numbers of vertices ``None``,
    ``frames`` is empty, and attributes, fields and volumes are not compared. ``metrics`` has those that were asked for.
    ``textures`` has the signal-to-noise ratios of pictures by name, or of the surface's colours.
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
    surface: SurfaceComparison | None = None
    unpaired: str = ""
    metrics: dict[str, FrameMetric] = field(default_factory=dict)
    textures: dict[str, TextureErrors] = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """The same values under the same names, ready for `json.dumps`; what is not defined is ``null``."""
        values = asdict(self)
        return values | {name: None for name in ("rmse", "max") if math.isnan(values[name])}

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


NOTHING = Comparison(math.nan, None, math.nan, None, None, None, None, None, None, None, [])


def compare(
    reference: MeshSequence,
    distorted: MeshSequence,
    progress: FramesDone | None = None,
    *,
    surface: bool | None = None,
    metrics: str | Iterable[str] = (),
) -> Comparison:
    """Measure ``distorted`` against ``reference``, frame by frame: vertices, surfaces where these do not correspond.

    Args:
        reference: the original; lengths are divided by its size.
        distorted: as many frames; of the same vertices and triangles, in any order, or of others.
        progress: called with (frames done, frames in all) after each block.
        surface: True: surfaces too; False: never; None: where vertices do not correspond.
        metrics: more of them, by name (`gvpipe.metrics.frame_metrics`). Those of surfaces have them compared.

    Raises:
        InputError: they differ in their number of frames, vertices do not correspond and ``surface`` is False, surfaces are
            needed and one side has no triangles, or no metric has such a name.
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
    names = check_metrics(metrics)
    surface = True if need_surfaces(names) else surface
    has_surfaces = bool(len(reference.faces) and len(distorted.faces))
    try:
        pairing = pair_vertices(reference, distorted)
    except Unpaired as exc:
        if surface is False or not has_surfaces:
            raise
        one, other = (Capture([each], each.name) for each in (reference, distorted))
        return _compare_unpaired(one, other, progress, names, str(exc))
    if not surface:
        return _compare_vertices(reference, distorted, pairing, progress, names)
    if not has_surfaces:
        raise InputError(f"{reference.name} has no triangles, so that there are no surfaces to compare; compare vertices alone")
    found = compare_surfaces(SequenceSurfaces(reference), SequenceSurfaces(distorted), _half(progress, 0))
    return _compare_vertices(reference, distorted, pairing, _half(progress, 1), names, found)


def compare_captures(
    reference: Capture, distorted: Capture, progress: FramesDone | None = None, *, metrics: str | Iterable[str] = ()
) -> Comparison:
    """Measure two animations whose vertices or triangles change, by their surfaces; ``metrics`` as `compare` takes them.

    Raises:
        InputError: they differ in their number of frames, one side of a frame has no triangles, or no metric has such a name.
    """
    names, changing = check_metrics(metrics), reference if len(reference.shots) > 1 else distorted
    why = f"vertices or triangles of {changing.name} change"
    return _compare_unpaired(reference, distorted, progress, names, why)


def _half(progress: FramesDone | None, half: int) -> FramesDone | None:
    """Progress of the first (0) or second (1) walk through all frames."""
    return None if progress is None else lambda done, of: progress(done + half * of, 2 * of)


def _compare_unpaired(
    reference: Capture, distorted: Capture, progress: FramesDone | None, names: tuple[str, ...], why: str
) -> Comparison:
    surface = compare_surfaces(CaptureSurfaces(reference), CaptureSurfaces(distorted), progress)
    metrics = unpaired_metrics(names, CaptureSurfaces(reference), CaptureSurfaces(distorted), surface)
    textures = compare_surface_colours(reference, distorted)
    return replace(NOTHING, surface=surface, unpaired=why, metrics=metrics, textures=textures)


def _compare_vertices(
    reference: MeshSequence,
    distorted: MeshSequence,
    pairing: Integers | None,
    progress: FramesDone | None,
    names: tuple[str, ...],
    surface: SurfaceComparison | None = None,
) -> Comparison:
    given = distorted
    distorted = distorted if pairing is None else distorted.reordered(np.argsort(pairing), reference.faces)
    n_frames = reference.n_frames
    edges = unique_edges(reference.faces)
    diagonal = frame_diagonal(reference)
    sted = Sted(edges, reference.n_vertices, diagonal)
    hausdorff = Hausdorff(reference.faces, edges, reference.n_vertices)
    errors, more = VertexErrors(), FrameMetrics(names, reference.faces, reference.n_vertices)
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
            more.add(a, b)
            if progress is not None:
                progress(first + start + len(a), n_frames)
    found = errors.result(diagonal)
    spatial, temporal = sted.spatial(), sted.temporal()
    same = np.arange(reference.n_vertices) if pairing is None else pairing
    attributes = compare_attributes(reference, given, same)
    return Comparison(
        **asdict(found),
        da=ratio(100 * errors.mean.mean(), diagonal),
        sted=sted.combined(),
        sted_spatial=spatial,
        sted_temporal=temporal,
        hausdorff=hausdorff.result(),
        frames=[{"rmse": float(r), "max": float(m)} for r, m in zip(errors.rmse, errors.largest, strict=True)],
        attributes=attributes,
        fields=compare_fields(reference, given, same),
        volume=compare_volumes(reference, given),
        surface=surface,
        metrics=more.result(errors.rmse, diagonal, surface),
        textures=compare_textures(reference, given, attributes),
    )
