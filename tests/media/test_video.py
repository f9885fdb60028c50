"""Planes through each video profile: bounds, exact repetition, random access, neutral chroma, and data that are not ours."""

from __future__ import annotations

import io
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.media.film import hold_picture
from gvpipe.media.video import PROFILES, Profile, VideoReader, VideoWriter

H264 = [PROFILES["h264-8"], PROFILES["h264-10"]]
ALL = list(PROFILES.values())
WIDTH, HEIGHT = 48, 80

Planes = Sequence[NDArray[Any]]


def moving(profile: Profile, n: int, width: int = WIDTH, height: int = HEIGHT) -> list[NDArray[Any]]:
    """Smooth waves that move, over all levels that carry data, plus a little noise."""
    y, x = np.indices((height, width))
    random = np.random.default_rng(11)
    waves = [np.sin(x / 7 + f / 5) * np.cos(y / 9 - f / 8) + random.normal(0, 0.02, x.shape) for f in range(n)]
    levels = [np.rint(profile.middle + wave * profile.amplitude) for wave in waves]
    return [np.clip(level, profile.low, profile.high).astype(profile.dtype) for level in levels]


def noise(profile: Profile, n: int, width: int = WIDTH, height: int = HEIGHT) -> list[NDArray[Any]]:
    random = np.random.default_rng(12)
    return list(random.integers(profile.low, profile.high + 1, (n, height, width)).astype(profile.dtype))


def code(
    profile: Profile, planes: Planes, quality: int = 20, gop: int = 5, fps: float = 25.0, preset: str = "veryfast"
) -> bytes:
    height, width = planes[0].shape
    with VideoWriter(profile, width, height, fps, quality, gop, preset) as writer:
        for plane in planes:
            writer.add(plane)
        return writer.finish()


def open_video(data: bytes, profile: Profile, width: int = WIDTH, height: int = HEIGHT) -> VideoReader:
    return VideoReader(data, profile, width, height)


def read(reader: VideoReader, start: int = 0, stop: int | None = None) -> NDArray[Any]:
    blocks = list(reader.read(start, reader.n_frames if stop is None else stop))
    position = start
    for first, planes in blocks:
        assert first == position and planes
        position += len(planes)
    width = reader.shape[1]
    return reader.profile.clip(np.array([plane[:, :width] for _, planes in blocks for plane in planes]))


@pytest.mark.parametrize("profile", H264, ids=lambda p: p.name)
@pytest.mark.parametrize("qp", [1, 10, 22, 34, 51])
def test_h264_error(profile: Profile, qp: int) -> None:
    """The error follows the quantiser's step, 0.625 * 2^(QP/6) levels, in both directions.

    With steps D a uniform quantiser errs by D / sqrt(12) = 0.29 D in the mean square; dead zones, rate-distortion choices
    and the coarser QP of B-frames (+2 to +4) err more. Measured with x264 (PyAV 18.1) on these planes: at most 0.65 D in
    the mean square and 2.9 D at one sample; 0.75 D and 3.5 D + 1 leave a margin. On noise it is never below 0.25 D.
    """
    qp += 12 * (profile.depth == 10) * (qp == 51)
    step = 0.625 * 2 ** (qp / 6)
    for name, planes in (("noise", noise(profile, 7)), ("moving", moving(profile, 7))):
        data = code(profile, planes, qp)
        back = read(open_video(data, profile))
        error = back.astype(float) - planes
        rms = np.sqrt((error**2).mean(axis=(1, 2)))
        assert rms.max() <= 0.75 * step and np.abs(error).max() <= 3.5 * step + 1
        assert step * 0.25 <= rms.max() or name == "moving"
        assert back.dtype == profile.dtype and back.min() >= profile.low and back.max() <= profile.high
        assert code(profile, planes, qp) == data


def test_no_byte_tells_the_coders_options() -> None:
    for data in (
        code(PROFILES["h264-8"], moving(PROFILES["h264-8"], 7)),
        hold_picture(np.full((16, 16), 99, np.uint8), 25, 9, 30),
    ):
        assert b"x264" not in data and b"options" not in data


