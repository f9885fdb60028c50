"""A row of colour pictures to a video track, and back: what a moving texture is in a file.

The row is all that is known here: no mesh, no sequence. A track is an MP4 file in memory. Its picture k is that of frame k, in
groups of at most `GROUP` pictures that decode alone. Samples are 4:2:0 of the matrix BT.709 in limited range, which the track
says, so that all decoders agree. Odd sides get one more row or column, a copy of the last, which readers cut off again.

x264, x265 and SVT-AV1 run on one thread each, because what they write depends on the number of threads.
"""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.foundation.picture_limits import IN_MEMORY
from gvpipe.media.video import PlainPackets, without_avx512

GROUP = 32  # pictures
DEFAULT_QUALITY = 75
COPY = "copy"  # of a video that is there: its coded pictures as they are
UNSTATED, BT709, SRGB, LIMITED = 2, 1, 13, 1  # of ISO/IEC 23091-2; FFmpeg's number of the range
# of swscale, without its quick ways, which lose 8 dB: they copy chroma to four texels, and shift all levels
BICUBIC, BILINEAR, ACCURATE = 4, 2, 1 << 13 | 1 << 14 | 1 << 18
READ = ("h264", "hevc", "av1", "vp9")  # codecs of videos that may be copied, by FFmpeg's names


class Encoder(NamedTuple):
    """How an encoder of FFmpeg is asked.

    Args:
        name: FFmpeg's.
        options: for a constant rate factor, which ``{crf}`` stands for.
        coarsest, finest: rate factors of quality 0 and 100.
        tag: what MP4 calls it, where there is a choice.
        browsers: which play it.
    """

    name: str
    options: dict[str, str]
    coarsest: float
    finest: float
    tag: str
    browsers: str

    def crf(self, quality: float) -> float:
        """The rate factor of a quality, 0..100."""
        return round(self.coarsest + (self.finest - self.coarsest) * quality / 100, 2)


ENCODERS = {
    "h264": Encoder(
        "libx264",
        {"preset": "medium", "x264-params": f"crf={{crf}}:keyint={GROUP}:threads=1:cpu-independent=1:log-level=0"},
        45,
        12,
        "avc1",
        "all browsers",
    ),
    "hevc": Encoder(
        "libx265",
        {
            "preset": "medium",
            "x265-params": f"crf={{crf}}:keyint={GROUP}:open-gop=0:pools=none:frame-threads=1:wpp=0:log-level=none:info=0",
        },
        47,
        14,
        "hvc1",
        "Safari, and others where the system decodes it",
    ),
    "av1": Encoder(
        "libsvtav1",
        {"preset": "8", "crf": "{crf}", "svtav1-params": f"keyint={GROUP}:irefresh-type=2:lp=1:scd=0"},
        60,
        12,
        "av01",
        "Chrome, Edge and Firefox; Safari where the machine decodes it",
    ),
}


def check_choice(codec: str, quality: float) -> None:
    """Raise `SettingError` unless a codec is known, and here, and a quality is in 0..100."""
    if codec not in (*ENCODERS, COPY):
        raise SettingError(f"the codec of moving textures is {codec!r}; one of {', '.join((*ENCODERS, COPY))} is needed")
    if not 0 <= quality <= 100:
        raise SettingError(f"the quality of moving textures is {quality:g}; 0 to 100 is needed")
    if codec != COPY and not has_encoder(codec):
        here = [name for name in ENCODERS if has_encoder(name)]
        others = f"; here are {', '.join(here)}, and {COPY}" if here else f"; {COPY} needs none"
        raise SettingError(f"PyAV was built with an FFmpeg that has no {ENCODERS[codec].name}, which writes {codec}{others}")


def has_encoder(codec: str) -> bool:
    """Whether this FFmpeg writes a codec of `ENCODERS`."""
    import av

    return ENCODERS[codec].name in av.codec.codecs_available


