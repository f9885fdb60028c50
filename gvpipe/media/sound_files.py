"""Sounds from files and to files: whatever FFmpeg reads, as AAC or Opus; M4A and WAV."""

from __future__ import annotations

import io
import os
import wave
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from gvpipe.foundation.arguments import StrPath, check_path, show
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError, OutputError, SettingError, printable
from gvpipe.media.sound import LONGEST, MOST_CHANNELS, Sound, open_track, pack_track

if TYPE_CHECKING:
    import av

COPY = "copy"
CHOICES = ("aac", "opus", COPY)
ENCODERS = {"aac": "aac", "opus": "libopus"}
FORMATS = {"aac": "fltp", "opus": "flt"}  # of samples, as the encoders take them
RATES = {  # that the encoders take, samples per second
    "aac": (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000, 64000, 88200, 96000),
    "opus": (48000,),  # with others FFmpeg's encoder states a delay that is not its own
}
SAMPLES = {"aac": 1024, "opus": 960}  # of a packet
BITS = {"aac": 64_000, "opus": 48_000}  # per second and channel
BITS_PER_SAMPLE = 4  # at most: a low rate needs fewer
BIT_RATES = (6_000, 512_000)  # per second and channel, that may be asked for
LAYOUTS = {1: "mono", 2: "stereo", 3: "3.0", 4: "4.0", 5: "5.0", 6: "5.1", 7: "6.1", 8: "7.1"}
GAP = 0.02  # seconds between two pieces of a sound: a longer one is filled with silence
M4A_SUFFIXES = (".m4a", ".mp4", ".m4b")
WAV = ".wav"
BYTES_PER_SAMPLE = 2
LARGEST_WAV = (1 << 32) - (1 << 16)  # bytes


def read_sound(path: StrPath, codec: str | None = None, bitrate: int | None = None) -> Sound:
    """Read the sound of a file: of a sound file, or the first sound track of a video.

    Its second 0 is where the file begins, so a track that starts later is heard later.

    Args:
        path: whatever FFmpeg reads, such as ``.wav``, ``.mp3``, ``.flac``, ``.m4a``, ``.mp4``.
        codec: ``"aac"``, ``"opus"``, or ``"copy"``: the track as it is, if it is AAC or Opus. None: a copy if it is one of
            these and no bit rate is given, else AAC.
        bitrate: bits per second. None: 64,000 for each channel of AAC, 48,000 of Opus, fewer where the rate is low.

    Raises:
        InputError: there is no such file, it has no sound, or one that cannot be coded.
        SettingError: a codec or a bit rate that is none.
        TypeError: it is no path.
    """
    import av

    name = os.fspath(check_path(path, "the sound"))
    check_wanted(codec, bitrate)
    if not os.path.isfile(name):
        raise InputError(f"{name}: no such sound file; check the path")
    try:
        with av.open(name, "r") as container:
            if not container.streams.audio:
                raise InputError(f"{name} has no sound; give a file with a sound track")
            stream = container.streams.audio[0]
            known = stream.codec_context.name if stream.codec_context else ""
            _check_channels(name, stream)
            offset = -(container.start_time or 0) / av.time_base
            if codec == COPY and known not in ENCODERS:
                raise InputError(f"{name}: its sound is {known or 'of no known kind'}; copy takes AAC and Opus, leave it out")
            if codec == COPY or (codec is None and bitrate is None and known in ENCODERS):
                data = pack_track(stream, container.demux(stream), offset)
            else:
                data = _encode(_Source(name, container, stream, offset), codec or "aac", bitrate)
        return Sound.of(data)
    except (av.FFmpegError, OSError, ValueError) as exc:
        if isinstance(exc, InputError):
            raise
        raise InputError(f"{name} cannot be read as a sound ({printable(str(exc))}); give a sound file, or a video") from exc


def write_sound(sound: Sound, path: StrPath) -> None:
    """Write a sound as ``.m4a`` (its coded samples as they are) or ``.wav`` (16 bits, with silence before its start).

    Raises:
        InputError: another extension, or a ``.wav`` of more than 4 GiB.
        OutputError: the file cannot be written; no part of it is left.
        FormatError: the sound is damaged.
    """
    target = Path(check_path(path, "the sound's path"))
    suffix = target.suffix.lower()
    check_sound_target(target)
    data = sound.data
    size = int(sound.stop * sound.rate) * sound.channels * BYTES_PER_SAMPLE
    if suffix == WAV and size > LARGEST_WAV:
        raise InputError(f"{target}: the sound is too long for a .wav; write it as .m4a")
    with unnamed_path(target) as temporary, open(temporary, "wb") as file:
        if suffix == WAV:
            _write_wav(sound, data, file)
        else:
            file.write(data)


def check_sound_target(path: StrPath) -> None:
    """Refuse the path of a sound that cannot be written, before the work; raises `InputError`, `OutputError`."""
    target = Path(path)
    if target.suffix.lower() not in (*M4A_SUFFIXES, WAV):
        raise InputError(f"{target}: a sound is written as .m4a or .wav; give such a name")
    if os.path.isdir(target):
        raise OutputError(f"cannot write {target}: it is a folder; choose another name")


