"""Sounds: in step to a millisecond whatever is done to them, and one line for what is no sound."""

from __future__ import annotations

import io
import pickle
import wave
from pathlib import Path

import av
import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import CorruptFile, InputError, OutputError, SettingError
from gvpipe.media.sound import Sound, pack_track
from gvpipe.media.sound_files import write_sound

CODECS = ("aac", "opus")
NEAR = 0.002  # seconds


def write_click(path: Path, at: float = 0.5, rate: int = 16_000, channels: int = 1, seconds: float = 1.0) -> Path:
    """A WAV file that is silent but for one sample."""
    samples = np.zeros((int(seconds * rate), channels), "<i2")
    samples[int(at * rate)] = 30_000
    with wave.open(str(path), "wb") as file:
        file.setparams((channels, 2, rate, 0, "NONE", ""))
        file.writeframes(samples.tobytes())
    return path


def loudest(data: bytes) -> float:
    """When the sound of an MP4 file is loudest, seconds."""
    with av.open(io.BytesIO(data), "r") as container:
        resampler = av.AudioResampler("s16", "mono", 48_000)
        frames = [frame for decoded in container.decode(audio=0) for frame in resampler.resample(decoded)]
    samples = np.concatenate([frame.to_ndarray()[0] for frame in frames]).astype(int)
    return float(frames[0].time or 0) + float(np.abs(samples).argmax()) / 48_000


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize(("rate", "channels"), [(8000, 1), (44_100, 2), (5512, 1), (48_000, 6)])
def test_a_click_stays_where_it_is(codec: str, rate: int, channels: int, tmp_path: Path) -> None:
    sound = gvpipe.read_sound(write_click(tmp_path / "a.wav", 0.5, rate, channels), codec)
    assert (sound.codec, sound.channels, sound.start) == (codec, channels, 0)
    assert abs(sound.seconds - 1) < NEAR
    assert abs(loudest(sound.data) - 0.5) < NEAR
    assert Sound.of(sound.data) == sound == pickle.loads(pickle.dumps(sound))
    assert gvpipe.read_sound(tmp_path / "a.wav", codec).data == sound.data  # the same bytes again


@pytest.mark.parametrize("codec", CODECS)
def test_cuts_are_where_frames_are(codec: str, tmp_path: Path) -> None:
    sound = gvpipe.read_sound(write_click(tmp_path / "a.wav", 0.5), codec)
    assert sound.part(0) is sound.part(0, 5) is sound
    for start, stop, at in ((0.2, None, 0.3), (0.31, 0.77, 0.19), (0.0, 0.6, 0.5), (0.45, 0.6, 0.05)):
        part = sound.part(start, stop)
        assert part is not None and part.start == 0
        assert abs(loudest(part.data) - at) < NEAR
        assert 0 <= Sound.of(part.data).stop - part.stop < 0.1  # a packet at most: 64 ms at this rate
    assert sound.part(1.0) is sound.part(2, 3) is None


def test_a_track_that_begins_later_is_heard_later(tmp_path: Path) -> None:
    early = gvpipe.read_sound(write_click(tmp_path / "a.wav"))
    with av.open(io.BytesIO(early.data), "r") as container:
        late = Sound.of(pack_track(container.streams.audio[0], container.demux(container.streams.audio[0]), 2.0))
    assert abs(late.start - 2) < 0.1 and abs(loudest(late.data) - 2.5) < NEAR
    (tmp_path / "late.mp4").write_bytes(late.data)
    with av.open(str(tmp_path / "film.mp4"), "w") as film, av.open(str(tmp_path / "late.mp4"), "r") as source:
        picture = film.add_stream("libx264", 10)
        picture.width = picture.height = 16
        picture.pix_fmt = "yuv420p"
        track = film.add_stream_from_template(source.streams.audio[0])
        film.mux(picture.encode(av.VideoFrame.from_ndarray(np.zeros((16, 16, 3), np.uint8))))
        film.mux(picture.encode(None))
        for packet in source.demux(source.streams.audio[0]):
            if packet.size:
                packet.stream = track
                film.mux(packet)
    for codec in (None, "copy", "aac", "opus"):
        found = gvpipe.read_sound(tmp_path / "film.mp4", codec)
        assert abs(loudest(found.data) - 2.5) < NEAR
        part = found.part(1.0, 3.0)
        assert part is not None and abs(loudest(part.data) - 1.5) < NEAR
        write_sound(found, tmp_path / "out.wav")
        with wave.open(str(tmp_path / "out.wav")) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(int)
            assert abs(np.abs(samples).argmax() / file.getframerate() - 2.5) < NEAR


