"""Vertices that never move: found exactly, and their flags as bytes that may be hostile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sequences import waving

import gvpipe
import gvpipe.model.sequence
from gvpipe.container.cursor import varint
from gvpipe.entropy.integers import encode_integers
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.still_vertices import decode_flags, encode_flags, find_still

NO_FACES = np.zeros((0, 3), np.int32)


def check_round_trip(flags: NDArray[np.bool_]) -> bytes:
    data = encode_flags(flags)
    found = decode_flags(data, len(flags), "still")
    assert found.dtype == bool and np.array_equal(found, flags)
    return data


@pytest.mark.parametrize("n", [0, 1, 2, 7, 5000])
def test_none_and_all(n: int) -> None:
    assert len(check_round_trip(np.zeros(n, bool))) < 10
    assert len(check_round_trip(np.ones(n, bool))) < 10


@given(st.lists(st.booleans(), max_size=70))
def test_flags_come_back(flags: list[bool]) -> None:
    check_round_trip(np.array(flags, bool))


@settings(deadline=None)
@given(st.lists(st.integers(1, 400), min_size=1, max_size=20), st.booleans())
def test_runs_cost_little(lengths: list[int], first: bool) -> None:
    flags = np.repeat((np.arange(len(lengths)) % 2 == 1) ^ first, lengths)
    assert len(check_round_trip(flags)) < 40 + 4 * len(lengths)


def stream(runs: list[int], count: int | None = None) -> bytes:
    return varint(len(runs) if count is None else count) + encode_integers(np.array(runs, np.int64))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x00",
        stream([3], 2),
        stream([3]) + b"\0",
        stream([10]),  # the last run is left out, and not empty
        stream([11]),
        stream([4, 6]),
        stream([4, 0]),
        stream([0, 0]),
        stream([-1]),
        stream([5, -2]),
        stream([1] * 11),
        stream([1 << 38]),
        stream([1 << 38] * 4),
        stream([], 1 << 60),
    ],
)
def test_runs_that_do_not_fit(data: bytes) -> None:
    with pytest.raises(CorruptFile, match="section 'still'"):
        decode_flags(data, 10, "still")


def test_changed_bytes_and_prefixes() -> None:
    """Flags, or one line of CorruptFile."""
    draw = np.random.default_rng(0)
    data = encode_flags(draw.random(200) < 0.3)
    for cut in range(len(data)):
        with pytest.raises(CorruptFile):
            decode_flags(data[:cut], 200, "still")
    for _ in range(400):
        changed = bytearray(data)
        changed[draw.integers(len(data))] = draw.integers(256)
        try:
            assert decode_flags(bytes(changed), 200, "still").shape == (200,)
        except CorruptFile as exc:
            assert "\n" not in str(exc)


@given(st.binary(max_size=40), st.integers(0, 50))
def test_garbage(data: bytes, n: int) -> None:
    try:
        assert decode_flags(data, n, "still").shape == (n,)
    except CorruptFile as exc:
        assert "'still'" in str(exc)


# which vertices they are


@pytest.mark.parametrize("frames_of_a_chunk", [100, 1, 2])
def test_still_vertices_have_one_position(frames_of_a_chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gvpipe.model.sequence, "CHUNK_BYTES", 12 * 30 * frames_of_a_chunk)
    draw = np.random.default_rng(2)
    frames = np.repeat(draw.random((1, 30, 3)).astype(np.float32), 7, axis=0)
    frames[draw.integers(1, 7, 9), np.arange(9), draw.integers(0, 3, 9)] += np.float32(1e-6)  # once, and back
    still = find_still(MeshSequence(frames, NO_FACES))
    assert still.tolist() == [False] * 9 + [True] * 21
    for flags, part in ((still, frames[:, 9:]), (~still, frames[:, :9])):
        assert (find_still(MeshSequence(part, NO_FACES)) == (flags is still)).all()


def test_of_one_frame_nothing_is_still() -> None:
    assert not find_still(MeshSequence(np.ones((1, 4, 3), np.float32), NO_FACES)).any()
    assert find_still(MeshSequence(np.ones((2, 4, 3), np.float32), NO_FACES)).all()


def test_find_still_stops_where_everything_has_moved() -> None:
    class Lazy:
        shape = (50, 200_000, 3)
        read = 0

        def __getitem__(self, key: slice, /) -> np.ndarray:
            Lazy.read = max(Lazy.read, key.stop)
            times = np.arange(key.start, key.stop, dtype=np.float32)[:, None, None]
            return np.broadcast_to(times, (len(times), *self.shape[1:]))

    assert not find_still(MeshSequence(Lazy(), np.zeros((0, 3), np.int32))).any()
    assert Lazy.read < 50
    assert not find_still(waving(3, 1)).any()


def test_flags_of_any_kind_come_back() -> None:
    rng = np.random.default_rng(2)
    for flags in (np.ones(5, bool), np.zeros(5, bool), rng.random(300) < 0.5, np.repeat([True, False, True], 400)):
        assert np.array_equal(decode_flags(encode_flags(flags), len(flags), "still"), flags)
    assert len(encode_flags(np.repeat([True, False, True], 40_000))) < 60


@pytest.mark.parametrize("lengths", [[3, -1, 3], [2, 0, 3], [4, 2], [1] * 9, [1 << 38, 5]])
def test_wrong_flags_are_refused(lengths: list[int]) -> None:
    from gvpipe.container.cursor import varint
    from gvpipe.entropy.integers import encode_integers

    with pytest.raises(CorruptFile, match="still"):
        decode_flags(varint(len(lengths)) + encode_integers(np.array(lengths)), 5, "still")
