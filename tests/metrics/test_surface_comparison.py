"""Comparing animations whose vertices do not correspond."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gvpipe.foundation.arrays import Float64, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.metrics import surface_comparison
from gvpipe.metrics.comparison import compare
from gvpipe.metrics.point_clouds import BEST_PSNR
from gvpipe.metrics.surface import surface_distances
from gvpipe.metrics.surface_comparison import SequenceSurfaces, compare_surfaces, scale_of_frames
from gvpipe.model import sequence
from gvpipe.model.sequence import MeshSequence

SQUARE = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], float)  # its diagonal is 5
FACES = np.array([[0, 1, 2], [0, 2, 3]])
CENTRED = np.concatenate([SQUARE, [[1.5, 2, 0]]])
FAN = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


@pytest.fixture(autouse=True)
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_comparison, "SAMPLES", 200)
    monkeypatch.setattr(surface_comparison, "GRID", 33)


def _rising(points: Float64, faces: Integers, heights: list[float], name: str) -> MeshSequence:
    return MeshSequence(np.stack([np.add(points, [0, 0, height]) for height in heights]), faces.astype(np.int32), name=name)


class _Changing:
    """Each frame is a mesh of its own."""

    def __init__(self, name: str, *meshes: tuple[Float64, Integers]) -> None:
        self.name, self.n_frames, self._meshes = name, len(meshes), meshes

    def frame(self, k: int) -> tuple[Float64, Integers]:
        return self._meshes[k]


def test_surfaces_are_compared_where_vertices_do_not_correspond() -> None:
    reference, distorted = _rising(SQUARE, FACES, [0, 0], "a"), _rising(CENTRED, FAN, [0.5, 1], "b")
    errors = compare(reference, distorted)
    assert np.isnan([errors.rmse, errors.max]).all()
    assert errors.rmse_diag is errors.max_diag is errors.kg is errors.sted is errors.hausdorff is None
    assert errors.to_json()["rmse"] is errors.to_json()["max"] is None
    assert errors.frames == [] and errors.attributes == errors.fields == errors.volume == {}
    assert errors.unpaired.startswith("a has 4 vertices, b has 5")
    assert "root mean square distance of the surfaces" in errors._repr_html_() and "at most 1 model" in errors._repr_html_()
    found = errors.surface
    assert found is not None
    assert (found.rms, found.p99, found.max, found.d1_mse, found.d2_mse) == (0.75, 0.75, 1, 0.625, 0.625)
    assert (found.rms_diag, found.p99_diag, found.max_diag, found.diagonal) == pytest.approx((0.15, 0.15, 0.2, 5))
    ratios = [10 * np.log10(3 * 4**2 / height**2) for height in (0.5, 1)]
    assert found.d1_psnr == found.d2_psnr == pytest.approx(np.mean(ratios))
    assert [frame["rms"] for frame in found.frames] == [frame["max"] for frame in found.frames] == [0.5, 1]
    assert [frame["d1_psnr"] for frame in found.frames] == pytest.approx(ratios)


def test_surfaces_of_one_connectivity_are_compared_when_asked() -> None:
    reference, distorted = _rising(SQUARE, FACES, [0, 0], "a"), _rising(SQUARE, FACES, [0, 2], "b")
    calls: list[tuple[int, int]] = []
    both = compare(reference, distorted, lambda done, of: calls.append((done, of)), surface=True)
    alone = compare(reference, distorted)
    assert alone.surface is None and alone.unpaired == both.unpaired == ""
    assert replace(both, surface=None) == alone
    assert both.surface is not None and both.surface.max == alone.max == 2
    assert both.surface.frames[0]["d1_psnr"] == BEST_PSNR
    assert calls[-1] == (4, 4) and calls == sorted(calls)


def test_each_frame_may_have_its_own_mesh() -> None:
    """The peak is that of the box of all frames, the diagonal that of the first."""
    square, fan = (SQUARE, FACES), (CENTRED, FAN)
    large = (4 * CENTRED, FAN)
    found = compare_surfaces(_Changing("a", square, large), _Changing("b", fan, (4 * SQUARE + [0, 0, 1], FACES)))
    assert (found.diagonal, found.peak, found.max, found.max_diag) == (5, 16, 1, 0.2)
    assert found.rms == 0.5
    assert found.frames[1]["d2_psnr"] == pytest.approx(10 * np.log10(3 * 16**2))


def test_empty_frames_of_both_are_equal_and_of_one_are_named() -> None:
    square, nothing = (SQUARE, FACES), (np.zeros((0, 3)), FACES[:0])
    found = compare_surfaces(_Changing("a", square, nothing), _Changing("b", square, nothing))
    assert found.max == 0 and found.d1_psnr == BEST_PSNR
    assert compare_surfaces(_Changing("a", nothing), _Changing("b", nothing)).diagonal == 0
    with pytest.raises(InputError, match="frame 1 of b has no triangles, that of a has"):
        compare_surfaces(_Changing("a", square, square), _Changing("b", square, nothing))
    with pytest.raises(InputError, match="a has 2 frames, b has 1; equal numbers are needed"):
        compare_surfaces(_Changing("a", square, square), _Changing("b", square))


def test_points_without_triangles_have_no_surface() -> None:
    points = _rising(SQUARE, FACES[:0], [0], "a")
    with pytest.raises(InputError, match="a has no triangles, so that there are no surfaces to compare"):
        compare(points, points, surface=True)


def test_positions_count_from_the_origin_of_the_world() -> None:
    far = np.array([1e6, 2e6, 0])
    reference = replace(_rising(SQUARE, FACES, [0], "a"), origin=far)
    distorted = replace(_rising(CENTRED, FAN, [0.5], "b"), origin=np.add(far, [0, 0, 1]))
    found = compare(reference, distorted).surface
    assert found is not None and found.rms == pytest.approx(1.5) and found.d1_mse == pytest.approx(2.25)


def test_frames_are_read_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sequence, "CHUNK_BYTES", 12 * 4 * 2)  # two frames
    heights = [0.0, 1.0, 2.0, 4.0, 8.0]
    surfaces = SequenceSurfaces(_rising(SQUARE, FACES, heights, "a"))
    assert [surfaces.frame(k)[0][0, 2] for k in range(5)] == heights
    assert surfaces.frame(1)[0][0, 2] == 1
    assert scale_of_frames(surfaces).peak == 8 and scale_of_frames(surfaces).diagonal == 5


def test_a_frame_has_the_numbers_of_the_function() -> None:
    bent = CENTRED + np.array([[0, 0, 0]] * 4 + [[0, 0, 1]])
    found = compare_surfaces(_Changing("a", (bent, FAN)), _Changing("b", (SQUARE, FACES)))
    alone = surface_distances(bent, FAN, SQUARE, FACES, samples=200, grid=33)
    assert {name: getattr(found, name) for name in alone.to_json()} == pytest.approx(alone.to_json())
    assert found.d2_mse is not None and found.d1_mse is not None and 0 < found.d2_mse < found.d1_mse
