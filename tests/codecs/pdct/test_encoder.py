"""The parts of ``pdct``: local frames, clustering, coding of seeds and deltas, clips, streaming."""

from __future__ import annotations

import runpy
import tracemalloc

import numpy as np
import pytest
from folders import SAMPLES
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import awkward, grid, waving

from gvcodecs.pdct import Pdct, StreamEncoder, StreamReader
from gvcodecs.pdct.clustering import cluster, find_seeds
from gvcodecs.pdct.delta_coding import DeltaDecoder, DeltaEncoder, Layout
from gvcodecs.pdct.labels import decode_labels, encode_labels
from gvcodecs.pdct.local_frames import local_frames
from gvcodecs.pdct.seed_coding import decode_seeds, encode_seeds
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor
from gvpipe.errors import CorruptFile, FormatError, GvpipeError, InputError, NotGeometryVideo, TruncatedFile
from gvpipe.sequence import MeshSequence
from gvpipe.trajectory.welding import find_points


def decode(bitstream: Bitstream) -> np.ndarray:
    return Pdct.reader(bitstream).read(0, bitstream.n_frames)


def error(sequence: MeshSequence, decoded: np.ndarray) -> float:
    return float(np.sqrt(((sequence.read(0, sequence.n_frames) - decoded) ** 2).sum(axis=2).mean()))


@given(st.lists(st.integers(-50, 50), min_size=9, max_size=9))
def test_every_triple_has_an_orthonormal_frame(coordinates: list[int]) -> None:
    points = np.array(coordinates).reshape(3, 3)
    origin, axes = local_frames(points)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.isclose(np.linalg.det(axes), 1)
    assert np.allclose(origin, points[:2].mean(axis=0))
    edge, normal = points[1] - points[0], np.cross(points[1] - points[0], points[2] - points[0])
    if edge.any():
        assert np.allclose(axes[0] * np.linalg.norm(edge), edge)
    if normal.any():
        assert np.allclose(axes[2] * np.linalg.norm(normal), normal)


def two_plates() -> MeshSequence:
    """Two sheets, apart, each turning about an axis of its own."""
    points, faces = grid(8)
    t = np.linspace(0, 1, 9)[:, None]
    x, y = points[:, 0], points[:, 1]
    one = np.stack([x * np.cos(t), y + 0 * t, x * np.sin(t)], axis=2)
    two = np.stack([3 + x + 0 * t, y * np.cos(2 * t), -y * np.sin(2 * t)], axis=2)
    return MeshSequence(np.concatenate([one, two], axis=1).astype(np.float32), np.concatenate([faces, faces + 64]))


def test_rigid_parts_are_found() -> None:
    sequence = two_plates()
    frames = sequence.read(0, 9).astype(float)
    seeds = find_seeds(frames, sequence.faces, 2)
    labels = cluster(frames, seeds)
    assert len(seeds) == 2
    assert len(np.unique(labels[:64])) == len(np.unique(labels[64:])) == 1
    assert labels[0] != labels[-1]


def test_seeds_avoid_degenerate_triangles() -> None:
    points, faces = grid(6)
    thin = np.concatenate([np.repeat(faces[:, :1], 3, axis=1), faces])
    seeds = find_seeds(points[None], thin.astype(np.int32), 12)
    edges = points[seeds[:, 1:]] - points[seeds[:, :1]]
    assert (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 1e-3).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_seeds_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = rng.integers(-100, 70_000, (3, 3, 3))
    points = base + rng.integers(-300, 300, (7, 3, 3, 3)).cumsum(axis=0)
    assert np.array_equal(decode_seeds(Cursor(encode_seeds(points, base), "x"), 7, base, "x"), points)


@given(st.lists(st.integers(0, 4), min_size=1, max_size=60))
def test_labels_come_back(values: list[int]) -> None:
    labels = np.array(values)
    assert np.array_equal(decode_labels(Cursor(encode_labels(labels, 5), "x"), len(labels), 5, "x"), labels)


@pytest.mark.parametrize("scale", [0.3, 3.0, 1e3, 1e9])
def test_deltas_come_back(scale: float) -> None:
    rng = np.random.default_rng(8)
    layout = Layout(np.repeat([0, 1], [8, 90]), np.arange(98) % 16)
    frames = np.rint(rng.laplace(0, scale, (6, 3, 98))).astype(np.int64)
    coder = DeltaEncoder(layout)
    for values in frames:
        contexts = np.stack([coder.contexts.of(axis, values) for axis in range(3)])
        for axis in range(3):
            coder.add_axis(contexts[axis], values[axis])
        coder.contexts.learn(contexts, values)
    decoder = DeltaDecoder(Cursor(coder.finish(), "x"), layout)
    for values in frames:
        found, contexts = np.zeros_like(values), np.zeros_like(values)
        for axis in range(3):
            contexts[axis] = decoder.contexts.of(axis, found)
            found[axis] = decoder.take_axis(contexts[axis])
        decoder.contexts.learn(contexts, found)
        assert np.array_equal(found, values)
    decoder.finish()


