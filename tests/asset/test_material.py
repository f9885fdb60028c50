from __future__ import annotations

import io

import pytest
from PIL import Image as Pillow

from gvpipe.asset.material import Image, Material, Texture, check_materials, image_size
from gvpipe.foundation.errors import InputError


def picture(width: int = 2, height: int = 3, kind: str = "PNG") -> bytes:
    file = io.BytesIO()
    Pillow.new("RGB", (width, height), (255, 0, 0)).save(file, kind)
    return file.getvalue()


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_pictures(kind: str) -> None:
    image = Image("a", f"image/{kind.lower()}", picture(kind=kind))
    assert image_size(image.data) == (2, 3)
    assert "bytes" in repr(image)


def test_what_is_no_picture_is_refused() -> None:
    with pytest.raises(InputError, match="image 'a' .* is not a picture"):
        Image("a", "image/png", b"hello")
    with pytest.raises(InputError, match="is not a picture"):
        Image("a", "image/png", b"")


def test_a_picture_that_is_too_large_is_refused() -> None:
    with pytest.raises(InputError, match="16385 x 1 pixels; at most 16384"):
        Image("a", "image/png", picture(16385, 1))


def test_materials_are_checked() -> None:
    check_materials((Material(base_color_texture=Texture(0)),), 1, "mesh")
    for material, message in (
        (Material(base_color_texture=Texture(1)), "shows image 1; there are 1 images"),
        (Material(alpha_mode="glass"), "alpha mode 'glass'"),
        (Material(base_color_texture=Texture(0, wrap=("repeat", "tile"))), "wrap 'tile'"),
        (Material(normal_texture=Texture(0, filter="cubic")), "filter 'cubic'"),
        (Material(base_color_texture=Texture(0, offset=(0.0, 1e30))), "moved by something"),
        (Material(emissive=(1e30, 0, 0)), "not a number up to"),
        (Material(roughness=float("nan")), "a finite number is needed"),
        (Material(base_color_texture=5), "base_color_texture is 5"),  # type: ignore[arg-type]
        (Material(5), "name is 5"),  # type: ignore[arg-type]
    ):
        with pytest.raises(InputError, match=message):
            check_materials((material,), 1, "mesh")