def encode_pictures(
    pictures: Iterable[UInt8],
    size: tuple[int, int],
    fps: float,
    codec: str = "h264",
    quality: float = DEFAULT_QUALITY,
) -> bytes:
    """Return an MP4 file whose one track has the pictures.

    Args:
        pictures: ``(height, width, 3) uint8`` RGB each, rows from the top.
        size: width and height, pixels.
        fps: pictures per second.
        codec: one of `ENCODERS`.
        quality: 0..100, higher is better.

    Raises:
        InputError: a picture has another size.
        SettingError: as `check_choice`.
    """
    import av

    check_choice(codec, quality)
    encoder, (width, height) = ENCODERS[codec], size
    rate = Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
    options = {key: value.format(crf=f"{encoder.crf(quality):g}") for key, value in encoder.options.items()}
    if codec == "h264":
        options["x264-params"] += without_avx512()
    if codec == "av1":
        options["crf"] = str(round(encoder.crf(quality)))  # SVT-AV1 takes whole numbers
    file: IO[bytes]
    with tempfile.SpooledTemporaryFile(IN_MEMORY) as file, _quiet():
        with av.open(file, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
            stream: Any = container.add_stream(encoder.name, rate, options=options)
            stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
            context = stream.codec_context
            context.time_base, context.codec_tag = 1 / rate, encoder.tag
            context.color_range, context.colorspace, context.color_primaries, context.color_trc = LIMITED, BT709, BT709, SRGB
            plain = PlainPackets(stream) if codec == "h264" else list
            for number, pixels in enumerate(pictures):
                frame = _coded_frame(pixels, size, number)
                frame.pts, frame.time_base = number, 1 / rate
                container.mux(plain(stream.encode(frame)))
            container.mux(plain(stream.encode(None)))
        file.seek(0)
        return file.read()


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """SVT-AV1 writes to the terminal what it does, unless a variable keeps it from that."""
    before = os.environ.get("SVT_LOG")
    os.environ["SVT_LOG"] = "1" if before is None else before
    try:
        yield
    finally:
        if before is None:
            del os.environ["SVT_LOG"]


def _coded_frame(pixels: UInt8, size: tuple[int, int], number: int) -> Any:
    """A picture as samples, with even sides."""
    import av

    width, height = size
    if pixels.shape != (height, width, 3):
        raise InputError(
            f"picture {number} has {pixels.shape[1]}x{pixels.shape[0]} pixels, the first has {width}x{height}; "
            "all pictures of a moving texture need one size"
        )
    if width % 2 or height % 2:
        pixels = np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
    return frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG", interpolation=BICUBIC | ACCURATE)


def copy_pictures(video: str | os.PathLike[str] | bytes, name: str, fps: float, n_frames: int) -> bytes:
    """Return an MP4 file with the coded pictures of a video's first video track as they are, at another rate.

    Args:
        video: its path, or its bytes.
        name: for messages.
        fps: pictures per second.
        n_frames: pictures that are needed.

    Raises:
        InputError: it is no video, has another number of pictures, or a codec that is none of `READ`.
    """
    import av

    rate = Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
    file: IO[bytes]
    try:
        with (
            av.open(io.BytesIO(video) if isinstance(video, bytes) else os.fspath(video), "r") as source,
            tempfile.SpooledTemporaryFile(IN_MEMORY) as file,
        ):
            stream = first_video(source, name)
            packets = [packet for packet in source.demux(stream) if packet.size]
            check_count(len(packets), n_frames, name)
            place = {pts: number for number, pts in enumerate(sorted(packet.pts or 0 for packet in packets))}
            if len(place) != len(packets) or not packets[0].is_keyframe:
                raise InputError(
                    f"{name}: its pictures have no order, or the first is no key frame; leave out the codec {COPY}"
                )
            late = max(number - place[packet.pts or 0] for number, packet in enumerate(packets))
            with av.open(file, "w", format="mp4", options={"fflags": "+bitexact"}) as target:
                copy = target.add_stream_from_template(stream)
                stating = _stating_colours(stream, copy)
                for number, packet in enumerate(packets):
                    is_key, shown = packet.is_keyframe, place[packet.pts or 0]
                    [coded] = stating(packet)
                    coded.stream, coded.time_base, coded.is_keyframe = copy, 1 / rate, is_key
                    coded.pts, coded.dts, coded.duration = shown, number - late, 1
                    target.mux(coded)
            file.seek(0)
            return file.read()
    except (av.FFmpegError, OSError) as exc:
        raise video_error(name, exc) from exc


def _stating_colours(stream: Any, copy: Any) -> Callable[[Any], list[Any]]:
    """What makes packets say how their colours are coded, where they do not: BT.709 in limited range, which readers assume."""
    import av

    context = stream.codec_context
    filters = {"h264": "h264_metadata=video_full_range_flag={}", "hevc": "hevc_metadata=video_full_range_flag={}"}
    if int(context.colorspace) != UNSTATED or context.name not in filters:
        return lambda packet: [packet]
    is_full = int(int(context.color_range) == 2)
    asked = filters[context.name].format(is_full) + ":matrix_coefficients=1:colour_primaries=1:transfer_characteristics=13"
    made = av.BitStreamFilterContext(asked, stream, copy)
    return lambda packet: list(made.filter(packet))


def first_video(container: Any, name: str) -> Any:
    """The first video track of an open file; raises `InputError` if there is none, or none of a codec in `READ`."""
    streams = container.streams.video
    if not streams or streams[0].codec_context is None:
        raise InputError(f"{name} has no video track that can be read; give a video, such as an MP4 of H.264")
    codec = codec_name(streams[0].codec_context)
    if codec not in READ:
        raise InputError(f"{name} is a video of {codec}; {', '.join(READ)} are read, so make it one of these, or give pictures")
    return streams[0]


def codec_of(track: bytes) -> str:
    """The codec of a track, by FFmpeg's name."""
    import av

    with av.open(io.BytesIO(track), "r", format="mp4") as container:
        return codec_name(first_video(container, "the track").codec_context)


def codec_name(context: Any) -> str:
    """FFmpeg's name of a codec, whatever decodes it."""
    return str(context.codec.canonical_name if hasattr(context.codec, "canonical_name") else context.name)


def check_count(n_pictures: int, n_frames: int, name: str) -> None:
    """Raise `InputError` unless a video has a picture for each frame."""
    if n_pictures != n_frames:
        more = "fewer" if n_pictures < n_frames else "more"
        raise InputError(
            f"{name} has {n_pictures} pictures, {more} than the {n_frames} frames of the mesh; cut it to one picture a frame"
        )


def video_error(path: str | os.PathLike[str], exc: Exception) -> InputError:
    """The error for a video that cannot be read."""
    if isinstance(exc, FileNotFoundError) or not Path(path).exists():
        return InputError(f"{os.fspath(path)}: no such file; check the path")
    return InputError(f"{os.fspath(path)} cannot be read as a video ({exc}); check the file, or make it again")
