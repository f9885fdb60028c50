"""Sounds of geometry videos: tables and samples of the track, and what the header says of it, changed; their checksums hold."""

from __future__ import annotations

import json
import zlib
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fuzz.boxes import mutate_boxes
from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import BrokenPromise, Parts, Seed, Target
from fuzz.videos import FILE, parse_video
from gvpipe.container.companion import Companion
from gvpipe.container.mp4 import file_bytes, read_bytes, read_file
from gvpipe.foundation.errors import FormatError
from gvpipe.media.sound import Sound
from gvpipe.media.sound_files import read_sound, write_sound
from gvpipe.playback.player import Player

GEOMETRY, TRAK, SAMPLES, ABOUT = "(geometry)", "(trak)", "(samples)", "(about)"
SECONDS = 0.3  # of a seed


def companion_seeds(video: Path, voice: Path) -> tuple[Seed, ...]:
    """A geometry video without sound, and a sound in either codec beside it, in parts."""
    seeds = []
    for codec in ("aac", "opus"):
        sound = read_sound(voice, codec).part(0, SECONDS)
        assert sound is not None
        companion = Companion.of("sound", Sound.of(sound.data).description, sound.data)
        parts = {TRAK: companion.trak, SAMPLES: companion.data(), ABOUT: json.dumps(dict(companion.about)).encode()}
        seeds.append(Seed(codec, {GEOMETRY: file_bytes(read_file(video)), **parts, "mvhd": companion.mvhd}))
    return tuple(seeds)


def join_companion(parts: Parts) -> dict[str, bytes]:
    """The file of some parts, with checksums that hold; without the sound, where its tables cannot be placed in a file."""
    bitstream = read_bytes(parts[GEOMETRY], FILE)
    try:
        about = json.loads(parts[ABOUT])
    except (ValueError, RecursionError):
        about = {}
    data = parts[SAMPLES]
    given = about if isinstance(about, dict) else {}
    companion = Companion("sound", given, len(data), zlib.crc32(data), parts[TRAK], parts["mvhd"], partial(bytes, data))
    try:
        return {FILE: file_bytes(replace(bitstream, companions=(companion,)))}
    except (FormatError, ValueError, RecursionError):
        return {FILE: parts[GEOMETRY]}


def companion_target(seeds: tuple[Seed, ...]) -> Target:
    """The parser of companion tracks."""
    return Target("companion", seeds, _mutate, join_companion, _parse, (FormatError,))


def _parse(path: Path) -> None:
    """Read the geometry, which is whole, and the sound, which may be none."""
    parse_video(path)
    with Player(path) as video:
        sound = video.sound
    if sound is None:
        return
    try:
        data = sound.data
    except FormatError:
        return
    found = Sound.of(data)
    if (found.codec, found.rate, found.channels) != (sound.codec, sound.rate, sound.channels):
        raise BrokenPromise(f"a sound is {found}, and the file says {sound}")
    with TemporaryDirectory() as folder:
        for start, stop in ((0.0, None), (0.1, 0.2)):
            part = sound.part(start, stop)
            if part is not None:
                _write(part, Path(folder) / "a.m4a")


def _write(sound: Sound, path: Path) -> None:
    try:
        write_sound(sound, path)
    except FormatError:
        return


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    kind = rng.random()
    if kind < 0.6:
        parts[TRAK] = mutate_boxes(parts[TRAK], rng)
    elif kind < 0.8:
        parts[SAMPLES] = mutate_bytes(parts[SAMPLES], rng)
    else:
        parts[ABOUT] = mutate_json(parts[ABOUT], rng)
    return parts
