"""Streams: frames arrive with their clip, memory is that of a clip, and broken streams have their errors."""

from __future__ import annotations

import runpy
import struct
import tracemalloc

import numpy as np
import pytest
from clips import coded_stream, decode, error
from folders import SAMPLES
from sequences import awkward, waving

from gvcodecs.pdct import Pdct, StreamEncoder, StreamReader
from gvcodecs.pdct.stream import CLIP, HEAD, MAGIC
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, NotGeometryVideo, OverBudget, TruncatedFile


@pytest.mark.parametrize("packet", [1, 700, 1 << 20])
def test_a_stream_gives_its_frames_whatever_the_packets(packet: int) -> None:
    sequence = waving(8, 20)
    data = coded_stream(sequence, segment=5)
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
        frames = np.stack(list(StreamReader().feed(coded_stream(sequence, segment=12, quality=quality))))
        assert 0.5 < error(sequence, frames) / error(sequence, decode(Pdct(quality=quality).encode(sequence).bitstream)) < 2


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
    data = coded_stream(waving(8, 12), segment=6)
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
    data = coded_stream(sequence, segment=4, reorder=True)
    reader = StreamReader()
    assert len(list(reader.feed(data))) == sequence.n_frames
    reader.close()


def test_the_sample_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    script = SAMPLES / "stream.py"
    monkeypatch.setattr("sys.argv", ["stream.py", str(script.with_name("cloth.npz")), "40"])
    runpy.run_path(str(script), run_name="__main__")
    assert "110 frames" in capsys.readouterr().out


def test_small_streams_that_ask_for_a_lot_are_refused() -> None:
    data = bytearray(coded_stream(waving(6, 8), segment=8))
    *counts, _ = HEAD.unpack_from(data, len(MAGIC))
    at = len(MAGIC) + HEAD.size + counts[3] + counts[4]
    _, checksum, size = CLIP.unpack_from(data, at)
    long = data.copy()
    CLIP.pack_into(long, at, 100_000, checksum, size)
    with pytest.raises(OverBudget, match="100000 frames of 36 points"):
        list(StreamReader().feed(bytes(long)))
    struct.pack_into("<I", data, len(MAGIC) + 2, 1 << 27)
    with pytest.raises(OverBudget, match="134217728 vertices"):
        list(StreamReader().feed(bytes(data)))
    with pytest.raises(CorruptFile):  # its mesh was decoded
        list(StreamReader(unlimited=True).feed(bytes(data)))
