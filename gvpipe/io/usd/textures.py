"""The pictures that a USD material shows: files beside the stage, or inside of a .usdz."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gvpipe.asset.grey import eight_bits
from gvpipe.asset.material import Image, Texture
from gvpipe.asset.moving import Pictures
from gvpipe.foundation.errors import InputError
from gvpipe.io.picture_files import BytesPictures, FilePictures
from gvpipe.io.usd.stage import is_inside

MEDIA_TYPES = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".webp": "image/webp",
    ".exr": "image/x-exr",
    ".tif": "image/tiff",
    ".tiff": "image/tiff",
    ".bmp": "image/bmp",
    ".gif": "image/gif",
}
MAX_BYTES = 512 << 20  # of one picture
CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}


@dataclass(frozen=True)
class Source:
    """A texture that an input of a material is connected to: which channel of it, and its factors ``(4,)``."""

    texture: Texture
    output: str
    scale: tuple[float, ...]


class Textures:
    """The images of a stage, each file once."""

    def __init__(self, path: Path) -> None:
        self.images: list[Image] = []
        self.notes: list[str] = []
        self._folder = Path(os.path.realpath(path)).parent
        self.first = 0  # number of the first frame, for messages
        self._numbers: dict[tuple[str, ...], int | None] = {}

    def read(self, assets: Sequence[Any], output: str, texture: Texture, scale: tuple[float, ...]) -> Source | None:
        """Return the texture with its image, or None for a file that is missing, outside of the folder or no picture.

        Of several assets, one for each frame, the image moves; where a file cannot be read, that of the frame before is shown.
        """
        if assets[0] is None or not assets[0].path:
            return None
        key = tuple("" if asset is None else asset.path for asset in assets)
        if key not in self._numbers:
            self._numbers[key] = self._load(assets[0]) if len(set(key)) == 1 else self._load_row(assets)
        number = self._numbers[key]
        return None if number is None else Source(replace(texture, image=number), output, scale)

    def combine(self, metallic: Source | None, roughness: Source | None) -> Texture | None:
        """One texture with roughness in green and metallic in blue, as glTF needs it; where they lie so, it is theirs.

        In place of the one that is missing it has 1, so that the factor counts.
        """
        if metallic is None and roughness is None:
            return None
        images = {source.texture.image for source in (metallic, roughness) if source}
        if len(images) == 1 and (not metallic or metallic.output == "b") and (not roughness or roughness.output == "g"):
            whole = metallic and roughness
            if whole or _has_neutral(self.images[images.pop()], "b" if metallic is None else "g"):
                return (metallic or roughness).texture  # type: ignore[union-attr]
        made = _merge(self._of(metallic), self._of(roughness))
        if made is None:
            self.notes.append("a texture of metallic or roughness cannot be decoded; it was left out")
            return None
        self.images.append(made)
        return replace((roughness or metallic).texture, image=len(self.images) - 1)  # type: ignore[union-attr]

    def _of(self, source: Source | None) -> tuple[Image, str] | None:
        return (self.images[source.texture.image], source.output) if source else None

    def _load(self, asset: Any) -> int | None:
        from pxr import Ar

        name = Ar.SplitPackageRelativePathInner(asset.path)[1] or asset.path
        data, reason = self._bytes(asset)
        if data is None:
            self.notes.append(f"texture {name} {reason}; it was left out")
            return None
        plain = Path(name.replace("\\", "/"))
        try:
            image = Image(plain.name, MEDIA_TYPES.get(plain.suffix.lower(), "application/octet-stream"), data)
        except InputError as exc:
            self.notes.append(f"texture {name} was left out: {exc}")
            return None
        self.images.append(image)
        return len(self.images) - 1

    def _load_row(self, assets: Sequence[Any]) -> int | None:
        """An image with a picture for each frame; None, and a note, if the first cannot be used."""
        first = self._load(assets[0])
        if first is None:
            return None
        files = [(self.images[first].media_type, self.images[first].data)]
        paths, known = [Path(assets[0].resolvedPath)], {assets[0].path: 0}
        for frame, asset in enumerate(assets[1:], 1):
            path = "" if asset is None else asset.path
            if path not in known:
                data, reason = (None, "is not named") if asset is None else self._bytes(asset)
                if data is None:
                    self.notes.append(
                        f"texture {path} of frame {self.first + frame} {reason}; that of the frame before is shown"
                    )
                known[path] = frame if data is not None else frame - 1
                files.append(files[-1] if data is None else (MEDIA_TYPES.get(Path(path).suffix.lower(), ""), data))
                paths.append(paths[-1] if data is None else Path(asset.resolvedPath))
            else:
                files.append(files[known[path]])
                paths.append(paths[known[path]])
        if len({data for _, data in files}) == 1:
            return first
        is_packed = any(not path.is_file() for path in paths)
        row: Pictures = BytesPictures(files, self.first) if is_packed else FilePictures(paths, self.first)
        self.images[first] = replace(self.images[first], data=b"", pictures=row)
        return first

    def _bytes(self, asset: Any) -> tuple[bytes | None, str]:
        from pxr import Ar

        resolved = asset.resolvedPath
        if "<UDIM>" in asset.path:
            return None, "is a set of tiles"
        if not resolved:
            return None, "is missing"
        if not is_inside(resolved, self._folder):
            return None, "lies outside of the file's folder"
        opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if not opened:
            return None, "cannot be read"
        if opened.GetSize() > MAX_BYTES:
            return None, f"has {opened.GetSize()} bytes, more than {MAX_BYTES}"
        return bytes(opened.GetBuffer()), ""


def _merge(metallic: tuple[Image, str] | None, roughness: tuple[Image, str] | None) -> Image | None:
    """A picture of both, of the larger one's size."""
    from PIL import Image as Pillow

    planes, names = {}, []
    for channel, given in ((2, metallic), (1, roughness)):
        if given is None:
            continue
        try:
            picture = eight_bits(Pillow.open(io.BytesIO(given[0].data))).convert("RGBA")
        except Exception:  # damaged pictures raise nearly anything inside Pillow
            return None
        planes[channel] = picture.getchannel(CHANNELS.get(given[1], 0))
        names.append(Path(given[0].name).stem)
    size = max((plane.size for plane in planes.values()), key=lambda each: each[0] * each[1])
    bands = [planes[k].resize(size) if k in planes else Pillow.new("L", size, 255) for k in range(3)]
    stream = io.BytesIO()
    Pillow.merge("RGB", bands).save(stream, "PNG")
    return Image("_".join(dict.fromkeys(names)) + "_metallic_roughness.png", "image/png", stream.getvalue())


def _has_neutral(image: Image, channel: str) -> bool:
    """Whether a channel is 1 everywhere, so that a factor alone says what is there."""
    from PIL import Image as Pillow

    try:
        picture = eight_bits(Pillow.open(io.BytesIO(image.data))).convert("RGB")
        low, _ = picture.getchannel(CHANNELS[channel]).getextrema()
    except Exception:
        return False
    return bool(low == 255)