def test_a_sound_that_fits_is_copied(tmp_path: Path) -> None:
    first = gvpipe.read_sound(write_click(tmp_path / "a.wav"), "opus")
    write_sound(first, tmp_path / "a.m4a")
    assert gvpipe.read_sound(tmp_path / "a.m4a").data == gvpipe.read_sound(tmp_path / "a.m4a", "copy").data == first.data
    assert gvpipe.read_sound(tmp_path / "a.m4a", "aac").codec == "aac"
    assert gvpipe.read_sound(tmp_path / "a.m4a", bitrate=32_000).codec == "aac"
    few, many = (gvpipe.read_sound(_noise(tmp_path / "noise.wav"), "aac", bits).n_bytes for bits in (16_000, 48_000))
    assert 1.5 < many / few < 4


def _noise(path: Path) -> Path:
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(np.random.default_rng(0).integers(-9000, 9000, 32_000).astype("<i2").tobytes())
    return path


def test_what_is_no_sound_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "text.wav").write_text("no sound\n" * 100)
    write_click(tmp_path / "many.wav", channels=48)
    write_click(tmp_path / "none.wav", at=0, seconds=0.001)
    with wave.open(str(tmp_path / "none.wav"), "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
    whole = write_click(tmp_path / "cut.wav").read_bytes()
    (tmp_path / "cut.wav").write_bytes(whole[:30])
    with av.open(str(tmp_path / "silent.mp4"), "w") as film:
        picture = film.add_stream("libx264", 10)
        picture.width = picture.height = 16
        picture.pix_fmt = "yuv420p"
        film.mux(picture.encode(av.VideoFrame.from_ndarray(np.zeros((16, 16, 3), np.uint8))))
        film.mux(picture.encode(None))
    for name, message in {
        "text.wav": "cannot be read as a sound",
        "many.wav": "has 48 channels; 8 at most",
        "none.wav": "has no samples|cannot be read as a sound",
        "cut.wav": "cannot be read as a sound|no samples|no sound",
        "silent.mp4": "has no sound; give a file with a sound track",
        "nothing.wav": "no such sound file",
    }.items():
        with pytest.raises(InputError, match=message) as caught:
            gvpipe.read_sound(tmp_path / name)
        assert name in str(caught.value) and "\n" not in str(caught.value)
    path = write_click(tmp_path / "a.wav")
    with pytest.raises(InputError, match="copy takes AAC and Opus"):
        gvpipe.read_sound(path, "copy")
    with pytest.raises(SettingError, match="one of aac, opus, copy"):
        gvpipe.read_sound(path, "mp3")
    with pytest.raises(SettingError, match="bit rate is 1 bits"):
        gvpipe.read_sound(path, bitrate=1)
    with pytest.raises(SettingError, match="keeps its bit rate"):
        gvpipe.read_sound(path, "copy", 96_000)
    with pytest.raises(TypeError):
        gvpipe.read_sound(3)  # type: ignore[arg-type]
    sound = gvpipe.read_sound(path)
    with pytest.raises(InputError, match=r"written as \.m4a or \.wav"):
        write_sound(sound, tmp_path / "a.mp3")
    with pytest.raises(OutputError, match="it is a folder"):
        (tmp_path / "folder.wav").mkdir()
        write_sound(sound, tmp_path / "folder.wav")


def test_bytes_that_are_no_sound_are_refused(tmp_path: Path) -> None:
    data = gvpipe.read_sound(write_click(tmp_path / "a.wav")).data
    for damaged in (b"", b"no sound", data[:40], data.replace(b"trak", b"free")):
        with pytest.raises(InputError, match="a sound"):
            Sound.of(damaged)
    good = Sound.of(data)
    for name, value in {"codec": "mp3", "rate": 0, "channels": 9, "start": -1.0, "seconds": 0.0, "rate ": True}.items():
        with pytest.raises(InputError, match=f"a sound's {name.strip()} is"):
            Sound.described({**good.description, name.strip(): value}, 1, bytes)
    other = Sound.described({**good.description, "seconds": 5.0}, good.n_bytes, lambda: data)
    with pytest.raises(CorruptFile, match="not what its header describes"):
        _ = other.data
    with pytest.raises(CorruptFile, match="its sound is damaged"):
        _ = Sound.described(good.description, good.n_bytes, lambda: b"").data
