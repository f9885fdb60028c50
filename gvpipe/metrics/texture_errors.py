"""How far the colours of two animations are from each other, as peak signal-to-noise ratios.

Pictures are compared texel by texel where both sides show the same places by them. Else colours are compared on the surfaces:
those of the points that D1 samples, with those of the nearest places on the other surface. MPEG's software compares colours of
point clouds alike (`gvpipe.metrics.point_clouds`), from sample to sample. Here a nearest place lies anywhere on a triangle, so
that no difference comes from samples alone. Formulas are in ``docs/metrics.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gvpipe.asset.material import Image
from gvpipe.foundation.arrays import Float64, Int64, UInt8
from gvpipe.foundation.errors import GvpipeError
from gvpipe.metrics.asset_errors import AssetErrors
from gvpipe.metrics.point_clouds import BEST_PSNR, GRID, Cloud, make_clouds, measured_points
from gvpipe.metrics.surface import scale_of
from gvpipe.metrics.triangle_search import closest_weights
from gvpipe.metrics.triangle_tree import build_tree, find_nearest
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.surface_colours import SurfaceColours, has_paint
from gvpipe.rasterizer.textures import decode_frame, decode_image

LEVELS = 255.0  # the peak
LUMA = np.array([0.2126, 0.7152, 0.0722])  # of sRGB bytes: Rec. ITU-R BT.709, section 3.2
SAME_UV = 0.01  # largest difference of texture coordinates with which pictures are compared, parts of a picture
SURFACE = "(surface)"

Squared = tuple[float, float]
"""Mean squared differences of red, green and blue, and of luma, squared levels of 255."""


@dataclass(frozen=True)
class TextureErrors:
    """Ratios of a picture, or of the colours of a surface, dB, at most 99.99; None: not decoded, or one side lacks it.

    Args:
        rgb_psnr, luma_psnr: the mean over frames.
        rgb_psnr_worst, luma_psnr_worst: the least of all frames.
        frames: ``rgb_psnr`` and ``luma_psnr`` of each frame; of one, where nothing moves.
    """

    rgb_psnr: float | None
    rgb_psnr_worst: float | None
    luma_psnr: float | None
    luma_psnr_worst: float | None
    frames: list[dict[str, float | None]]


def compare_textures(reference: MeshSequence, distorted: MeshSequence, attributes: AssetErrors) -> dict[str, TextureErrors]:
    """Measure the pictures of two sequences of the same triangles, by name, or their surfaces if these show them otherwise.

    Args:
        reference, distorted: the sequences.
        attributes: how far their attributes differ, among which are texture coordinates.
    """
    if not (reference.images or distorted.images):
        return {}
    if not _show_alike(reference, distorted, attributes):
        return compare_surface_colours(Capture([reference], reference.name), Capture([distorted], distorted.name))
    return {
        _name(reference.images, k): _errors(_of_pictures(*both, reference.n_frames))
        for k, both in enumerate(zip(reference.images, distorted.images, strict=True))
    }


def compare_surface_colours(reference: Capture, distorted: Capture) -> dict[str, TextureErrors]:
    """Measure the colours of two surfaces, frame by frame; nothing, where neither side has several colours."""
    frames = range(len(reference) if _moves(reference) or _moves(distorted) else 1)
    found: list[Squared | None] = []
    painted = False
    for k in frames:
        one, other = reference.frame(k), distorted.frame(k)
        has = has_paint(one), has_paint(other)
        painted |= any(has)
        found.append(_of_surfaces(one, other) if all(has) else None)
    return {SURFACE: _errors(found)} if painted else {}


def _moves(capture: Capture) -> bool:
    return len(capture.shots) > 1 or any(image.is_moving for image in capture.shots[0].images)


def _name(images: tuple[Image, ...], number: int) -> str:
    """An image's name, or its number where it has none of its own."""
    name = images[number].name
    return name if name and sum(each.name == name for each in images) == 1 else f"image {number}"


