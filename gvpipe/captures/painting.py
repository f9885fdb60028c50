"""The look of frames that have meshes of their own, as a moving texture of the key mesh that follows them.

A texel of the key's atlas is a point of the key mesh. At each frame it takes the colour of the closest place on the frame's own
mesh: the material's, its texture's and its vertices' together, in linear light, as the renderer mixes them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import Material, with_uv
from gvpipe.asset.moving import png_of
from gvpipe.asset.part import Part
from gvpipe.asset.placement import from_upper_left
from gvpipe.captures.followed_frames import FollowedFrames
from gvpipe.following.atlas import FILLED, Atlas, make_atlas
from gvpipe.following.surface import vertex_normals
from gvpipe.following.texels import Texels
from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.model.moving_texture import with_pictures
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.surface_colours import COLOUR, SurfaceColours, has_paint, used_materials
from gvpipe.runtime.ahead import run_ahead

UV = "uv"
IMAGE = "colours"
PER_VERTEX = 16.0  # texels for each vertex of a frame whose vertices have the colours: a video has a quarter as many of hue
MOST_TEXELS = 1 << 24  # of an atlas: 4096 x 4096
BLOCK = 1 << 16  # texels that are painted at a time
KEPT = "--track off keeps pictures as they are"
UNSEEN = 128  # level of texels that no triangle shows, which the coder fills


def paint_names(frame: MeshSequence) -> set[str]:
    """Names of the attributes that a frame's colours come from."""
    return {COLOUR} | {each.base_color_texture.uv for each in frame.materials if each.base_color_texture is not None}


def left_of_looks(frame: MeshSequence) -> list[str]:
    """What of a frame's materials no picture of colours can hold, by name."""
    roles = {role for each in frame.materials for role in each.textures} - {"base_color_texture"}
    lost = [role.replace("_", " ") for role in sorted(roles)]
    shown = {each.base_color_texture.image for each in frame.materials if each.base_color_texture is not None}
    lost += ["pictures that cannot be decoded"] if any(frame.images[number].size is None for number in shown) else []
    lost += ["alpha"] if any(each.alpha_mode != "opaque" for each in frame.materials) else []
    return lost + (["materials but the first"] if len({_but_colour(each) for each in used_materials(frame)}) > 1 else [])


def _but_colour(material: Material) -> Material:
    """What of a material is one for all of a followed mesh."""
    bare = with_uv((material,), ())[0]
    return replace(bare, name="", base_color=(1.0, 1.0, 1.0, 1.0), alpha_mode="opaque", alpha_cutoff=0.5)


def picture_size(sequence: MeshSequence) -> tuple[int, int]:
    """Width and height of a followed run's pictures, pixels; 0 if there are none."""
    sizes = [image.size for image in sequence.images if image.is_moving]
    return max((size for size in sizes if size), default=(0, 0))


def with_looks(sequence: MeshSequence, followed: FollowedFrames) -> MeshSequence:
    """A followed run with the look of its frames: a material, and a texture that moves as their colours do.

    Args:
        sequence: the run's, positions relative to its origin.
        followed: its frames.

    Raises:
        InputError: xatlas hung or died.
    """
    key = followed.frames.frame(followed.key)
    used = used_materials(key)
    if not used and not has_paint(key):
        return sequence
    material = with_uv((used[0],), ())[0] if used else Material(name=IMAGE, double_sided=True)
    part = Part("", (0, sequence.n_vertices), (0, len(sequence.faces)), material=0)
    if not has_paint(key):
        return replace(sequence, materials=(material,), parts=(part,))
    atlas = make_atlas(followed.followed(followed.key), followed.faces, _n_texels(key))
    uv = Attribute(atlas.uv.astype(np.float32), "corner", "uv", atlas.corners.ravel())
    opaque = replace(material, base_color=(1.0, 1.0, 1.0, 1.0), alpha_mode="opaque")
    bare = replace(sequence, attributes={**sequence.attributes, UV: uv}, materials=(opaque,), parts=(part,))
    return with_pictures(bare, FollowedPictures(followed, atlas), IMAGE)


def _n_texels(frame: MeshSequence) -> float:
    """Texels of an atlas that shows the surface as finely as a frame's pictures do, or its vertices; never more than those."""
    shown = 0.0
    held: dict[int, int] = {}
    for part in frame.parts:
        texture = None if part.material is None else frame.materials[part.material].base_color_texture
        uv = None if texture is None else frame.attributes.get(texture.uv)
        size = None if texture is None else frame.images[texture.image].size
        if texture is None or uv is None or size is None:
            continue
        held[texture.image] = size[0] * size[1]
        rows, faces = np.asarray(uv, np.float64), slice(*part.triangles)
        corners = rows[frame.faces[faces]] if uv.domain == "vertex" else rows.reshape(-1, 3, rows.shape[1])[faces]
        texels = from_upper_left(texture, corners) * size
        one, two = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
        shown += float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum()) / 2
    n_texels = min(shown / FILLED, float(sum(held.values()))) if held else PER_VERTEX * frame.n_vertices / FILLED
    return float(np.clip(n_texels, 1, MOST_TEXELS))


class FollowedPictures:
    """A picture of a key mesh's atlas for each frame (`gvpipe.asset.moving.Pictures`), painted when it is asked for.

    Args:
        followed: frames as they came, and the key mesh at each of them.
        atlas: of the key mesh.
    """

    def __init__(self, followed: FollowedFrames, atlas: Atlas) -> None:
        self._followed, self._atlas = followed, atlas
        self._texels = Texels(atlas, followed.followed(followed.key), followed.faces)
        self._last: tuple[int, UInt8] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._atlas.width, self._atlas.height

    def __len__(self) -> int:
        return len(self._followed)

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`: a PNG."""
        return "image/png", png_of(self.pixels(frame))

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`."""
        last = self._last
        if last is None or last[0] != frame:
            self._last = last = frame, self._paint(frame)
        return last[1]

    def _paint(self, frame: int) -> UInt8:
        own, mesh = self._followed.own(frame)
        positions = self._followed.followed(frame)
        normals = vertex_normals(positions, self._followed.faces)
        colours = SurfaceColours(own)
        if colours.notes:
            raise InputError(f"{own.name}: frame {frame} of a run that is followed: {colours.notes[0]}; {KEPT}")
        result = np.full((self._atlas.height * self._atlas.width, 3), UNSEEN, np.uint8)

        def fill(span: slice) -> None:
            places = mesh.places(*self._texels.at(positions, normals, span))
            result[self._texels.where[span]] = colours.at(places.triangles.astype(np.int32), places.weights)

        spans = [slice(at, at + BLOCK) for at in range(0, len(self._texels), BLOCK)]
        for _ in run_ahead(fill, spans):
            pass
        return result.reshape(self._atlas.height, self._atlas.width, 3)
