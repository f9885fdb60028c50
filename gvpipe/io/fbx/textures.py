"""The pictures of an FBX scene: inside the file, or beside it."""

from __future__ import annotations

import mimetypes
from pathlib import Path, PureWindowsPath

from gvpipe.asset.material import Image, Texture
from gvpipe.foundation.errors import InputError
from gvpipe.io.fbx.answers import Picture
from gvpipe.io.simulation.side_files import side_file

WRAPS = {0: "repeat", 1: "clamp"}
MAX_BYTES = 512 << 20  # of one picture


class Textures:
    """The images of a scene, each once; what cannot be read becomes a note.

    Args:
        path: of the FBX file.
        contents: pictures inside it, by key.
    """

    def __init__(self, path: Path, contents: dict[str, bytes]) -> None:
        self._path, self._contents = path, contents
        self.images: list[Image] = []
        self.notes: list[str] = []
        self._numbers: dict[str, int | None] = {}

    def read(self, picture: Picture, uv_names: dict[str, str]) -> Texture | None:
        """Return how a material shows a picture, or None where it is missing; ``uv_names`` are attributes by uv set."""
        if picture.key not in self._numbers:
            self._numbers[picture.key] = self._load(picture)
        number = self._numbers[picture.key]
        if number is None:
            return None
        u, v = (WRAPS.get(mode, "repeat") for mode in picture.wrap)
        return Texture(number, uv_names.get(picture.uv_set, "uv"), wrap=(u, v))

    def _load(self, picture: Picture) -> int | None:
        name = PureWindowsPath(picture.key).name  # paths of either system
        try:
            data = self._contents.get(picture.key) or self._beside(picture, name)
            media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
            self.images.append(Image(name or picture.name, media_type, data))
        except (InputError, OSError, ValueError) as exc:
            self.notes.append(f"texture {name!r} was left out: {' '.join(str(exc).split())[:160]}")
            return None
        return len(self.images) - 1

    def _beside(self, picture: Picture, name: str) -> bytes:
        """The bytes of a file named by the texture, or of one of that name in the FBX file's folder."""
        for candidate in (picture.relative, name):
            try:
                found = side_file(self._path, candidate, "texture")
            except ValueError as exc:
                reason = exc
                continue
            if found.stat().st_size > MAX_BYTES:
                raise ValueError(f"it has {found.stat().st_size} bytes; at most {MAX_BYTES} are read")
            return found.read_bytes()
        raise reason
