"""What the kernels of the rasterizer work on, in named tuples, which numba takes as they are.

V vertices, T triangles, P points (vertices at one position share one); H and W count samples. Picture axes are right, up, and
towards the eye; their origin is the camera's target.
"""

from __future__ import annotations

from typing import NamedTuple

from gvpipe.arrays import Float32, Float64, Int32, Int64, UInt8


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
    """What each sample sees.

    Args:
        depths: ``(H, W) float32``, the largest nearness so far.
        triangles: ``(H, W) int32``, -1 for none.
    """

    depths: Float32
    triangles: Int32


class Scene(NamedTuple):
    """One frame, ready to be shaded.

    Args:
        faces: ``(T, 3) int32``, vertices.
        points: ``(T, 3) int32``, points in place of vertices.
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


class Material(NamedTuple):
    """How a surface looks; linear light, 0..1.

    Args:
        front, back: ``(3,) float64``, colours of the two sides, without values.
        background: ``(3,) float64``.
        gloss: of the highlight.
        values: ``(V,) float64`` in 0..1, shown as colours of ``ramp``; empty for none.
        ramp: ``(n, 3) float64``, colours of values from 0 to 1, in even steps.
        codes: ``(m,) uint8``, sRGB bytes of linear light from 0 to 1, in even steps.
    """

    front: Float64
    back: Float64
    background: Float64
    gloss: float
    values: Float64
    ramp: Float64
    codes: UInt8
