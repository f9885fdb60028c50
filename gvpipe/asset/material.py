"""Materials after glTF's metallic-roughness model, and the images that their textures show.

Source: Khronos, glTF 2.0 specification, section 3.9 (materials), and its extensions KHR_texture_transform, KHR_materials_unlit,
_emissive_strength, _clearcoat, _transmission, _volume, _ior, _specular, _sheen, _iridescence, _anisotropy, _dispersion and
_diffuse_transmission.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from dataclasses import field as member
from typing import Any

from gvpipe.asset.attribute import check_word
from gvpipe.asset.moving import Pictures, SomePictures, as_pictures
from gvpipe.asset.plain import from_plain, to_plain
from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import InputError

ALPHA_MODES = ("opaque", "mask", "blend")
WRAPS = ("repeat", "mirror", "clamp")
FILTERS = ("linear", "nearest")
MAX_SIDE = 16384  # pixels of an image
MOVING = "video/mp4"  # media type of moving images, which files hold as video
MAX_FACTOR = 1e9  # magnitude of a material's numbers
SIGNATURES = (  # first bytes of pictures
    b"\x89PNG\r\n\x1a\n",
    b"\xff\xd8\xff",  # JPEG
    b"RIFF",  # WebP
    b"\xabKTX 20\xbb\r\n\x1a\n",
    b"\x76\x2f\x31\x01",  # OpenEXR
    b"BM",
    b"GIF8",
    b"II*\0",  # TIFF
    b"MM\0*",
    b"DDS ",
)


@dataclass(frozen=True)
class Image:
    """A picture as it came, or a moving image: a picture for each frame.

    Args:
        name: for people, and for the file that it is written to.
        media_type: such as ``"image/png"``; `MOVING` of a moving image.
        data: the file's bytes; none of a moving image.
        pictures: of a moving image: an array ``(F, height, width, 3) uint8``, or `gvpipe.asset.moving.Pictures`.

    Raises:
        InputError: they are no picture, or one of more than `MAX_SIDE` pixels a side.
    """

    name: str
    media_type: str = ""
    data: bytes = b""
    pictures: Pictures | None = member(default=None, compare=False)

    def __post_init__(self) -> None:
        if self.pictures is not None:
            object.__setattr__(self, "pictures", as_pictures(self.pictures))
            object.__setattr__(self, "media_type", MOVING)
        check_image(self)

    def __repr__(self) -> str:
        if self.pictures is not None:
            width, height = self.pictures.size
            return f"<Image {self.name}: {len(self.pictures)} pictures of {width}x{height}>"
        return f"<Image {self.name}: {self.media_type}, {len(self.data)} bytes>"

    @property
    def is_moving(self) -> bool:
        """Whether each frame has a picture of its own."""
        return self.pictures is not None

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height in pixels; None where Pillow cannot open it."""
        return image_size(self.data) if self.pictures is None else self.pictures.size

    def frame(self, number: int) -> Image:
        """The picture of a frame as an image that stands still, itself if it does; raises as `Pictures.file`."""
        return self if self.pictures is None else Image(self.name, *self.pictures.file(number))

    def part(self, start: int, stop: int) -> Image:
        """The image of the frames ``start`` to ``stop``."""
        return self if self.pictures is None else replace(self, pictures=SomePictures(self.pictures, start, stop))


@dataclass(frozen=True)
class Texture:
    """How a material shows an image.

    Args:
        image: index into the sequence's images.
        uv: name of the attribute with its coordinates; (0, 0) is the lower left of the image, as in OBJ and USD.
        scale: of normals, or strength of occlusion.
        wrap: beyond 0..1 along u and v: ``"repeat"``, ``"mirror"`` or ``"clamp"``.
        filter: ``"linear"`` or ``"nearest"``.
        offset, rotation, tiling: as KHR_texture_transform has them, of coordinates (u, 1 - v) from the upper left:
            offset + R(rotation, radians) (tiling * coordinates).
    """

    image: int
    uv: str = "uv"
    scale: float = 1.0
    wrap: tuple[str, str] = ("repeat", "repeat")
    filter: str = "linear"
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    tiling: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class Material:
    """How a part looks.

    Args:
        name: for people.
        base_color: linear RGBA, 0..1.
        base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture, emissive_texture: or None.
        metallic, roughness: 0..1.
        emissive: linear RGB.
        alpha_mode: ``"opaque"``, ``"mask"`` (cut out below ``alpha_cutoff``) or ``"blend"``.
        double_sided: whether back faces show.
        unlit: whether it shows its base colour without light.
        emissive_strength: factor of ``emissive`` that is in it already, as KHR_materials_emissive_strength has it.
        clearcoat, clearcoat_roughness: 0..1, a layer above all; ``clearcoat_normal_texture`` is its own.
        transmission: 0..1, light that passes.
        thickness, attenuation_distance: model units, 0: a thin wall, a medium without loss; attenuation_color: linear RGB.
        ior: index of refraction.
        specular: 0..1, specular_color: linear RGB, of reflections of what is no metal.
        sheen_color: linear RGB, sheen_roughness: 0..1, of cloth.
        iridescence: 0..1, iridescence_ior, iridescence_thickness_minimum, iridescence_thickness_maximum (nm): of a thin film.
        anisotropy_strength: 0..1, anisotropy_rotation: radians.
        dispersion: 20 over the Abbe number.
        diffuse_transmission: 0..1, diffuse_transmission_color: linear RGB, light that passes and is scattered.
        other fields that end in ``_texture``: as the factor of that name, or None.
    """

    name: str = ""
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    base_color_texture: Texture | None = None
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_roughness_texture: Texture | None = None
    normal_texture: Texture | None = None
    occlusion_texture: Texture | None = None
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emissive_texture: Texture | None = None
    alpha_mode: str = "opaque"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False
    emissive_strength: float = 1.0
    clearcoat: float = 0.0
    clearcoat_texture: Texture | None = None
    clearcoat_roughness: float = 0.0
    clearcoat_roughness_texture: Texture | None = None
    clearcoat_normal_texture: Texture | None = None
    transmission: float = 0.0
    transmission_texture: Texture | None = None
    thickness: float = 0.0
    thickness_texture: Texture | None = None
    attenuation_distance: float = 0.0
    attenuation_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ior: float = 1.5
    specular: float = 1.0
    specular_texture: Texture | None = None
    specular_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    specular_color_texture: Texture | None = None
    sheen_color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sheen_color_texture: Texture | None = None
    sheen_roughness: float = 0.0
    sheen_roughness_texture: Texture | None = None
    iridescence: float = 0.0
    iridescence_texture: Texture | None = None
    iridescence_ior: float = 1.3
    iridescence_thickness_minimum: float = 100.0
    iridescence_thickness_maximum: float = 400.0
    iridescence_thickness_texture: Texture | None = None
    anisotropy_strength: float = 0.0
    anisotropy_rotation: float = 0.0
    anisotropy_texture: Texture | None = None
    dispersion: float = 0.0
    diffuse_transmission: float = 0.0
    diffuse_transmission_texture: Texture | None = None
    diffuse_transmission_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    diffuse_transmission_color_texture: Texture | None = None

    @property
    def textures(self) -> dict[str, Texture]:
        """Its textures by field name."""
        named = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value for name, value in named if isinstance(value, Texture)}


