"""The painter: a mesh and a camera in, a picture out, on the CPU.

A frame passes through four steps:

1. vertices are projected, and normals summed in picture axes;
2. a z-buffer finds the triangle of every sample: the opaque one, and up to `MAX_LAYERS` see-through ones before it;
3. places on triangles to be shaded are gathered, once per pixel if all its samples see the same, else once per sample;
4. each is shaded, and each pixel is the mean over its samples.

The picture is cut in bands that threads paint beside each other; a pixel's value does not depend on the bands.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from gvpipe.foundation.arrays import Float32, Floats, Int32, UInt8
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rasterizer.colours import BACK, BACKGROUND, FRONT, HOLE, srgb_codes, to_linear
from gvpipe.rasterizer.corner_normals import shared_normals
from gvpipe.rasterizer.look import Asset, look_of, see_through
from gvpipe.rasterizer.scene import NO_LOOK, Look, Paint, Projection, Scene, View, ZBuffer
from gvpipe.rasterizer.textures import MovingTexels
from gvpipe.runtime.forks import renew_after_fork

SHADINGS = ("smooth", "flat")
SIZE_RANGE = (16, 8192)  # pixels, of either side
SAMPLES_RANGE = (1, 8)  # per pixel and axis
THREADS = min(4, os.cpu_count() or 1)
BANDS = 12  # several per thread, since some are empty; each passes over all triangles, so not many
GLOSS = 0.05  # of the highlight
EVENNESS = 0.5  # of the light on a field
MAX_LAYERS = 4  # see-through surfaces that a sample shows, one behind the other


def check_size(size: tuple[int, int]) -> None:
    """Raise `InputError` for a width or height, pixels, that a picture cannot have."""
    if not all(SIZE_RANGE[0] <= side <= SIZE_RANGE[1] for side in size):
        raise InputError(f"a picture of {size[0]}x{size[1]}; sides of {SIZE_RANGE[0]} to {SIZE_RANGE[1]} pixels can be")


class Renderer:
    """Paints frames of one mesh. It keeps its buffers, so an instance serves one thread at a time.

    Args:
        faces: ``(T, 3) int32``, counter-clockwise seen from outside.
        base: ``(V, 3)``, one frame; vertices at one point of it share a normal, so that seams do not show.
        size: width and height, pixels, 16..8192.
        shading: ``"smooth"`` or ``"flat"``.
        samples: per pixel and axis, 1..8; 1 is quickest, 3 looks smooth.

    Attributes:
        notes: what a user should know, a line each, such as images that could not be decoded.

    Raises:
        InputError: a value out of its range.
    """

    def __init__(
        self, faces: Int32, base: Float32, size: tuple[int, int] = (512, 512), shading: str = "smooth", samples: int = 2
    ) -> None:
        check_size(size)
        if shading not in SHADINGS:
            raise InputError(f"shading {shading!r}; {' or '.join(SHADINGS)} is needed")
        if not SAMPLES_RANGE[0] <= samples <= SAMPLES_RANGE[1]:
            raise InputError(f"{samples} samples per pixel and axis; {SAMPLES_RANGE[0]} to {SAMPLES_RANGE[1]} are possible")
        self.notes: tuple[str, ...] = ()
        self.size, self._samples, self._smooth = size, samples, shading == "smooth"
        self._faces = np.ascontiguousarray(faces, np.int32)
        n_vertices = len(base)
        self._projection = Projection(np.zeros((n_vertices, 3)), np.zeros((n_vertices, 2), np.int64), np.zeros(n_vertices))
        self._face_normals = np.zeros((len(faces), 3))
        self._set_normals(*(shared_normals(self._faces, base, None) if self._smooth else (self._faces, 0)))
        self._set_look(NO_LOOK)
        self._moving: MovingTexels | None = None
        self._paint = Paint(
            front=to_linear(FRONT),
            back=to_linear(BACK),
            background=to_linear(BACKGROUND),
            gloss=GLOSS,
            evenness=0.0,
            rows=np.zeros((0, 3), np.int32),
            values=np.zeros(0),
            ramp=to_linear(colormap("errors")),
            hole=to_linear(HOLE),
            codes=srgb_codes(),
        )
        self._pool = ThreadPoolExecutor(THREADS)
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Have threads in a forked child, too."""
        self._pool = ThreadPoolExecutor(THREADS)

    @classmethod
    def of(
        cls,
        asset: Asset,
        size: tuple[int, int] = (512, 512),
        shading: str = "smooth",
        samples: int = 2,
        *,
        plain: bool = False,
        colors: str = "errors",
    ) -> Renderer:
        """Return a painter of a sequence with its materials, textures, colours and hard edges.

        Args:
            asset: a `gvpipe.MeshSequence`.
            plain: leave out materials and colours.
            colors: the colour map of the values that `draw` is given (`gvpipe.rasterizer.colormaps.COLORMAPS`).

        Raises:
            InputError: as the class; an unknown colour map; a texture without its uv attribute.
        """
        base = asset.read(0, 1)[0]
        painter = cls(asset.faces, base, size, shading, samples)
        if colors != "errors":
            painter._paint = painter._paint._replace(ramp=to_linear(colormap(colors)), evenness=EVENNESS)
        given = asset.attributes.get("normal")
        if painter._smooth and given is not None:
            painter._set_normals(*shared_normals(painter._faces, base, given))
        if not plain:
            look, painter.notes, painter._moving = look_of(asset)
            painter._set_look(look)
        return painter

    def draw(self, positions: Float32, camera: Camera, values: Floats | None = None, frame: int = 0) -> UInt8:
        """Return the picture ``(height, width, 3) uint8``, sRGB.

        Args:
            positions: ``(V, 3)``, model units.
            values: ``(V,)``, or ``(T, 1)`` for triangles, in 0..1: shown as colours instead of materials; NaN is grey.
            frame: whose pictures moving images show. A picture that cannot be decoded leaves that before, and a note.
        """
        from gvpipe.rasterizer.shading_kernels import shade

        look, paint, scene = self._look, self._paint, self._scene(positions, camera)
        if self._moving is not None and values is None:
            self._show(self._moving, frame)
        if values is not None:
            look, paint = NO_LOOK, self._paint_of(values)
        width, height = self.size
        picture = np.empty((height, width, 3), np.uint8)

        def paint_band(top: int, bottom: int) -> None:
            triangles = self._rasterise(scene, look, top, bottom)
            shade(triangles, scene, look if len(look.of_triangles) else None, paint, (top, bottom), picture)

        self._in_bands(paint_band)
        return picture

    def _show(self, moving: MovingTexels, frame: int) -> None:
        try:
            moving.show(frame)
        except GvpipeError as exc:
            self.notes = tuple(dict.fromkeys([*self.notes, f"a picture before it is drawn: {exc}"]))

    def visible(self, positions: Float32, camera: Camera) -> Int32:
        """Return the nearest triangle that each sample sees, -1 for none: ``(height * samples, width * samples) int32``."""
        scene = self._scene(positions, camera)
        self._in_bands(lambda top, bottom: self._rasterise(scene, self._look, top, bottom))
        nearest: Int32 = self._z_buffer.triangles[-1].copy()
        for layer in self._z_buffer.triangles[-2::-1]:
            np.copyto(nearest, layer, where=layer >= 0)
        return nearest

    def _set_normals(self, points: Int32, count: int) -> None:
        self._points, self._point_normals = np.ascontiguousarray(points), np.zeros((count, 3))

    def _set_look(self, look: Look) -> None:
        """Take materials, and make room for the layers that they need."""
        self._look = look
        everything = np.arange(len(self._faces), dtype=np.int32)
        self._opaque, self._see_through = see_through(look) if len(look.of_triangles) else (everything, everything[:0])
        self._everything = everything
        width, height = (side * self._samples for side in self.size)
        shape = (1 + (MAX_LAYERS if len(self._see_through) else 0), height, width)
        self._z_buffer = ZBuffer(np.zeros(shape, np.float32), np.zeros(shape, np.int32))

    def _paint_of(self, values: Floats) -> Paint:
        """The paint that shows values of vertices or triangles; without a gloss, which would change their colours."""
        given = np.ascontiguousarray(values, np.float64)
        n_triangles, n_vertices = len(self._faces), len(self._projection.seen)
        paint = self._paint._replace(gloss=0.0, values=given.ravel())
        if given.shape == (n_triangles, 1):
            return paint._replace(rows=np.repeat(self._everything[:, None], 3, axis=1))
        if given.shape == (n_vertices,):
            return paint._replace(rows=self._faces)
        message = f"values of shape {given.shape}; ({n_vertices},) for vertices or ({n_triangles}, 1) for triangles is needed"
        raise InputError(message)

    def _scene(self, positions: Float32, camera: Camera) -> Scene:
        """Project vertices and sum normals."""
        from gvpipe.rasterizer.normal_kernels import face_normals, point_normals
        from gvpipe.rasterizer.raster_kernels import project

        if positions.shape != self._projection.seen.shape:
            raise InputError(f"positions of shape {positions.shape}; {self._projection.seen.shape} is needed")
        width, height = (side * self._samples for side in self.size)
        focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
        rotation, target = np.ascontiguousarray(camera.rotation), np.array(camera.target, np.float64)
        view = View(rotation, target, float(camera.distance), float(focal), width, height)
        project(np.ascontiguousarray(positions, np.float32), view, self._projection)
        face_normals(self._faces, self._projection.seen, self._face_normals)
        if self._smooth:
            point_normals(self._points, self._face_normals, self._point_normals)
        return Scene(self._faces, self._points, self._projection, view.distance, self._face_normals, self._point_normals)

    def _rasterise(self, scene: Scene, look: Look, top: int, bottom: int) -> Int32:
        """Fill the z-buffer for rows ``top`` to ``bottom`` of the picture; return the layers of triangles to be shaded."""
        from gvpipe.rasterizer.raster_kernels import rasterise

        rows = top * self._samples, bottom * self._samples
        buffer, last = self._z_buffer, len(self._z_buffer.triangles) - 1
        if not len(look.of_triangles):
            buffer = ZBuffer(buffer.depths[last:], buffer.triangles[last:])
            rasterise(self._everything, scene, None, buffer, 0, rows)
            return buffer.triangles
        rasterise(self._opaque, scene, look, buffer, last, rows)
        for layer in range(last):
            rasterise(self._see_through, scene, look, buffer, layer, rows)
        return buffer.triangles

    def _in_bands(self, paint: Callable[[int, int], object]) -> None:
        edges = np.linspace(0, self.size[1], BANDS + 1 if THREADS > 1 else 2).round().astype(int).tolist()
        list(self._pool.map(lambda band: paint(*band), pairwise(edges)))