def check_wanted(codec: str | None, bitrate: int | None) -> None:
    """Raise `SettingError` for a codec or a bit rate that `read_sound` does not take."""
    if codec is not None and codec not in CHOICES:
        raise SettingError(f"the sound's codec is {show(codec)}; one of {', '.join(CHOICES)} is needed")
    if bitrate is None:
        return
    if codec == COPY:
        raise SettingError("a sound that is copied keeps its bit rate; leave the bit rate or copy out")
    low, high = BIT_RATES[0], BIT_RATES[1] * MOST_CHANNELS
    if not low <= bitrate <= high:
        raise SettingError(f"the sound's bit rate is {bitrate} bits per second; {low} to {high} is needed")


def _check_channels(name: str, stream: av.AudioStream) -> None:
    channels = stream.codec_context.channels if stream.codec_context else 0
    if channels > MOST_CHANNELS:
        raise InputError(
            f"{name}: its sound has {channels} channels; {MOST_CHANNELS} at most go into a file, mix it down first"
        )
    if not channels:
        raise InputError(f"{name}: its sound has no channels; give another file")


@dataclass(frozen=True)
class _Source:
    """A sound track that is decoded.

    Args:
        name: of its file.
        container, stream: as FFmpeg opened them.
        offset: seconds to add to its times.
    """

    name: str
    container: Any
    stream: av.AudioStream
    offset: float


def _encode(source: _Source, codec: str, bitrate: int | None) -> bytes:
    """An MP4 file of the track, coded anew."""
    import av

    context = source.stream.codec_context
    channels, rate = context.channels, _nearest(RATES[codec], context.sample_rate)
    resampler = av.AudioResampler(FORMATS[codec], LAYOUTS[channels], rate, SAMPLES[codec])
    file = io.BytesIO()
    with open_track(file) as target:
        stream: Any = target.add_stream(ENCODERS[codec], rate, layout=LAYOUTS[channels])
        encoder = stream.codec_context
        encoder.format = FORMATS[codec]
        encoder.bit_rate = bitrate or min(BITS[codec], BITS_PER_SAMPLE * rate) * channels
        encoder.flags |= av.codec.context.Flags.bitexact
        encoder.thread_count = 1
        at: int | None = None
        for time, frame in _without_gaps(source):
            at = round(time * rate) if at is None else at
            for piece in resampler.resample(frame):
                at = _mux(target, stream, piece, at)
        for piece in resampler.resample(None) if at is not None else ():
            at = _mux(target, stream, piece, at or 0)
        if at is None:
            raise InputError(f"{source.name}: its sound has no samples; give another file")
        target.mux(stream.encode(None))
    return file.getvalue()


def _mux(target: Any, stream: Any, piece: av.AudioFrame, at: int) -> int:
    """Code some samples that are heard from sample ``at`` on; returns the one after them."""
    piece.pts, piece.time_base = at, Fraction(1, piece.sample_rate)
    target.mux(stream.encode(piece))
    return at + piece.samples


def _without_gaps(source: _Source) -> Iterator[tuple[float, av.AudioFrame]]:
    """Decoded samples with their times, seconds; silence in what is missing between them."""
    due: float | None = None
    is_filled = source.stream.codec_context.channels < MOST_CHANNELS  # PyAV counts planes beyond eight, and crashes
    for frame in source.container.decode(source.stream):
        known = None if frame.time is None else frame.time + source.offset
        time = (due or 0.0) if known is None else max(0.0, known)
        if time > LONGEST:
            raise InputError(f"{source.name}: its sound lasts longer than {LONGEST:g} s")
        while is_filled and due is not None and time - due > GAP:
            silent = _silence(frame, min(round((time - due) * frame.sample_rate), frame.sample_rate))
            yield due, silent
            due += silent.samples / frame.sample_rate
        frame.pts = None
        yield (time if due is None else due), frame
        due = (time if due is None else due) + frame.samples / frame.sample_rate


def _silence(like: av.AudioFrame, samples: int) -> av.AudioFrame:
    """So many silent samples of a kind."""
    import av

    frame = av.AudioFrame(like.format.name, like.layout.name, samples)
    frame.sample_rate = like.sample_rate
    for plane in frame.planes:
        plane.update((b"\x80" if like.format.name.startswith("u8") else b"\0") * plane.buffer_size)
    return frame


def _nearest(rates: tuple[int, ...], rate: int) -> int:
    """The lowest rate that keeps all of a sound; the highest if there is none."""
    return min((each for each in rates if each >= rate), default=max(rates))


def _write_wav(sound: Sound, data: bytes, file: IO[bytes]) -> None:
    """Decode a sound as a WAV file of 16 bits, with silence before its start."""
    import av

    with wave.open(file, "wb") as target, av.open(io.BytesIO(data), "r", format="mp4") as source:
        target.setparams((sound.channels, BYTES_PER_SAMPLE, sound.rate, 0, "NONE", ""))
        frame_bytes = sound.channels * BYTES_PER_SAMPLE
        resampler, at = av.AudioResampler("s16", LAYOUTS[sound.channels], sound.rate), 0
        for frame in source.decode(audio=0):
            if at == 0 and frame.time:
                at = max(0, round(frame.time * sound.rate))
                for done in range(0, at, sound.rate):
                    target.writeframesraw(bytes(min(sound.rate, at - done) * frame_bytes))
            frame.pts = None
            for piece in resampler.resample(frame):
                target.writeframesraw(piece.to_ndarray().tobytes())
                at += piece.samples
