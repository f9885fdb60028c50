from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from gvpipe.asset.material import Image, image_size
from gvpipe.asset_coding.pictures import MOST_SIDES, TextureLimit, limit_image
from gvpipe.foundation.errors import InputError, SettingError


def made(width: int = 64, height: int = 32, kind: str = "PNG", mode: str = "RGB") -> Image:
    pixels = np.random.default_rng(1).integers(0, 255, (height, width, len(mode)), np.uint8)
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, kind)
    return Image("a", f"image/{kind.lower()}", file.getvalue())


def test_what_is_within_the_limit_keeps_its_bytes() -> None:
    image = made()
    assert limit_image(image, TextureLimit()) is image
    assert limit_image(image, TextureLimit(64)) is image
    assert limit_image(image, TextureLimit(64, "png")) is image


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_smaller_in_its_own_format(kind: str) -> None:
    small = limit_image(made(kind=kind), TextureLimit(16))
    assert image_size(small.data) == (16, 8)
    assert small.media_type == f"image/{kind.lower()}"
    assert Pillow.open(io.BytesIO(small.data)).format == kind


def test_another_format_keeps_transparency() -> None:
    changed = limit_image(made(mode="RGBA"), TextureLimit.parse("webp"))
    assert changed.media_type == "image/webp"
    assert Pillow.open(io.BytesIO(changed.data)).mode == "RGBA"
    assert image_size(changed.data) == (64, 32)


def test_a_picture_that_cannot_be_opened() -> None:
    broken = Image("a", "image/png", made().data[:40])
    with pytest.raises(InputError, match="image 'a' cannot be opened"):
        limit_image(broken, TextureLimit(16))


@pytest.mark.parametrize("given", ["0", "20000", "gif", "1024,,", "-3"])
def test_what_is_no_limit(given: str) -> None:
    with pytest.raises(SettingError, match="textures are"):
        TextureLimit.parse(given)


def test_limits() -> None:
    assert TextureLimit.parse(None) == TextureLimit()
    assert TextureLimit.parse(1024) == TextureLimit(1024)
    assert TextureLimit.parse("512, webp") == TextureLimit(512, "webp")


@pytest.mark.parametrize("picture_format", ["webp", "jpeg"])
def test_a_picture_that_a_format_cannot_hold(picture_format: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MOST_SIDES, picture_format, 50)
    with pytest.raises(InputError, match=rf"64 x 32 pixels; {picture_format} holds 50 a side: .*textures 50,{picture_format}"):
        limit_image(made(), TextureLimit.parse(picture_format))
    assert image_size(limit_image(made(), TextureLimit.parse(f"50,{picture_format}")).data) == (50, 25)


def test_the_largest_webp() -> None:
    wide = made(16384, 1)
    with pytest.raises(InputError, match="16384 x 1 pixels; webp holds 16383 a side"):
        limit_image(wide, TextureLimit.parse("webp"))