def test_errors_do_not_grow_within_a_clip() -> None:
    sequence = waving(14, 120)
    decoded = decode(Pdct(segment=120).encode(sequence).bitstream)
    per_frame = np.sqrt(((sequence.read(0, 120) - decoded) ** 2).sum(axis=2).mean(axis=1))
    assert per_frame[80:].max() < 1.5 * per_frame[:40].max()


def test_rigid_motion_costs_next_to_nothing() -> None:
    sequence = two_plates()
    more, fewer = (sum(map(len, Pdct(clusters=k).encode(sequence).bitstream.sections.values())) for k in (1, 2))
    assert fewer < 0.9 * more


def test_fewer_kept_coefficients_cost_less_and_lose_more() -> None:
    sequence = waving(20, 20)
    coded = [Pdct(kept=kept, clusters=4).encode(sequence).bitstream for kept in (0.02, 0.1, 0.4, 1.0)]
    sizes = [len(b.sections["clip.0"]) for b in coded]
    errors = [error(sequence, decode(b)) for b in coded]
    assert sizes == sorted(sizes)
    assert errors == sorted(errors, reverse=True)


def test_the_seed_triangles_keep_their_precision() -> None:
    """At the coarsest quality, some vertices (the seeds) are still within half a step of 16 bits."""
    sequence = waving()
    decoded = decode(Pdct(quality=0).encode(sequence).bitstream)
    extent = np.ptp(sequence.read(0, 40), axis=(0, 1)).max()
    worst = np.abs(sequence.read(0, 40) - decoded).max(axis=(0, 2))
    assert (worst < 0.51 * extent / 65535 + 1e-6).sum() >= 3 * 15


def stream(sequence: MeshSequence, **chosen: object) -> bytes:
    encoder = StreamEncoder(sequence.faces, Pdct(**chosen), sequence.fps)  # type: ignore[arg-type]
    return b"".join(encoder.add(frame) for frame in sequence.read(0, sequence.n_frames)) + encoder.finish()


@pytest.mark.parametrize("packet", [1, 700, 1 << 20])
def test_a_stream_gives_its_frames_whatever_the_packets(packet: int) -> None:
    sequence = waving(8, 20)
    data = stream(sequence, segment=5)
    whole, reader = StreamReader(), StreamReader()
    frames = [frame for at in range(0, len(data), packet) for frame in reader.feed(data[at : at + packet])]
    reader.close()
    assert np.array_equal(np.stack(frames), np.stack(list(whole.feed(data))))
    diagonal = np.linalg.norm(np.ptp(sequence.read(0, 1)[0], axis=0))
    assert error(sequence, np.stack(frames)) < 1e-3 * diagonal
    assert reader.faces is not None
    assert len(reader.faces) == len(sequence.faces)
    assert reader.fps == sequence.fps


def test_a_stream_aims_at_about_the_error_of_a_file() -> None:
    sequence = waving(14, 24)
    for quality in (50, 75):
        frames = np.stack(list(StreamReader().feed(stream(sequence, segment=12, quality=quality))))
        assert 0.5 < error(sequence, frames) / error(sequence, decode(Pdct(quality=quality).encode(sequence).bitstream)) < 2


def soup(sequence: MeshSequence) -> MeshSequence:
    """Every triangle with vertices of its own, and a moving vertex that no triangle uses."""
    frames = sequence.read(0, sequence.n_frames)
    corners = np.concatenate([frames[:, sequence.faces.ravel()], frames[:, :1] + np.float32(0.5)], axis=1)
    return MeshSequence(corners, np.arange(sequence.faces.size).reshape(-1, 3).astype(np.int32), sequence.fps)


@pytest.mark.parametrize("reorder", [False, True])
def test_vertices_of_one_trajectory_are_one_point(reorder: bool) -> None:
    one = waving(14, 16)
    sequence = soup(one)
    encoded = Pdct(reorder=reorder).encode(sequence)
    bitstream, own = encoded.bitstream, sequence.reordered(encoded.permutation, sequence.faces)
    decoded, points = decode(bitstream), find_points(own)
    assert points.max() + 1 == one.n_vertices + 1
    members = np.unique(points, return_index=True)[1]
    assert np.array_equal(decoded, decoded[:, members[points]])
    welded = Pdct(reorder=reorder).encode(one).bitstream
    assert len(bitstream.section("clip.0")) < 1.1 * len(welded.section("clip.0"))


