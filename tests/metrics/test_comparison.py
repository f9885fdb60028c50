"""The metrics against closed forms and invariances; see also test_sted and test_triangle_search."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from folders import DATA
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gvpipe.foundation.errors import InputError
from gvpipe.metrics import comparison
from gvpipe.metrics.comparison import Comparison, compare
from gvpipe.model import sequence
from gvpipe.model.sequence import MeshSequence

SEEDS = st.integers(0, 2**32 - 1)
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
VALUES = ("rmse", "rmse_diag", "max", "max_diag", "kg", "da", "sted", "sted_spatial", "sted_temporal", "hausdorff")


def _wave(n_frames: int = 8, columns: int = 5, rows: int = 4) -> MeshSequence:
    """A waving sheet on a lattice of 1/1024, so that lattice shifts and powers of two are exact in float32."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    rest = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3).astype(float)
    time = np.arange(n_frames)[:, None]
    moving = np.repeat(rest[None], n_frames, axis=0)
    moving[:, :, 2] += np.sin(rest[:, 0] + 0.7 * time) * (1 + 0.1 * time)
    moving[:, :, 0] += 0.1 * np.cos(rest[:, 1] - 0.4 * time)
    corner = (np.arange(columns - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    lower = np.stack([corner, corner + rows, corner + 1], axis=1)
    upper = np.stack([corner + 1, corner + rows, corner + rows + 1], axis=1)
    return MeshSequence(np.round(moving * 1024) / 1024, np.vstack([lower, upper]).astype(np.int32), name="wave")


def _noisy(wave: MeshSequence, seed: int, size: float = 0.2) -> MeshSequence:
    noise = np.random.default_rng(seed).uniform(-size, size, wave.positions.shape)
    return _moved(wave, np.round((wave.read(0, len(wave)) + noise) * 1024) / 1024)


def _moved(wave: MeshSequence, positions: NDArray[np.floating]) -> MeshSequence:
    return replace(wave, positions=positions.astype(np.float32), name="moved")


def _assert_same(left: Comparison, right: Comparison, tolerance: float = 1e-9) -> None:
    for name in VALUES:
        assert getattr(left, name) == pytest.approx(getattr(right, name), rel=tolerance, abs=1e-12), name


# Closed forms


def test_identical_sequences_differ_by_nothing() -> None:
    wave = _wave()
    result = compare(wave, wave)
    assert all(getattr(result, name) == 0 for name in VALUES)
    assert result.frames == [{"rmse": 0.0, "max": 0.0}] * len(wave)


def test_translation_moves_every_distance_by_its_length_and_no_edge() -> None:
    wave = _wave()
    positions = wave.read(0, len(wave))
    result = compare(wave, _moved(wave, positions + np.array([0.75, 0, -1.0])))
    diagonal = float(np.linalg.norm(np.ptp(positions[0].astype(float), axis=0)))
    centred = positions.astype(float) - positions.astype(float).mean(axis=1, keepdims=True)
    assert result.rmse == result.max == pytest.approx(1.25, rel=1e-12)
    assert result.rmse_diag == result.max_diag == pytest.approx(1.25 / diagonal, rel=1e-12)
    assert result.da == pytest.approx(125 / diagonal, rel=1e-12)
    assert result.kg == pytest.approx(100 * 1.25 * np.sqrt(len(wave) * 20) / np.linalg.norm(centred), rel=1e-12)
    assert result.sted == 0
    assert result.hausdorff is not None and 0 < result.hausdorff <= 1.25


def test_uniform_scale_has_the_scale_as_kg_and_no_spatial_deviation() -> None:
    wave = _wave()
    centred = wave.read(0, len(wave)).astype(float)
    centred = np.round((centred - centred.mean(axis=1, keepdims=True)) * 2**20) / 2**20  # mean 0 up to 1e-6
    result = compare(_moved(wave, centred), _moved(wave, centred * 1.5))
    assert result.kg == pytest.approx(50, abs=1e-4)
    assert result.sted_spatial == pytest.approx(0, abs=1e-6)
    assert result.sted_temporal is not None and result.sted_temporal < 0.01  # motion grown in proportion


def test_one_vertex_moved_in_one_frame() -> None:
    frames = np.zeros((4, 4, 3), np.float32)
    frames[:, 1:] = np.eye(3)
    other = frames.copy()
    other[2, 0] = -0.25
    result = compare(MeshSequence(frames, TETRAHEDRON), MeshSequence(other, TETRAHEDRON))
    length = 0.25 * np.sqrt(3)
    assert result.max == pytest.approx(length)
    assert result.rmse == pytest.approx(length / 2 / 4)
    assert result.frames[2] == {"rmse": pytest.approx(length / 2), "max": pytest.approx(length)}
    assert result.frames[0] == {"rmse": 0.0, "max": 0.0}
    assert result.da == pytest.approx(100 * length / 16 / np.sqrt(3))
    assert result.kg == pytest.approx(100 * length / np.sqrt(4 * (3 - 0.75)))
    assert result.hausdorff == pytest.approx(length)


# Degenerate input


def test_quotients_without_a_meaning_are_null_and_json_stays_valid() -> None:
    point = MeshSequence(np.zeros((3, 4, 3), np.float32), TETRAHEDRON)
    result = compare(point, _moved(point, np.ones((3, 4, 3))))
    shape = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert list(shape) == [*VALUES, "frames", "attributes", "fields", "volume", "surface", "unpaired", "metrics", "textures"]
    assert [name for name in VALUES if shape[name] is None] == ["rmse_diag", "max_diag", "kg", "da", *VALUES[6:9]]
    assert result.hausdorff == pytest.approx(np.sqrt(3))
    equal = compare(point, point)
    assert equal.kg == equal.da == equal.rmse_diag == equal.sted_temporal == 0


def test_points_without_triangles_have_no_surface_and_no_edges() -> None:
    wave = replace(_wave(), faces=np.zeros((0, 3), np.int32))
    result = compare(wave, _noisy(wave, 1))
    assert result.hausdorff is result.sted is result.sted_spatial is None
    assert result.kg is not None and result.sted_temporal is not None


def test_a_still_frame_collapsed_triangles_and_unused_vertices() -> None:
    wave = _wave(n_frames=1)
    faces = np.vstack([wave.faces[:-3], [[0, 0, 1], [2, 2, 2]]])
    positions = wave.read(0, 1).copy()
    positions[0, 5] = positions[0, 6]  # zero-length edges
    reference = replace(wave, positions=positions, faces=faces)
    moved = positions.copy()
    unused = sorted(set(range(20)) - set(faces.ravel().tolist()))
    moved[0, unused] += 50
    result = compare(reference, replace(reference, positions=moved))
    assert unused and result.max > 50 and result.hausdorff == 0 and result.sted == 0
    noisy = compare(reference, _noisy(reference, 3))
    assert np.isfinite([getattr(noisy, name) for name in VALUES]).all()


def test_different_sequences_are_refused_by_name_and_count() -> None:
    wave = _wave()
    positions = wave.read(0, len(wave))
    extra = np.concatenate([positions, positions[:, :1]], axis=1)
    with pytest.raises(InputError, match="wave has 8 frames, moved has 7"):
        compare(wave, _moved(wave, positions[:7]))
    with pytest.raises(InputError, match="wave has 20 vertices, moved has 21"):
        compare(wave, _moved(wave, extra), surface=False)
    with pytest.raises(InputError, match="wave has 24 triangles, wave has 23"):
        compare(wave, replace(wave, faces=wave.faces[1:]), surface=False)
    with pytest.raises(InputError, match="not the same triangles"):
        compare(wave, replace(wave, faces=wave.faces[:, ::-1]), surface=False)
    with pytest.raises(InputError, match="wave has 24 triangles, wave has 0"):
        compare(wave, replace(wave, faces=wave.faces[:0]))


# Invariances


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.tuples(*[st.integers(-64, 64)] * 3), st.integers(-3, 3), st.permutations(range(3)))
def test_moving_and_scaling_both_sides_changes_units_only(
    seed: int, shift: tuple[int, int, int], octave: int, axes: list[int]
) -> None:
    wave = _wave()
    other = _noisy(wave, seed)
    scale = 2.0**octave
    left, right = (_moved(wave, (side.read(0, 8) + np.array(shift))[:, :, axes] * scale) for side in (wave, other))
    before, after = compare(wave, other), compare(left, right)
    lengths = {name: getattr(before, name) * scale for name in ("rmse", "max", "hausdorff")}
    _assert_same(replace(before, **lengths), after)


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_order_of_vertices_and_triangles_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wave = _wave()
    other = _noisy(wave, seed)
    order = rng.permutation(wave.n_vertices)
    renamed = np.argsort(order).astype(np.int32)[wave.faces]
    left, right = (MeshSequence(side.read(0, 8)[:, order], renamed) for side in (wave, other))
    turned = np.take_along_axis(renamed, (rng.integers(0, 3, (24, 1)) + np.arange(3)) % 3, axis=1)
    _assert_same(compare(wave, other), compare(left, replace(right, faces=rng.permutation(turned))))


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.floats(0.01, 3))
def test_bounds_between_the_metrics(seed: int, size: float) -> None:
    wave = _wave()
    result = compare(wave, _noisy(wave, seed, size))
    assert result.hausdorff is not None and result.rmse <= result.max and result.hausdorff <= result.max * (1 + 1e-12)
    assert result.hausdorff == pytest.approx(compare(_noisy(wave, seed, size), wave).hausdorff, rel=1e-12)
    assert result.max == max(frame["max"] for frame in result.frames)
    assert result.rmse == pytest.approx(np.mean([frame["rmse"] for frame in result.frames]))


