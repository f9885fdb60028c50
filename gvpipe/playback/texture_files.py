"""Moving textures of a geometry video as video files: their tracks as they are coded."""

from __future__ import annotations

from pathlib import Path

from gvpipe.asset_coding.moving_textures import TrackPictures
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError, in_file
from gvpipe.io.pictures import picture_names
from gvpipe.playback.player import Player


def write_tracks(player: Player, path: str) -> list[str]:
    """Write the video of each moving texture; of several, all but the first have the texture's name behind the file's.

    Returns the names of the files.

    Raises:
        InputError: the file has no moving texture, or the path is no ``.mp4``.
        FormatError: a track is damaged.
        OutputError: a file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".mp4":
        raise InputError(f"{path}: textures that move are written as .mp4; end the name in it")
    names = picture_names(player.images)
    pairs = zip(names, player.images, strict=True)
    tracks = {name: image.pictures for name, image in pairs if isinstance(image.pictures, TrackPictures)}
    if not tracks:
        raise InputError(f"{player.path} has no texture that moves; leave out --texture-out")
    written: list[str] = []
    for name, pictures in tracks.items():
        with in_file(player.path):
            data = pictures.track(player.fps)
        own = target if not written else target.with_name(f"{target.stem}-{Path(name).stem}{target.suffix}")
        with unnamed_path(own) as temporary:
            temporary.write_bytes(data)
        written.append(str(own))
    return written
