"""A sequence's sound as a companion track of its file, and back."""

from __future__ import annotations

from collections.abc import Sequence

from gvpipe.container.companion import Companion
from gvpipe.foundation.errors import REMEDY, FormatError, InputError
from gvpipe.foundation.notes import sound_left_out
from gvpipe.media.sound import Sound

KIND = "sound"


def pack_sound(sound: Sound) -> Companion:
    """The companion that plays a sound; raises `FormatError` where that of another file is damaged."""
    data = sound.data
    return Companion.of(KIND, Sound.of(data).description, data)


def read_sound(companions: Sequence[Companion]) -> tuple[Sound | None, tuple[str, ...]]:
    """The sound among the companions of a file, None if there is none, and what is wrong with it; its samples are not read."""
    for companion in companions:
        if companion.kind == KIND:
            try:
                return Sound.described(companion.about, companion.n_bytes, companion.file), ()
            except InputError as exc:
                return None, (sound_left_out(f"{exc}; {REMEDY}"),)
    return None, ()


def whole_sound(sound: Sound | None) -> tuple[Sound | None, tuple[str, ...]]:
    """A sound that is read, None if it is damaged, and what is wrong with it, a line each."""
    if sound is None:
        return None, ()
    try:
        return Sound.of(sound.data), ()
    except FormatError as exc:
        return None, (sound_left_out(str(exc)),)
