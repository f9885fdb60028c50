"""Metrics that `compare` measures where they are asked for: a number for each frame, and one for all.

=======  =====================================================  =============================  ======================
name     what                                                   needs                          where
=======  =====================================================  =============================  ======================
psnr     ratio of D to a frame's rmse, dB                       vertices that correspond       `FrameMetrics`
dame     dihedral angle mesh error, radians                     vertices that correspond       `metrics.dihedral`
fmpd     fast mesh perceptual distance, 0..1                    triangles                      `metrics.roughness`
mesh     root mean square distance of the surfaces              triangles                      `metrics.surface`
d1, d2   MPEG's ratios, point to point and to plane, dB         triangles                      `metrics.point_clouds`
=======  =====================================================  =============================  ======================

The number for all frames is the mean. Formulas, sources and limits are in ``docs/metrics.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gvpipe.foundation.arguments import did_you_mean, show
from gvpipe.foundation.arrays import Float64, Int32, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.dihedral import Dame
from gvpipe.metrics.point_clouds import BEST_PSNR
from gvpipe.metrics.roughness import Roughness, perceptual_distance
from gvpipe.metrics.surface_comparison import SurfaceComparison, Surfaces

OF_SURFACES = {"mesh": "mesh_rms", "d1": "d1_psnr", "d2": "d2_psnr"}  # where `SurfaceComparison` has them
NAMES = ("d1", "d2", "dame", "fmpd", "mesh", "psnr")
ALWAYS = ("rmse", "max", "kg", "da", "sted", "hausdorff")  # which `compare` measures unasked


@dataclass(frozen=True)
class FrameMetric:
    """A metric's numbers.

    Args:
        value: of all frames, the mean; None where it has no meaning.
        frames: of each frame; empty where vertices had to correspond and do not.
    """

    value: float | None
    frames: list[float | None]

    @classmethod
    def of(cls, frames: Iterable[float | None]) -> FrameMetric:
        """The metric whose numbers of frames are given."""
        given = list(frames)
        known = [each for each in given if each is not None]
        return cls(math.fsum(known) / len(known) if known else None, given)


def check_metrics(names: str | Iterable[str]) -> tuple[str, ...]:
    """Return names of metrics, each once, of a list or a text with commas; raises `InputError` for a name that is none."""
    if not isinstance(names, str | Iterable):
        raise TypeError(f"metrics is {show(names)}; names are needed, such as 'dame,fmpd'")
    given = names.split(",") if isinstance(names, str) else list(names)
    chosen = tuple(dict.fromkeys(str(name).strip().lower() for name in given))
    for name in chosen:
        if name not in NAMES:
            raise InputError(
                f"no metric is called {name!r}{did_you_mean(name, NAMES)}; choose from {', '.join(NAMES)}"
                f" ({', '.join(ALWAYS)} are always measured)"
            )
    return chosen


def need_surfaces(names: Sequence[str]) -> bool:
    """Whether any of these metrics is one of surfaces that are compared."""
    return any(name in OF_SURFACES for name in names)


class FrameMetrics:
    """Measures chosen metrics of frames whose vertices correspond; blocks of frames are added in order.

    Args:
        names: as `check_metrics` returns them.
        faces: ``(T, 3)``, shared by both sequences.
        n_vertices: V.
    """

    def __init__(self, names: Sequence[str], faces: Int32, n_vertices: int) -> None:
        self._names = names
        self._dame = Dame(faces) if "dame" in names else None
        self._roughness = Roughness(faces, n_vertices) if "fmpd" in names and len(faces) else None
        self._frames: dict[str, list[float | None]] = {name: [] for name in names if name not in OF_SURFACES}

    def add(self, a: Float64, b: Float64) -> None:
        """Take the next frames: reference ``a`` and distorted ``b``, ``(n, V, 3)``, model units."""
        none = [None] * len(a)
        if self._dame:
            self._frames["dame"] += self._dame.of(a, b).tolist() if self._dame.is_defined else none
        if "fmpd" in self._names:
            rough = self._roughness
            self._frames["fmpd"] += perceptual_distance(rough.of(a), rough.of(b)).tolist() if rough else none

    def result(self, rmse: Float64, diagonal: float, surface: SurfaceComparison | None) -> dict[str, FrameMetric]:
        """The metrics by name; ``rmse (F,)`` are those of frames, ``diagonal`` is D, both model units."""
        found = dict(self._frames)
        if "psnr" in found:
            found["psnr"] = [vertex_psnr(float(each), diagonal) for each in rmse]
        return _in_order(self._names, found, surface)


def vertex_psnr(rmse: float, diagonal: float) -> float | None:
    """``20 log10(diagonal / rmse)``, dB, at most 99.99; None if the diagonal is 0.

    Examples:
        >>> vertex_psnr(0.01, 1.0)
        40.0
    """
    if not diagonal > 0:
        return None
    return min(BEST_PSNR, 20 * math.log10(diagonal / rmse)) if rmse > 0 else BEST_PSNR


def unpaired_metrics(
    names: Sequence[str], reference: Surfaces, distorted: Surfaces, surface: SurfaceComparison
) -> dict[str, FrameMetric]:
    """The chosen metrics of animations whose vertices do not correspond; those that need it have no numbers."""
    found = {"fmpd": _distances(reference, distorted)} if "fmpd" in names else {}
    return _in_order(names, found, surface)


def _in_order(
    names: Sequence[str], found: dict[str, list[float | None]], surface: SurfaceComparison | None
) -> dict[str, FrameMetric]:
    if surface is not None:
        found |= {name: [frame[key] for frame in surface.frames] for name, key in OF_SURFACES.items()}
    return {name: FrameMetric.of(found.get(name, [])) for name in names}


def _distances(reference: Surfaces, distorted: Surfaces) -> list[float | None]:
    """FMPD of each frame; None where a side has no triangles."""
    sides = _Rough(reference), _Rough(distorted)
    found: list[float | None] = []
    for k in range(reference.n_frames):
        one, other = (side.frame(k) for side in sides)
        found.append(float(perceptual_distance(one, other)[0]) if one and other else None)
    return found


class _Rough:
    """The roughness of an animation's frames; that of triangles which stay is prepared once."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces
        self._faces: Integers | None = None

    def frame(self, k: int) -> tuple[Float64, Float64] | None:
        points, faces = self._surfaces.frame(k)
        if len(faces) == 0:
            return None
        if faces is not self._faces:
            self._faces, self._roughness = faces, Roughness(faces, len(points))
        return self._roughness.of(points[None])
