"""Fields come back within their bound, in every mode, type and shape; any frames come back alone."""

from __future__ import annotations

import numpy as np
import pytest
from folders import DATA
from hypothesis import given, settings
from hypothesis import strategies as st
from waves import EXACT, MESH, SHEET, SHEET_FACES, decode, encode, wave

from gvpipe.fields import head
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.segment import MODES as ALL_MODES
from gvpipe.fields.values import FieldBound, to_integers
from gvpipe.foundation.errors import InputError

MODES = [mode for mode in ALL_MODES if mode != "derived"]  # without positions
FIELDS = sorted((DATA / "fields").glob("*.npz"))


@pytest.mark.parametrize("n_components", [1, 2, 3, 4])
@pytest.mark.parametrize("mode", MODES)
def test_each_mode_keeps_the_bound(mode: str, n_components: int) -> None:
    values = wave(n_components=n_components)
    section = encode(values, FieldBound(0.02), modes=(mode,))
    back = decode(section, values)
    assert FieldReader(section, len(values), MESH, "field").modes == [mode]
    assert back.dtype == np.float32
    assert back.shape == values.shape
    assert np.abs(back.astype(np.float64) - values).max() <= 0.02
    assert (np.array_equal(back, values)) == (mode == "exact")
    assert len(section) < values.nbytes / (1 if mode == "exact" else 4)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 9),
    st.integers(1, 3),
    st.floats(1e-6, 10),
    st.sampled_from([1e-3, 1.0, 1e6]),
    st.integers(0, 99),
    st.sampled_from(MODES),
)
def test_any_values_keep_any_bound(n_frames: int, n_components: int, bound: float, scale: float, seed: int, mode: str) -> None:
    rng = np.random.default_rng(seed)
    values = (scale * rng.standard_t(2, (n_frames, len(SHEET), n_components))).astype(np.float32)
    values[:, seed % 7 :: 5] = values[0, 0, 0]
    back = decode(encode(values, FieldBound(bound), modes=(mode,)), values)
    assert np.abs(back.astype(np.float64) - values).max() <= bound


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", ">i2", "?", "i8", "f4", "f8", "f2"])
def test_exact_types(dtype: str) -> None:
    values = np.random.default_rng(3).integers(0, 2, (3, len(SHEET), 2)).astype(dtype)
    back = decode(encode(values, EXACT), values)
    assert np.array_equal(back, values)
    assert back.dtype == {"?": np.uint8, "i8": np.int32, "f8": np.float32, "f2": np.float32, ">i2": np.int16}.get(
        dtype, np.dtype(dtype)
    )


@pytest.mark.parametrize("dtype", [np.int32, np.uint32, np.int8])
def test_exact_extremes_of_integers(dtype: type[np.integer]) -> None:
    limits = np.iinfo(dtype)
    values = np.random.default_rng(4).choice([limits.min, limits.max, 0, 1], (5, len(SHEET), 1)).astype(dtype)
    assert np.array_equal(decode(encode(values, EXACT), values), values)


def test_exact_floats_bit_for_bit() -> None:
    bits = np.random.default_rng(5).integers(0, 1 << 32, (4, len(SHEET), 2), np.uint32)
    values = bits.view(np.float32).copy()
    values[~np.isfinite(values)] = -0.0
    values[1, :, 0] = 0.0
    back = decode(encode(values, EXACT), values)
    assert np.array_equal(back.view(np.uint32), values.view(np.uint32))


@pytest.mark.parametrize("largest", [0.4, 1.0, 7.0])
def test_integers_within_a_bound(largest: float) -> None:
    values = np.rint(100 * wave()).astype(np.int16)
    back = decode(encode(values, FieldBound(largest)), values)
    assert back.dtype == np.int16
    assert np.abs(back.astype(int) - values).max() <= largest


@given(st.lists(st.floats(width=32, allow_nan=False, allow_infinity=False), min_size=2))
def test_integers_are_in_the_order_of_floats(numbers: list[float]) -> None:
    values = np.array(numbers, np.float32)
    integers = to_integers(values)
    less = values[:-1] < values[1:]
    assert np.array_equal(less, (integers[:-1] < integers[1:]) & (values[:-1] != values[1:]))


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 81, 1), (7, 1, 3), (2, 1, 1), (3, 0, 2)])
def test_small_shapes(shape: tuple[int, int, int]) -> None:
    faces = SHEET_FACES if shape[1] == 81 else np.zeros((0, 3), np.int32)
    mesh = FieldMesh(faces, shape[1])
    values = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    for bound in (FieldBound(0.1), EXACT):
        back = decode(encode(values, bound, mesh), values, mesh)
        assert back.shape == shape
        assert np.abs(back - values).max(initial=0) <= bound.largest