def _show_alike(reference: MeshSequence, distorted: MeshSequence, attributes: AssetErrors) -> bool:
    """Whether both have as many pictures, of the same sizes, and the same texture coordinates."""
    sizes = [[image.size for image in each.images] for each in (reference, distorted)]
    coordinates = {texture.uv for each in reference.materials for texture in each.textures.values()}
    largest = [attributes.get(name, {}).get("max") for name in coordinates]
    return sizes[0] == sizes[1] and all(each is not None and each <= SAME_UV for each in largest)


def _of_pictures(one: Image, other: Image, n_frames: int) -> list[Squared | None]:
    """Differences of each frame; of one, if both pictures stand still."""
    if not (one.is_moving or other.is_moving):
        same = one.data == other.data
        return [(0.0, 0.0) if same else _apart(_texels(one, 0), _texels(other, 0))]
    return [_apart(_texels(one, frame), _texels(other, frame)) for frame in range(n_frames)]


def _texels(image: Image, frame: int) -> Float64 | None:
    """The colours ``(n, 3)`` of a frame's picture, levels of 255; None if it cannot be decoded."""
    try:
        pixels = decode_image(image) if image.pictures is None else decode_frame(image.pictures, frame)
    except GvpipeError:
        return None
    if isinstance(pixels, str):
        return None
    return pixels[..., :3].reshape(-1, 3) * (LEVELS / np.iinfo(pixels.dtype).max)


def _of_surfaces(one: MeshSequence, other: MeshSequence) -> Squared | None:
    """Differences of one frame of each, the larger of both ways."""
    corners = [each.read_absolute(0, 1)[0][each.faces] for each in (one, other)]
    if not all(map(len, corners)):
        return None
    scale = scale_of(corners[0].reshape(-1, 3))
    clouds = make_clouds(corners[0], corners[1], scale.low, scale.peak, GRID)
    colours = [SurfaceColours(each) for each in (one, other)]
    if any(each.notes for each in colours) or not all(len(cloud.points) for cloud in clouds):
        return None
    there, back = _one_way(*clouds, *colours), _one_way(*clouds[::-1], *colours[::-1])
    return max(there[0], back[0]), max(there[1], back[1])


def _one_way(source: Cloud, target: Cloud, own: SurfaceColours, others: SurfaceColours) -> Squared:
    points, triangles = measured_points(source)
    nearest = find_nearest(build_tree(target.corners), points).triangles

    def at(cloud: Cloud, colours: SurfaceColours, chosen: Int64) -> UInt8:
        return colours.at(chosen.astype(np.int32), closest_weights(points, cloud.corners[chosen]))

    found = _apart(at(source, own, triangles), at(target, others, nearest))
    assert found is not None
    return found


def _apart(one: UInt8 | Float64 | None, other: UInt8 | Float64 | None) -> Squared | None:
    """Mean squared differences of colours ``(n, 3)``."""
    if one is None or other is None or one.shape != other.shape:
        return None
    apart = one.astype(np.float64) - other
    return float(np.square(apart).mean()), float(np.square(apart @ LUMA).mean())


def _errors(found: Iterable[Squared | None]) -> TextureErrors:
    frames = [(None, None) if each is None else (_psnr(each[0]), _psnr(each[1])) for each in found]
    known = [each for each in frames if each[0] is not None]
    rgb, luma = ([float(each[k]) for each in known] for k in (0, 1))
    rows = [{"rgb_psnr": each[0], "luma_psnr": each[1]} for each in frames]
    if not known:
        return TextureErrors(None, None, None, None, rows)
    return TextureErrors(math.fsum(rgb) / len(rgb), min(rgb), math.fsum(luma) / len(luma), min(luma), rows)


def _psnr(squared: float) -> float:
    """``10 log10(255^2 / mse)``, dB."""
    return min(BEST_PSNR, 10 * math.log10(LEVELS**2 / squared)) if squared > 0 else BEST_PSNR
