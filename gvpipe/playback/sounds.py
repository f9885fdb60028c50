"""The sound that is asked for beside a sequence, at the times of its frames."""

from __future__ import annotations

import os
from dataclasses import dataclass

from gvpipe.foundation.arguments import StrPath, show
from gvpipe.foundation.errors import SettingError
from gvpipe.foundation.notes import SOUND_ELSEWHERE, sound_and_film
from gvpipe.media.sound import Sound
from gvpipe.media.sound_files import check_wanted, read_sound
from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True)
class AudioOptions:
    """What sound a film is to have.

    Args:
        audio: a sound, or the file of one; None: the sequence's own, if it has one; False: none.
        codec, bitrate: as of `read_sound`, of a file.
        trim: whether the sound ends with the film, if not before.

    Raises:
        SettingError: a codec or a bit rate that is none, or that goes with no file.
        TypeError: ``audio`` is nothing of these.
    """

    audio: StrPath | Sound | bool | None = None
    codec: str | None = None
    bitrate: int | None = None
    trim: bool = False

    def __post_init__(self) -> None:
        if self.audio is True or not isinstance(self.audio, str | os.PathLike | Sound | bool | None):
            raise TypeError(f"audio is {show(self.audio)}; the path of a sound, a gvpipe.Sound, False or None is needed")
        check_wanted(self.codec, self.bitrate)
        if (self.codec or self.bitrate) and (self.audio is None or isinstance(self.audio, Sound | bool)):
            raise SettingError("a codec and a bit rate are those of a sound file; give audio, its path (--audio)")

    @property
    def is_empty(self) -> bool:
        """Whether nothing is asked for."""
        return self.audio is None and not self.trim

    def sound(self) -> Sound | None:
        """The sound that is given, if one is; raises `InputError` if it cannot be read."""
        if self.audio is None or isinstance(self.audio, Sound | bool):
            return self.audio if isinstance(self.audio, Sound) else None
        return read_sound(self.audio, self.codec, self.bitrate)


def with_sound(sequence: MeshSequence, options: AudioOptions, frames: tuple[int, int | None] | None = None) -> MeshSequence:
    """Return a sequence with the sound that is asked for, cut where its frames are, and a note if their ends differ.

    Args:
        sequence: with its own sound, if it has one.
        options: what is asked for.
        frames: those of the input that the sequence has: a sound that is given begins with the input's first frame.

    Raises:
        InputError: the sound cannot be read.
    """
    sound, said = sound_beside(sequence.sound, len(sequence) / sequence.fps, options, sequence.fps, frames)
    return sequence if sound is sequence.sound and not said else sequence.with_sound(sound, said)


def sound_beside(
    own: Sound | None, film: float, options: AudioOptions, fps: float = 1.0, frames: tuple[int, int | None] | None = None
) -> tuple[Sound | None, tuple[str, ...]]:
    """The sound that is asked for, and what a user should know of it, a line each.

    Args:
        own: the film's.
        film: its length, seconds.
        options: what is asked for.
        fps: frames per second.
        frames: as of `with_sound`.

    Raises:
        InputError: the sound cannot be read.
    """
    given, sound = options.sound(), own
    if options.audio is not None:
        sound = given
        if sound is not None and frames is not None:
            begin = frames[0] / fps
            sound = sound.part(begin, None if frames[1] is None else begin + film)
    sound = sound.part(0, film) if sound is not None and options.trim else sound
    if sound is not None:
        return sound, sound_and_film(sound.stop, film)
    return None, () if given is None else (SOUND_ELSEWHERE,)
