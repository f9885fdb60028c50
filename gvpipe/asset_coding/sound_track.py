"""A sequence's sound as a companion track of its file, and back."""

from __future__ import annotations

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.companion import Companion
from gvpipe.foundation.errors import REMEDY, FormatError, InputError
from gvpipe.foundation.notes import sound_left_out
from gvpipe.media.sound import Sound

KIND = "sound"


def pack_sound(sound: Sound) -> Companion:
    """The companion that plays a sound; raises `FormatError` where that of another file is damaged."""
    data = sound.data
    return Companion.of(KIND, Sound.of(data).description, data)


def read_sound(bitstream: Bitstream) -> tuple[Sound | None, tuple[str, ...]]:
    """The sound of a file, None if it has none, and what is wrong with it, a line each; its samples are not read."""
    for companion in bitstream.companions:
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
