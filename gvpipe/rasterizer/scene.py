"""What the kernels of the rasterizer work on, in named tuples, which numba takes as they are.

V vertices, T triangles, P points (corners that share a normal share one), M materials; H and W count samples. Picture axes are
right, up, and towards the eye; their origin is the camera's target.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Float32, Float64, Int32, Int64, UInt8
from gvpipe.rasterizer.textures import NO_TEXELS, Texels

ROLES = ("base_color_texture", "metallic_roughness_texture", "occlusion_texture", "emissive_texture", "normal_texture")
BASE, METALLIC_ROUGHNESS, OCCLUSION, EMISSIVE, NORMAL = range(len(ROLES))
CULLED, UNLIT, TESTED, BLENDED, CLAY = 1, 2, 4, 8, 16  # flags of a material; `Look` says what they mean


class View(NamedTuple):
    """A camera as the projection uses it.

    Args:
        rotation: ``(3, 3) float64``; rows are the picture axes in world axes.
        target: ``(3,) float64``, model units.
        distance: from the eye to the target, model units.
        focal: samples that one model unit spans at depth one.
        width, height: of the picture, samples.
    """

    rotation: Float64
    target: Float64
    distance: float
    focal: float
    width: int
    height: int


class Projection(NamedTuple):
    """Where vertices are in the picture.

    Args:
        seen: ``(V, 3) float64``, picture axes, model units.
        snapped: ``(V, 2) int64``, across and down, in 1/256 of a sample.
        nearness: ``(V,) float64``, distance / depth; 0 where a vertex cannot be seen.
    """

    seen: Float64
    snapped: Int64
    nearness: Float64


class ZBuffer(NamedTuple):
    """What each sample sees, layer after layer: see-through surfaces from the nearest on, then the opaque one.

    Args:
        depths: ``(L, H, W) float32``, the nearness of the layer's surface.
        triangles: ``(L, H, W) int32``, -1 for none.
    """

    depths: Float32
    triangles: Int32


class Scene(NamedTuple):
    """One frame, ready to be shaded.

    Args:
        faces: ``(T, 3) int32``, vertices.
        points: ``(T, 3) int32``, the normals of the corners.
        projection: of the vertices.
        distance: from the eye to the target, model units.
        face_normals: ``(T, 3) float64``, picture axes, of any length.
        point_normals: ``(P, 3) float64``, picture axes, of length 1; P = 0 shades flat.
    """

    faces: Int32
    points: Int32
    projection: Projection
    distance: float
    face_normals: Float64
    point_normals: Float64


class Paint(NamedTuple):
    """How a surface without materials looks, and what surrounds it; linear light, 0..1.

    Args:
        front, back: ``(3,) float64``, colours of the two sides, without values.
        background: ``(3,) float64``.
        gloss: of the highlight.
        evenness: 0..1, the part of the light that comes from everywhere, so that dark colours can be told apart.
        rows: ``(T, 3) int32``, the value of each corner; T = 0 for none.
        values: ``(n,) float64`` in 0..1, shown as colours of ``ramp``; NaN: no value.
        ramp: ``(n, 3) float64``, colours of values from 0 to 1, in even steps.
        hole: ``(3,) float64``, the colour of NaN.
        codes: ``(m,) uint8``, sRGB bytes of linear light from 0 to 1, in even steps.
    """

    front: Float64
    back: Float64
    background: Float64
    gloss: float
    evenness: float
    rows: Int32
    values: Float64
    ramp: Float64
    hole: Float64
    codes: UInt8


class Look(NamedTuple):
    """The materials of a mesh; linear light, 0..1.

    Args:
        of_triangles: ``(T,) int32``, the material of each triangle; T = 0: no materials, all is `Paint`.
        flags: ``(M,) int32``: CULLED has no back side, UNLIT shows its colour without light, TESTED is left out where its alpha
            is below ``cutoffs``, BLENDED is see-through, CLAY has the two colours of `Paint`.
        cutoffs: ``(M,) float64``.
        base: ``(M, 4) float64``, linear RGBA.
        emissive: ``(M, 3) float64``.
        metallic, roughness: ``(M,) float64``.
        slots: ``(M, len(ROLES)) int32``, row of ``textures``, -1 for none.
        roles: ``(len(ROLES),) bool``, whether any material has such a texture.
        textures: ``(X, 5) int32``: image of ``texels``, row of ``uv``, wrap along u and v (0 repeats, 1 mirrors, 2 clamps),
            whether it is magnified without interpolation.
        scales: ``(X,) float64``, of normals, and the strength of occlusion.
        uv: ``(S, T, 3, 2) float32``, coordinates of corners, from the upper left of the image.
        colours: ``(T, 3, 4) float32``, linear RGBA of corners; T = 0 for none.
        texels: of all images.
    """

    of_triangles: Int32
    flags: Int32
    cutoffs: Float64
    base: Float64
    emissive: Float64
    metallic: Float64
    roughness: Float64
    slots: Int32
    roles: Bool
    textures: Int32
    scales: Float64
    uv: Float32
    colours: Float32
    texels: Texels


NO_LOOK = Look(
    of_triangles=np.zeros(0, np.int32),
    flags=np.zeros(0, np.int32),
    cutoffs=np.zeros(0),
    base=np.zeros((0, 4)),
    emissive=np.zeros((0, 3)),
    metallic=np.zeros(0),
    roughness=np.zeros(0),
    slots=np.zeros((0, len(ROLES)), np.int32),
    roles=np.zeros(len(ROLES), np.bool_),
    textures=np.zeros((0, 5), np.int32),
    scales=np.zeros(0),
    uv=np.zeros((0, 0, 3, 2), np.float32),
    colours=np.zeros((0, 3, 4), np.float32),
    texels=NO_TEXELS,
)


class Fragments(NamedTuple):
    """Places on triangles to be shaded, n of them in a row; later steps fill later arrays.

    Args:
        triangles: ``(n,) int32``, -1 for the background.
        places: ``(n, 2) int64``, across and down, in 1/256 of a sample.
        widths: ``(n,) int64``, of the square that each stands for, in 1/256 of a sample.
        counts: ``(n,) int64``, how many samples of the pixel each stands for.
        is_last: ``(n,) bool``, whether it is the farthest of its sample: what is before it is see-through.
        weights: ``(n, 3, 3) float64``, barycentric on the surface, and their changes over one width across and one down.
        outside: ``(n,) bool``, whether the front is seen.
        normals: ``(n, 3) float64``, picture axes, of length 1, on the side that is seen.
        colours: ``(n, 4) float64``, linear RGBA of the surface.
        light: ``(n, 3) float64``, linear light that reaches the eye.
        textures: ``(n,) int32``, row of `Look.textures` to sample, -1 for none.
        uv: ``(n, 3, 2) float64``, where, and its changes as those of ``weights``.
        samples: ``(len(ROLES), n, 4) float64``, what the textures show; 1 where there is none.
    """

    triangles: Int32
    places: Int64
    widths: Int64
    counts: Int64
    is_last: Bool
    weights: Float64
    outside: Bool
    normals: Float64
    colours: Float64
    light: Float64
    textures: Int32
    uv: Float64
    samples: Float64