def test_triangles_are_rows() -> None:
    mesh = FieldMesh(SHEET_FACES, len(SHEET), "triangle")
    values = wave(mesh=mesh)
    section = encode(values, FieldBound(0.02), mesh)
    assert np.abs(decode(section, values, mesh) - values).max() <= 0.02
    shuffled = values[:, np.random.default_rng(0).permutation(mesh.n_rows)]
    assert len(section) < 0.9 * len(encode(shuffled, FieldBound(0.02), mesh))


def test_random_access_equals_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(head, "FRAMES", 7)
    values = wave(n_frames=23, n_components=2)
    section = encode(values, FieldBound(0.02))
    whole = decode(section, values)
    reader = FieldReader(section, 23, MESH, "field")
    assert reader.shape == (23, len(SHEET), 2)
    for start, stop in [(0, 1), (22, 23), (5, 9), (3, 3), (0, 23), (6, 7)]:
        assert np.array_equal(reader.read(start, stop), whole[start:stop])
    with pytest.raises(InputError, match="frames 20 to 24"):
        reader.read(20, 24)


def test_each_segment_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(head, "FRAMES", 8)
    values, asked = wave(n_frames=20), []
    done: list[float] = []

    def read(start: int, stop: int) -> np.ndarray:
        asked.append((start, stop))
        return values[start:stop]

    encode_field(read, 20, MESH, FieldBound(0.02), progress=done.append)
    assert asked == [(0, 1), (0, 6), (6, 13), (13, 20)]
    assert done == [0.3, 0.65, 1.0]


def test_what_does_not_change_costs_nearly_nothing() -> None:
    values = wave(n_frames=40, n_components=3)
    constant = np.full_like(values, 7.5)
    assert len(encode(constant, FieldBound(0.01))) < 60
    still = np.repeat(values[:1], 40, axis=0)
    assert len(encode(still, FieldBound(0.02))) < len(encode(values[:1], FieldBound(0.02))) + 40
    held = np.repeat(values[:10], 4, axis=0)
    assert len(encode(held, FieldBound(0.02))) < len(encode(values[:10], FieldBound(0.02))) + 40
    partly = values.copy()
    partly[:, 40:] = values[0, 40:]
    moving = len(encode(values, FieldBound(0.02)))
    assert len(encode(partly, FieldBound(0.02))) < 0.75 * moving
    one_moves = still.copy()
    one_moves[:, :, 1] = values[:, :, 1]
    assert np.abs(decode(encode(one_moves, FieldBound(0.02)), values) - one_moves).max() <= 0.02


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused(value: float) -> None:
    values = wave()
    values[3, 5, 0] = value
    with pytest.raises(InputError, match="frame 3, row 5, component 0"):
        encode(values, FieldBound(0.1))


def test_bad_input_is_refused() -> None:
    values = wave()
    with pytest.raises(InputError, match="one row per vertex"):
        encode(values[:, 1:], FieldBound(0.1))
    with pytest.raises(InputError, match="complex128"):
        encode(values.astype(complex), FieldBound(0.1))
    with pytest.raises(InputError, match="no frames"):
        encode(values[:0], FieldBound(0.1))
    with pytest.raises(InputError, match="0 components"):
        encode(values[:, :, :0], FieldBound(0.1))
    for largest in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="above 0, or exact"):
            FieldBound(largest)


def test_a_bound_below_float32_is_kept_exactly() -> None:
    values = 1e6 + wave()
    back = decode(encode(values, FieldBound(1e-4)), values)
    assert np.array_equal(back, values)


@pytest.mark.slow
@pytest.mark.skipif(not FIELDS, reason="no ../shared/data/fields")
@pytest.mark.parametrize("path", FIELDS, ids=lambda path: path.stem)
def test_real_fields(path: object) -> None:
    with np.load(str(path)) as data:
        mesh = FieldMesh(data["faces"], data["vertices"].shape[1])
        for name in (key for key in data.files if key.startswith("field_")):
            values = data[name].reshape(*data[name].shape[:2], -1)[:25]
            bound = 1e-3 * float(np.ptp(values))
            section = encode(values, FieldBound(bound), mesh)
            assert np.abs(decode(section, values, mesh).astype(np.float64) - values).max() <= bound
            assert 8 * len(section) / values.size < 4
