"""The pictures of an FBX scene: inside the file, or beside it."""

from __future__ import annotations

import mimetypes
from pathlib import Path, PureWindowsPath
from typing import Any

from gvpipe.asset.material import Image, Texture
from gvpipe.errors import InputError
from gvpipe.io.fbx.library import hold
from gvpipe.io.simulation.side_files import side_file

WRAPS = {0: "repeat", 1: "clamp"}
MAX_BYTES = 512 << 20  # of one picture


class Textures:
    """The images of a scene, each once; what cannot be read becomes a note."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.images: list[Image] = []
        self.notes: list[str] = []
        self._numbers: dict[str, int | None] = {}

    def read(self, texture: Any, uv_names: dict[str, str]) -> Texture | None:
        """Return how a material shows a picture, or None where it is missing; ``uv_names`` are attributes by uv set."""
        hold(texture)
        key = texture.relative_filename or texture.filename or texture.name
        if key not in self._numbers:
            self._numbers[key] = self._load(texture, key)
        number = self._numbers[key]
        if number is None:
            return None
        wrap = tuple(WRAPS.get(int(mode), "repeat") for mode in (texture.wrap_u, texture.wrap_v))
        return Texture(number, uv_names.get(texture.uv_set, "uv"), wrap=(wrap[0], wrap[1]))

    def _load(self, texture: Any, key: str) -> int | None:
        name = PureWindowsPath(key).name  # paths of either system
        try:
            data = bytes(texture.content or b"") or self._beside(texture, name)
            media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
            self.images.append(Image(name or texture.name, media_type, data))
        except (InputError, OSError, ValueError) as exc:
            self.notes.append(f"texture {name!r} was left out: {' '.join(str(exc).split())[:160]}")
            return None
        return len(self.images) - 1

    def _beside(self, texture: Any, name: str) -> bytes:
        """The bytes of a file named by the texture, or of one of that name in the FBX file's folder."""
        for candidate in (texture.relative_filename, name):
            try:
                found = side_file(self._path, candidate or "", "texture")
            except ValueError as exc:
                reason = exc
                continue
            if found.stat().st_size > MAX_BYTES:
                raise ValueError(f"it has {found.stat().st_size} bytes; at most {MAX_BYTES} are read")
            return found.read_bytes()
        raise reason
