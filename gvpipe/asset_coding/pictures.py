"""Images made smaller on request: a largest side, and another format. Without a request their bytes stay as they are."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from typing import Self

from gvpipe.asset.grey import eight_bits
from gvpipe.asset.material import Image
from gvpipe.asset_coding.moving_textures import SmallerPictures
from gvpipe.foundation.errors import InputError, SettingError

FORMATS = {"webp": "image/webp", "jpeg": "image/jpeg", "png": "image/png"}
QUALITY = 90  # of WebP and JPEG
MOST_SIDES = {"webp": 16383, "jpeg": 65500}  # pixels that a format, or its library, has a place for


@dataclass(frozen=True)
class TextureLimit:
    """What images may be.

    Args:
        side: largest side, pixels; 0: any.
        format: ``"webp"``, ``"jpeg"`` or ``"png"``; ``""``: as it is.
    """

    side: int = 0
    format: str = ""

    @classmethod
    def parse(cls, given: int | str | None) -> Self:
        """Return what ``1024``, ``"1024"``, ``"webp"`` or ``"1024,webp"`` asks for; raises `SettingError`."""
        side, picture_format = 0, ""
        for word in () if given is None else str(given).lower().split(","):
            if word.strip() in FORMATS:
                picture_format = word.strip()
            elif word.strip().isdecimal() and 1 <= int(word) <= 1 << 14:
                side = int(word)
            else:
                raise SettingError(
                    f"textures are {given!r}; a side of 1..16384 pixels, {', '.join(FORMATS)} or 1024,webp is needed"
                )
        return cls(side, picture_format)


def limit_image(image: Image, limit: TextureLimit) -> Image:
    """Return an image within the limit; its bytes are unchanged if they are already. The format is not that of moving images.

    Raises:
        InputError: Pillow cannot open it.
    """
    if image.pictures is not None:
        is_large = limit.side and max(image.pictures.size) > limit.side
        return replace(image, pictures=SmallerPictures(image.pictures, limit.side)) if is_large else image
    if not limit.side and limit.format in ("", image.media_type.removeprefix("image/")):
        return image
    from PIL import Image as Pillow

    try:
        with Pillow.open(io.BytesIO(image.data)) as opened:
            is_small = not limit.side or max(opened.size) <= limit.side
            if is_small and limit.format in ("", image.media_type.removeprefix("image/")):
                return image
            picture: Pillow.Image = eight_bits(opened).convert("RGBA" if opened.has_transparency_data else "RGB")
    except (OSError, ValueError, SyntaxError, Pillow.DecompressionBombError) as exc:
        raise InputError(
            f"image {image.name!r} cannot be opened ({exc}); leave out the limit of textures, or export it"
        ) from exc
    if not is_small:
        picture.thumbnail((limit.side, limit.side), Pillow.Resampling.LANCZOS)
    chosen = limit.format or image.media_type.removeprefix("image/")
    most = MOST_SIDES.get(chosen, max(picture.size))
    if max(picture.size) > most:
        raise InputError(
            f"image {image.name!r} has {picture.width} x {picture.height} pixels; {chosen} holds {most} a side: "
            f"give a side, too (textures {most},{chosen})"
        )
    try:
        data = _pack(picture, chosen)
    except (OSError, ValueError) as exc:
        raise InputError(f"image {image.name!r} cannot be written as {chosen} ({exc}); choose another format") from exc
    return replace(image, media_type=FORMATS.get(chosen, FORMATS["png"]), data=data)


def _pack(picture: object, chosen: str) -> bytes:
    from PIL import Image as Pillow

    assert isinstance(picture, Pillow.Image)
    file = io.BytesIO()
    if chosen == "jpeg":
        picture.convert("RGB").save(file, "JPEG", quality=QUALITY, optimize=True)
    elif chosen == "webp":
        picture.save(file, "WEBP", quality=QUALITY, method=6)
    else:
        picture.save(file, "PNG", optimize=True)
    return file.getvalue()