class _Lazy:
    """Frames that are not in memory; remembers the largest request."""

    def __init__(self, positions: NDArray[np.float32]) -> None:
        self._positions, self.shape, self.largest = positions, positions.shape, 0

    def __getitem__(self, key: slice, /) -> NDArray[np.float32]:
        block = self._positions[key]
        self.largest = max(self.largest, len(block))
        return block


@pytest.mark.parametrize(("chunk", "block"), [(1, 1), (3, 2), (4, 3), (5, 9)])
def test_chunks_bound_memory_and_change_nothing(chunk: int, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    wave = _wave(n_frames=13)
    other = _noisy(wave, 5)
    whole = compare(wave, other)
    monkeypatch.setattr(sequence, "CHUNK_BYTES", 12 * 20 * chunk)
    monkeypatch.setattr(comparison, "BLOCK_BYTES", 24 * 20 * block)
    lazy = _Lazy(other.read(0, 13))
    calls: list[tuple[int, int]] = []
    result = compare(wave, replace(other, positions=lazy), progress=lambda done, total: calls.append((done, total)))
    _assert_same(whole, result)
    assert lazy.largest <= chunk
    assert calls[-1] == (13, 13) and calls == sorted(calls)


# Real data


@pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data")
def test_half_a_lattice_step_bounds_the_errors_of_rounding() -> None:
    with np.load(DATA / "cow.npz") as file:
        cow = MeshSequence(file["vertices"][:40], file["faces"], name="cow")
    positions = cow.read(0, 40).astype(float)
    step = np.ptp(positions, axis=(0, 1)).max() / (2**10 - 1)
    result = compare(cow, _moved(cow, np.round(positions / step) * step))
    assert result.max <= step * np.sqrt(3) / 2 + 1e-6
    assert result.rmse == pytest.approx(step / 2, rel=0.01)  # three uniform errors: sqrt(3 / 12) steps
    assert result.hausdorff is not None and 0.9 * result.max < result.hausdorff <= result.max