def test_without_x264(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As with an FFmpeg without the GPL: everything is read, and all but H.264 is written."""
    profile = PROFILES["h264-8"]
    video = code(profile, moving(profile, 7))
    planes = read(open_video(video, profile))
    monkeypatch.setattr(av.codec, "codecs_available", av.codec.codecs_available - {"libx264", "libx264rgb"})
    np.testing.assert_array_equal(read(open_video(video, profile)), planes)
    gvpipe.encode(waving(4, 5), tmp_path / "a.mp4", codec="pca")
    assert gvpipe.decode(tmp_path / "a.mp4").shape == (5, 16, 3)
    gvpipe.encode(waving(4, 5), tmp_path / "a.mp4", image="jpeg", prediction="affine", clusters=2)
    with av.open(tmp_path / "a.mp4") as container:
        assert container.streams.video[0].codec_context.name == "mjpeg"
    for write in (
        lambda: gvpipe.encode(waving(4, 5), tmp_path / "b.mp4", prediction="affine", clusters=2),
        lambda: gvpipe.render(waving(4, 5), tmp_path / "b.mp4"),
    ):
        with pytest.raises(InputError, match="no libx264, which writes H.264; --set image=jpeg needs none"):
            write()
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    with av.open(io.BytesIO(hold_picture(np.full((16, 16), 99, np.uint8), 25, 50, 30)), "r") as container:
        assert float(container.duration or 0) / av.time_base == pytest.approx(2)


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
def test_still_planes_stay(profile: Profile) -> None:
    """The middle level, a zero residual, comes back exactly, or where H.264's step is coarse, within an eighth of it."""
    planes = [np.full((HEIGHT, WIDTH), profile.middle, profile.dtype)] * 6
    for quality in (1, 12, 22, 34, 51):
        error = read(open_video(code(profile, planes, quality), profile)).astype(float) - profile.middle
        exact = profile.codec == "mjpeg" or quality <= 22
        assert np.abs(error).max() <= (0 if exact else 0.625 * 2 ** (quality / 6) / 8)


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
def test_extremes_stay_in_range(profile: Profile) -> None:
    """Hard edges ring at coarse quantisers; what is read never leaves the range, since browsers clip there."""
    plane = np.full((HEIGHT, WIDTH), profile.low, profile.dtype)
    plane[::7, :] = plane[:, ::5] = profile.high
    back = read(open_video(code(profile, [plane, plane.T.copy().reshape(plane.shape)] * 2, 38), profile))
    assert back.min() >= profile.low and back.max() <= profile.high


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
@pytest.mark.parametrize("gop", [1, 2, 7, 32])
def test_counts_and_random_access(profile: Profile, gop: int) -> None:
    """Whatever the number of frames: as many come back, groups start every ``gop`` frames, and any window equals the whole."""
    for n in sorted({1, 2, gop, gop + 1, 2 * gop - 1, 2 * gop + 1}):
        data = code(profile, moving(profile, n, 32, 32), 24, gop)
        reader = open_video(data, profile, 32, 32)
        whole = read(reader)
        assert reader.n_frames == len(whole) == n
        spacing = 1 if profile.codec == "mjpeg" else gop
        with av.open(io.BytesIO(data), "r") as container:
            keys = [i for i, packet in enumerate(p for p in container.demux(video=0) if p.size) if packet.is_keyframe]
        assert keys == list(range(0, n, spacing))
        random = np.random.default_rng(n)
        for start in random.permutation(n)[:9].tolist():
            stop = int(random.integers(start + 1, n + 1))
            assert np.array_equal(read(reader, start, stop), whole[start:stop])
        fresh = open_video(data, profile, 32, 32)
        assert np.array_equal(read(fresh, n - 1, n)[0], whole[n - 1]) and read(fresh, 0, 0).size == 0


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
def test_frames_need_their_group_alone(profile: Profile) -> None:
    """With the last quarter of every sample of the other groups wiped out, a group still decodes to the same planes."""
    n, gop = 23, 5
    data = code(profile, moving(profile, n), 24, gop)
    whole = read(open_video(data, profile))
    with av.open(io.BytesIO(data), "r") as container:
        places = [(packet.pos, packet.size) for packet in container.demux(video=0) if packet.pos is not None and packet.size]
    spacing = 1 if profile.codec == "mjpeg" else gop
    for kept in range(0, n, spacing):
        wiped = bytearray(data)
        for i, (position, size) in enumerate(places):
            if not kept <= i < kept + spacing:
                wiped[position + 3 * size // 4 : position + size] = bytes(size - 3 * size // 4)
        reader = open_video(bytes(wiped), profile)
        with pytest.raises((CorruptFile, AssertionError)):
            np.testing.assert_array_equal(read(reader), whole)
        assert np.array_equal(read(reader, kept, min(kept + spacing, n)), whole[kept : kept + spacing])


@pytest.mark.parametrize("preset", ["ultrafast", "slow", "veryslow"])
@pytest.mark.parametrize("profile", H264, ids=lambda p: p.name)
def test_an_ordinary_video(profile: Profile, preset: str) -> None:
    """What ffprobe tells: H.264 High (10), 4:2:0, limited range, BT.709; chroma is neutral, luma as we read it."""
    data = code(profile, moving(profile, 9), 20, 4, 24000 / 1001, preset)
    ours = read(open_video(data, profile))
    with av.open(io.BytesIO(data), "r") as container:
        assert len(container.streams) == 1
        stream = container.streams.video[0]
        context = stream.codec_context
        assert (context.name, context.pix_fmt, context.width, context.height) == ("h264", profile.pixel_format, WIDTH, HEIGHT)
        assert context.profile == ("High" if profile.depth == 8 else "High 10")
        assert (int(context.color_range), int(context.colorspace)) == (1, 1)
        assert stream.frames == 9 and stream.average_rate == Fraction(24000, 1001)
        pictures = list(container.decode(stream))
    assert len(pictures) == 9 and [float(p.time) for p in pictures] == pytest.approx(
        [i * 1001 / 24000 for i in range(9)], abs=1e-4
    )
    for picture, plane in zip(pictures, ours, strict=True):
        planes = picture.to_ndarray()
        assert np.array_equal(np.clip(planes[:HEIGHT], profile.low, profile.high), plane)
        assert (planes[HEIGHT:] == 1 << (profile.depth - 1)).all()


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
@pytest.mark.parametrize("fps", [0.01, 1, 23.976, 29.97, 60, 1000, 100_000])
def test_frame_rates(profile: Profile, fps: float) -> None:
    """Any rate that a sequence may have writes a track that opens and has all frames, at about that rate."""
    planes = moving(profile, 5, 32, 32)
    data = code(profile, planes, 20, 2, fps)
    assert len(read(open_video(data, profile, 32, 32))) == 5
    with av.open(io.BytesIO(data), "r") as container:
        stream = container.streams.video[0]
        assert stream.frames == 5 and stream.duration is not None and stream.time_base is not None
        assert float(stream.duration * stream.time_base) == pytest.approx(5 / fps, rel=0.01)


def test_wrong_planes_are_refused() -> None:
    profile = PROFILES["h264-8"]
    with VideoWriter(profile, 32, 32, 25, 20) as writer:
        for plane in (np.zeros((32, 30), np.uint8), np.zeros((32, 32), np.uint16), np.zeros((3, 32, 32), np.uint8)):
            with pytest.raises(ValueError, match="is needed"):
                writer.add(plane)
        writer.add(np.full((32, 32), 16, np.uint8))
        data = writer.finish()
    assert open_video(data, profile, 32, 32).n_frames == 1


def decode_or_refuse(data: bytes, profile: Profile, n: int) -> bool:
    """Whether the data are refused; else they must give planes of the right shape and number of frames at most ``n``."""
    try:
        reader = open_video(data, profile)
        back = read(reader)
    except CorruptFile:
        return True
    assert len(back) == reader.n_frames <= n and back.shape[1:] == (HEIGHT, WIDTH)
    return False


@pytest.mark.parametrize("profile", ALL, ids=lambda p: p.name)
def test_hostile_data(profile: Profile, capfd: pytest.CaptureFixture[str]) -> None:
    """Not a video, another one, truncated, damaged: CorruptFile, or planes of the right shape; never anything else."""
    n = 6
    data = code(profile, moving(profile, n), 24, 3)
    for bad in (b"", b"\0", bytes(4000), b"not a video at all", data[8:]):
        assert decode_or_refuse(bad, profile, n)
    for other in ALL:
        if other is not profile:
            assert decode_or_refuse(data, other, n)
    for width, height in ((WIDTH + 2, HEIGHT), (HEIGHT, WIDTH), (0, 0), (1 << 15, HEIGHT)):
        with pytest.raises(CorruptFile):
            open_video(data, profile, width, height)
    refused = [decode_or_refuse(data[:cut], profile, n) for cut in range(0, len(data), max(1, len(data) // 150))]
    assert all(refused[: len(refused) * data.rindex(b"moov") // len(data)])  # the index stands at the end
    random = np.random.default_rng(8)
    for _ in range(250):
        damaged = bytearray(data)
        damaged[int(random.integers(len(data)))] ^= int(random.integers(1, 256))
        decode_or_refuse(bytes(damaged), profile, n)
    capfd.readouterr()


class NoFragments:
    """A video in fragments that has none."""

    head, n_bytes = b"", 0

    def __init__(self) -> None:
        self.counts: list[int] = []

    def read(self, number: int) -> bytes:
        raise AssertionError(number)


@pytest.mark.parametrize("profile", PROFILES.values(), ids=lambda profile: profile.name)
def test_no_fragments(profile: Profile) -> None:
    with pytest.raises(CorruptFile, match="the video has no pictures"):
        VideoReader(NoFragments(), profile, 16, 16)