def test_frames_come_as_soon_as_their_clip() -> None:
    sequence = waving(8, 23)
    encoder, reader = StreamEncoder(sequence.faces, Pdct(segment=10), 24.0), StreamReader()
    arrived = [len(list(reader.feed(encoder.add(frame)))) for frame in sequence.read(0, 23)]
    assert [k for k, n in enumerate(arrived) if n] == [9, 19]
    assert len(list(reader.feed(encoder.finish()))) == 3
    reader.close()


def test_streaming_memory_is_that_of_a_clip() -> None:
    """Four times as many frames need no more memory."""
    sequence = waving(30, 8)
    frames = sequence.read(0, 8)

    def peak(n_clips: int) -> int:
        encoder, reader = StreamEncoder(sequence.faces, Pdct(segment=8), 24.0), StreamReader()
        tracemalloc.start()
        for _ in range(n_clips):
            for frame in frames:
                for _ in reader.feed(encoder.add(frame)):
                    pass
        result = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return result

    peak(1)
    assert peak(8) < 1.2 * peak(2)


def test_broken_streams_have_their_errors() -> None:
    data = stream(waving(8, 12), segment=6)
    with pytest.raises(NotGeometryVideo):
        list(StreamReader().feed(b"GVPDCT\r\n" + data[8:]))
    with pytest.raises(CorruptFile):
        list(StreamReader().feed(data + b"\0"))
    for cut in (0, 5, 40, 200, len(data) - 1):
        reader = StreamReader()
        with pytest.raises(TruncatedFile):
            list(reader.feed(data[:cut]))
            reader.close()
    rng = np.random.default_rng(4)
    for _ in range(60):
        changed = bytearray(data)
        changed[rng.integers(8, len(data))] ^= 1 << rng.integers(8)
        reader = StreamReader()
        try:
            list(reader.feed(bytes(changed)))
            reader.close()
        except FormatError:
            continue


def test_a_stream_refuses_wrong_frames() -> None:
    sequence = waving(8, 3)
    encoder = StreamEncoder(sequence.faces)
    with pytest.raises(InputError, match="at least one"):
        encoder.finish()
    encoder.add(sequence.read(0, 1)[0])
    for wrong in (np.zeros((5, 3)), np.zeros((64, 2)), np.full((64, 3), np.nan)):
        with pytest.raises(InputError, match="frame 1"):
            encoder.add(wrong)
    encoder.finish()
    with pytest.raises(InputError, match="finished"):
        encoder.add(sequence.read(1, 2)[0])


@pytest.mark.parametrize("name", awkward())
def test_awkward_sequences_stream(name: str) -> None:
    sequence = awkward()[name]
    data = stream(sequence, segment=4, reorder=True)
    reader = StreamReader()
    assert len(list(reader.feed(data))) == sequence.n_frames
    reader.close()


def test_the_sample_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = SAMPLES / "stream.py"
    monkeypatch.setattr("sys.argv", ["stream.py", str(script.with_name("cloth.npz")), "40"])
    runpy.run_path(str(script), run_name="__main__")
    assert "110 frames" in capsys.readouterr().out


def test_hostile_clips_raise_package_errors() -> None:
    sequence = waving(8, 12)
    bitstream = Pdct().encode(sequence).bitstream
    clip = bitstream.sections["clip.0"]
    rng = np.random.default_rng(2)
    for _ in range(200):
        changed = bytearray(clip)
        changed[int(rng.integers(len(clip)) ** rng.choice([1.0, 0.7]))] = rng.integers(256)
        sections = {**bitstream.sections, "clip.0": bytes(changed)}
        try:
            decoded = decode(Bitstream("pdct", 2, 12, 64, 98, 24.0, bitstream.header, sections))
        except GvpipeError as caught:
            assert isinstance(caught, CorruptFile)
            continue
        assert np.isfinite(decoded).all()


def test_clip_names_the_frames_per_clip() -> None:
    sequence = waving(6, 20)
    assert Pdct(clip=8).encode(sequence).bitstream.sections == Pdct(segment=8).encode(sequence).bitstream.sections


def test_a_frame_costs_one_clip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sections of other clips are not looked at."""
    bitstream = Pdct(clip=8).encode(waving(6, 20)).bitstream
    wanted: list[str] = []
    plain = Bitstream.section
    monkeypatch.setattr(Bitstream, "section", lambda self, name: (wanted.append(name), plain(self, name))[1])
    assert Pdct.reader(bitstream).read(9, 12).shape == (3, 36, 3)
    assert [name for name in wanted if name.startswith("clip.")] == ["clip.1"]