def with_uv(materials: tuple[Material, ...], names: Collection[str]) -> tuple[Material, ...]:
    """Return the materials without the textures whose coordinates are none of the attributes ``names``."""
    gone = [[role for role, texture in each.textures.items() if texture.uv not in names] for each in materials]
    none: list[dict[str, Any]] = [dict.fromkeys(roles) for roles in gone]
    return tuple(replace(each, **changes) for each, changes in zip(materials, none, strict=True))


def check_materials(materials: tuple[Material, ...], n_images: int, where: str) -> tuple[Material, ...]:
    """Return the materials; raise `InputError` for an image index out of range, a type, a word or a number that cannot be."""
    return tuple(_check_material(material, n_images, f"{where}: material {k}") for k, material in enumerate(materials))


def _check_material(given: Material, n_images: int, name: str) -> Material:
    if not isinstance(given, Material):
        raise TypeError(f"{name} is {show(given)}; a gvpipe.Material is needed")
    material: Material = from_plain(Material, to_plain(given), name)  # every field of its type
    name = f"{name} ({material.name!r})"
    check_word("alpha mode", material.alpha_mode, ALPHA_MODES, name)
    for field in fields(material):
        value = getattr(material, field.name)
        numbers = value if isinstance(value, tuple) else (value,) if isinstance(value, float) else ()
        count = len(field.default) if isinstance(field.default, tuple) else len(numbers)
        if len(numbers) != count or not _are_numbers(numbers):
            raise InputError(f"{name}: {field.name} has too few factors, or one that is not a number up to {MAX_FACTOR:g}")
    for role, texture in material.textures.items():
        if not 0 <= texture.image < n_images:
            raise InputError(f"{name}: {role} shows image {texture.image}; there are {n_images} images")
        if not _are_numbers((texture.scale, texture.rotation, *texture.offset, *texture.tiling)):
            raise InputError(f"{name}: {role} is moved by something that is not a number up to {MAX_FACTOR:g}")
        check_word("filter", texture.filter, FILTERS, name)
        for wrap in texture.wrap:
            check_word("wrap", wrap, WRAPS, name)
    return material


def _are_numbers(values: tuple[float, ...]) -> bool:
    return all(math.isfinite(value) and abs(value) <= MAX_FACTOR for value in values)


def check_image(image: Image) -> None:
    """Raise `InputError` unless the bytes are a picture of at most `MAX_SIDE` pixels a side, or pictures are of such a size.

    A picture that Pillow cannot open is checked by its first bytes alone.
    """
    if image.pictures is None and not any(image.data.startswith(signature) for signature in SIGNATURES):
        raise InputError(
            f"image {image.name!r} ({image.media_type}, {len(image.data)} bytes) is not a picture; export it as PNG or JPEG"
        )
    if image.pictures is not None and (image.data or not len(image.pictures)):
        raise InputError(f"moving image {image.name!r} has no picture, or bytes beside them; give pictures alone")
    size = image.size
    if size and max(size) > MAX_SIDE:
        raise InputError(
            f"image {image.name!r} has {size[0]} x {size[1]} pixels; at most {MAX_SIDE} a side are allowed, so make it smaller"
        )


def image_size(data: bytes) -> tuple[int, int] | None:
    """Width and height in pixels, or None where Pillow cannot open it; no pixel is decoded."""
    import io
    import warnings

    from PIL import Image as Pillow

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, whose side is checked instead
            with Pillow.open(io.BytesIO(data)) as opened:
                width, height = opened.size
                return width, height
    except Exception:  # damaged files raise nearly anything inside Pillow
        return None
