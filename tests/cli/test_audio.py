"""``--audio``: into a geometry video, through every command that carries it, and out again."""

from __future__ import annotations

import io
import json
import shutil
import wave
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from file_server import serving
from sequences import waving

import gvpipe
from gvpipe.container import mp4
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.media.sound import Sound
from gvpipe.playback.live import LiveEncoder

Run = Callable[..., Any]

SEQUENCE = waving(6, 24)  # one second
FAST = ("--codec", "pdct")
RATE = 16_000


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An archive, a sound that clicks at half a second, and a film with it in the plain and the stream layout."""
    folder = tmp_path_factory.mktemp("audio")
    gvpipe.write(SEQUENCE, folder / "mesh.npz")
    write_click(folder / "click.wav", 1.0)
    for name, stream in (("plain", False), ("stream", True)):
        gvpipe.encode(SEQUENCE, folder / f"{name}.mp4", "pdct", audio=folder / "click.wav", stream=stream)
    return folder


def write_click(path: Path, seconds: float) -> None:
    samples = np.zeros(int(seconds * RATE), "<i2")
    samples[RATE // 2] = 30_000
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(samples.tobytes())


def loudest(sound: Sound | Path | None) -> float:
    assert sound is not None
    with av.open(io.BytesIO(sound.data) if isinstance(sound, Sound) else str(sound), "r") as container:
        frames = [frame.to_ndarray()[0].astype(float) for frame in container.decode(audio=0)]
    return float(np.abs(np.concatenate(frames)).argmax()) / RATE


def near(a: float, b: float) -> bool:
    return abs(a - b) < 0.002


def test_encode_info_and_player_know_it(run: Run, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    ended = run("encode", folder / "mesh.npz", path, *FAST, "--audio", folder / "click.wav", "--json")
    report, info = json.loads(ended.out), json.loads(run("info", path, "--json").out)
    assert ended.err == "" and report["audio"] == info["audio"]
    expected = {"codec": "aac", "channels": 1, "rate": RATE, "seconds": 1.0, "start": 0.0, "bytes": info["sections"]["sound"]}
    assert info["audio"] == expected and sum(info["sections"].values()) == path.stat().st_size
    assert "sound: aac, 1 channel, 16000 Hz, 1 s, " in run("info", path).out
    assert path.read_bytes() == (folder / "plain.mp4").read_bytes()  # the same by Python
    for name in ("plain", "stream"):
        with gvpipe.open(folder / f"{name}.mp4") as video:
            assert near(loudest(video.sound), 0.5) and near(loudest(video.level(0).sound), 0.5)
    assert near(loudest(path), 0.5)  # what an ordinary player hears
    with serving((folder / "stream.mp4").read_bytes()) as (url, _):
        assert near(loudest(gvpipe.open(url).sound), 0.5)


@pytest.mark.parametrize("name", ["plain", "stream"])
def test_frames_cut_the_sound(run: Run, name: str, folder: Path, tmp_path: Path) -> None:
    source = folder / f"{name}.mp4"
    for target, options in (("again.mp4", ()), ("mesh.mp4", ("--audio", folder / "click.wav"))):
        given = source if target == "again.mp4" else folder / "mesh.npz"
        assert run("encode", given, tmp_path / target, *FAST, "--frames", "6:18", *options).status == 0
        sound = gvpipe.open(tmp_path / target).sound
        assert near(loudest(sound), 0.25) and sound is not None and sound.stop < 0.6
    part = gvpipe.decode(source, 6, 18)
    assert near(loudest(part.sound), 0.25)
    assert gvpipe.decode(source, 0, 5).sound is not None
    assert part.bare().sound is None and near(loudest(part.with_fps(5).sound), 0.25)


def test_decode_writes_it_beside(run: Run, folder: Path, tmp_path: Path) -> None:
    for target, sound in (("a.npz", "a.m4a"), ("frames/", "frames/plain.m4a"), ("obj/%03d.ply", "obj/plain.m4a")):
        (tmp_path / target).parent.mkdir(exist_ok=True)
        (tmp_path / "frames").mkdir(exist_ok=True)
        ended = run("decode", folder / "plain.mp4", f"{tmp_path}/{target}", "--json")
        values = json.loads(ended.out)
        assert values["audio"]["output"] == str(tmp_path / sound) and f"the sound is in {tmp_path / sound}" in ended.err
        assert near(loudest(tmp_path / sound), 0.5)
    wav = tmp_path / "b.wav"
    assert run("decode", folder / "stream.mp4", tmp_path / "b.npz", "--start", 6, "--audio-out", wav).status == 0
    assert near(loudest(wav), 0.25) and not (tmp_path / "b.m4a").exists()
    assert "sound" not in run("decode", folder / "plain.mp4", tmp_path / "c.npz", "--audio-out", "none").err
    ended = run("decode", folder / "plain.mp4", tmp_path / "d.npz", "--audio-out", "x.mp3")
    assert ended.status == 1 and "written as .m4a or .wav" in ended.err and not (tmp_path / "d.npz").exists()
    assert (
        "sound is left out, for which mesh files have no place" in run("convert", folder / "plain.mp4", tmp_path / "e.npz").err
    )


def test_layouts_keep_it_and_restream_changes_it(run: Run, folder: Path, tmp_path: Path) -> None:
    plain, again = folder / "plain.mp4", tmp_path / "again.mp4"
    assert run("restream", plain, tmp_path / "stream.mp4").status == 0
    assert (tmp_path / "stream.mp4").read_bytes() == (folder / "stream.mp4").read_bytes()
    assert run("restream", folder / "stream.mp4", again).status == 0
    assert again.read_bytes() == plain.read_bytes()
    assert run("restream", plain, again, "--no-audio").status == 0
    gvpipe.encode(SEQUENCE, tmp_path / "silent.mp4", "pdct")
    assert again.read_bytes() == (tmp_path / "silent.mp4").read_bytes()
    assert gvpipe.info(again).audio is None
    done = json.loads(run("restream", again, tmp_path / "b.mp4", "--audio", folder / "click.wav", "--json").out)
    assert done["layout"] == "plain" and (tmp_path / "b.mp4").read_bytes() == plain.read_bytes()
    gvpipe.encode(SEQUENCE, tmp_path / "bare.mp4", "pdct", audio=folder / "click.wav", bare=True)
    assert near(loudest(gvpipe.open(tmp_path / "bare.mp4").sound), 0.5) and near(loudest(tmp_path / "bare.mp4"), 0.5)
    assert run("restream", tmp_path / "bare.mp4", again).status == 0 and near(loudest(again), 0.5)
    assert run("encode", plain, again, *FAST, "--no-audio").status == 0 and gvpipe.info(again).audio is None


def test_other_lengths_are_said(run: Run, folder: Path, tmp_path: Path) -> None:
    write_click(tmp_path / "long.wav", 3.0)
    write_click(tmp_path / "short.wav", 0.6)
    path = tmp_path / "a.mp4"
    audio = ("encode", folder / "mesh.npz", path, *FAST, "--audio")
    assert "the sound goes on for 2 s after the film; players stop there" in run(*audio, tmp_path / "long.wav").err
    assert gvpipe.info(path).audio is not None and near(gvpipe.info(path).audio["seconds"], 3)  # type: ignore[index]
    assert run(*audio, tmp_path / "long.wav", "--audio-trim").err == ""
    found = gvpipe.info(path).audio
    assert found is not None and found["seconds"] < 1.1
    assert "the sound ends 0.4 s before the film" in run(*audio, tmp_path / "short.wav").err
    ended = run(*audio, tmp_path / "short.wav", "--frames", "20:24")
    assert "the sound has ended before these frames" in ended.err and gvpipe.info(path).audio is None


def test_splitting_and_targets(run: Run, folder: Path, tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    gvpipe.write(SEQUENCE.part(0, 6), f"{frames}/%02d.ply")
    gvpipe.write(waving(5, 12), f"{frames}/%02d.ply", 6)
    given = ("encode", frames, tmp_path / "a.mp4", *FAST, "--fps", 24, "--split", "--audio", folder / "click.wav")
    assert run(*given).status == 0
    second = gvpipe.open(tmp_path / "a-001.mp4").sound
    assert near(loudest(second), 0.25) and second is not None and second.stop < 0.6
    report = gvpipe.encode(SEQUENCE, tmp_path / "b.mp4", "pdct", target_bpvf=120.0, audio=folder / "click.wav")
    assert report.bytes == (tmp_path / "b.mp4").stat().st_size and report.bpvf <= 120  # the sound counts


def test_wrong_use_is_one_line(run: Run, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    for options, status, message in (
        (("--audio", folder / "mesh.npz"), 1, "cannot be read as a sound"),
        (("--audio", tmp_path / "no.wav"), 1, "no such sound file"),
        (("--audio-codec", "opus"), 1, "give audio, its path (--audio)"),
        (("--audio", folder / "click.wav", "--audio-codec", "copy"), 1, "copy takes AAC and Opus"),
        (("--audio", folder / "click.wav", "--audio-bitrate", "9"), 1, "bit rate is 9 bits per second"),
        (("--audio", folder / "click.wav", "--no-audio"), 2, "not both"),
        (("--live", "--audio", folder / "click.wav"), 2, "--live writes no sound; add it later: gvpipe restream"),
    ):
        ended = run("encode", folder / "mesh.npz", path, *FAST, *options)
        assert ended.status == status and message in ended.err and not path.exists(), ended
    for audio in (True, 3):
        with pytest.raises(TypeError, match=r"the path of a sound, a gvpipe\.Sound, False or None"):
            gvpipe.encode(SEQUENCE, path, "pdct", audio=audio)  # type: ignore[arg-type]
    with pytest.raises(SettingError):
        gvpipe.encode(SEQUENCE, path, "pdct", audio=gvpipe.read_sound(folder / "click.wav"), audio_codec="aac")
    with pytest.raises(TypeError, match="as of gvpipe.read_sound"):
        replace(SEQUENCE, sound=b"")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no such sound file"):
        gvpipe.restream(folder / "plain.mp4", path, audio=tmp_path / "no.wav")
    assert not path.exists()


@pytest.mark.parametrize("name", ["plain", "stream"])
def test_a_damaged_sound_is_left_out(run: Run, name: str, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    data = (folder / f"{name}.mp4").read_bytes()
    samples = mp4.read_file(folder / f"{name}.mp4").companions[0].data()
    at = data.index(samples) + len(samples) // 2
    path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    with gvpipe.open(path) as video:
        assert np.array_equal(video[3], gvpipe.open(folder / "plain.mp4")[3])
    for command in (("decode", path, tmp_path / "o.npz"), ("encode", path, tmp_path / "o.mp4", *FAST)):
        ended = run(*command)
        assert ended.status == 0 and "damaged, or was re-encoded" in ended.err, ended
        assert ended.err.count("damaged") == 1
    assert gvpipe.info(tmp_path / "o.mp4").audio is None and not (tmp_path / "o.m4a").exists()
    ended = run("restream", path, tmp_path / "p.mp4")
    assert ended.status == 0 and "damaged" in ended.err and gvpipe.info(tmp_path / "p.mp4").audio is None


def test_a_file_that_grew_gets_its_sound_later(run: Run, folder: Path, tmp_path: Path) -> None:
    with LiveEncoder(tmp_path / "live.mp4", SEQUENCE.faces, 24.0) as live:
        for frame in SEQUENCE:
            live.append(frame)
    assert run("restream", tmp_path / "live.mp4", tmp_path / "a.mp4", "--audio", folder / "click.wav").status == 0
    assert gvpipe.info(tmp_path / "a.mp4").layout == "stream" and near(loudest(gvpipe.open(tmp_path / "a.mp4").sound), 0.5)


def test_what_the_header_says_is_checked(folder: Path, tmp_path: Path) -> None:
    whole = mp4.read_file(folder / "plain.mp4")
    sound = whole.companions[0]
    for about in ({}, {**sound.about, "channels": 9}, {**sound.about, "seconds": "long"}):
        mp4.write_file(replace(whole, companions=(replace(sound, about=about),)), tmp_path / "a.mp4")
        with gvpipe.open(tmp_path / "a.mp4") as video:
            assert video.sound is None and any("the sound is left out: a sound's" in note for note in video.notes)
            assert len(video[0]) == SEQUENCE.n_vertices
    shutil.rmtree(tmp_path)
