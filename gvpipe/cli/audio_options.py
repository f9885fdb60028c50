"""``--audio`` and the options beside it, and where ``decode`` writes a sound."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gvpipe.cli.pipes import PIPE
from gvpipe.foundation.errors import FormatError

if TYPE_CHECKING:
    from gvpipe.media.sound import Sound

Command = Callable[..., None]

NO_SOUND = "none"  # for --audio-out
SUFFIX = ".m4a"
OPTIONS = (
    click.option("--audio", metavar="FILE", help="A sound that plays along: a sound file, or a video with one."),
    click.option("--no-audio", is_flag=True, help="Leave out the sound that the input has."),
    click.option(
        "--audio-codec",
        type=click.Choice(["aac", "opus", "copy"]),
        help="Of --audio; copy: as it is. [default: copy of AAC and Opus, aac of others]",
    ),
    click.option("--audio-bitrate", metavar="BITS", help="Of --audio, a second: 96k. [default: 64k for each channel]"),
    click.option("--audio-trim", is_flag=True, help="Let the sound end with the film, if it is longer."),
)


def audio_options(command: Command) -> Command:
    """Give a command the options, as keywords that `parse_audio` takes."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def parse_audio(options: dict[str, Any]) -> dict[str, Any]:
    """Take the options out of those of a command, as keywords of `gvpipe.encode`; raises `click.UsageError`."""
    from gvpipe.cli.choices import parse_bytes

    audio, no_audio, bits = (options.pop(name) for name in ("audio", "no_audio", "audio_bitrate"))
    if audio is not None and no_audio:
        raise click.UsageError("give --audio or --no-audio, not both")
    return {
        "audio": False if no_audio else audio,
        "audio_codec": options.pop("audio_codec"),
        "audio_bitrate": None if bits is None else parse_bytes("--audio-bitrate", bits),
        "audio_trim": options.pop("audio_trim"),
    }


def sound_path(target: str, source: str, wanted: str | None) -> str | None:
    """Where a sound goes beside meshes; None: nowhere.

    Args:
        target: of the meshes.
        source: the geometry video.
        wanted: what ``--audio-out`` says.
    """
    from gvpipe.io.frames.pattern import match_pattern

    if wanted is not None:
        return None if wanted == NO_SOUND else wanted
    if target == PIPE:
        return None
    stem = "sound" if source == PIPE else Path(source).stem
    if target.endswith(("/", os.sep)) or os.path.isdir(target):
        return os.path.join(target, stem + SUFFIX)
    if match_pattern(target):
        return os.path.join(os.path.dirname(target), stem + SUFFIX)
    return str(Path(target).with_suffix(SUFFIX))


def write_beside(sound: Sound | None, path: str | None, wanted: str | None) -> tuple[Sound | None, list[str]]:
    """Write a sound to a path; returns what was written, None for nothing, and what a user should know."""
    from gvpipe.foundation.notes import sound_left_out
    from gvpipe.media.sound_files import write_sound

    if sound is None:
        return None, ["there is no sound in these frames; --audio-out writes nothing"] if wanted not in (None, NO_SOUND) else []
    if path is None:
        return None, [] if wanted == NO_SOUND else ["the sound is left out; --audio-out FILE writes it"]
    try:
        write_sound(sound, path)
    except FormatError as exc:
        return None, [sound_left_out(str(exc))]
    return sound, [f"the sound is in {path}"]
