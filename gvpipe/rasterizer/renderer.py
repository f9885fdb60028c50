"""The painter: a mesh and a camera in, a picture out, on the CPU.

A frame passes through four steps:

1. vertices are projected;
2. a z-buffer finds the triangle of every sample;
3. normals are summed in picture axes;
4. each pixel is shaded, once if all its samples see one triangle, else once for each.

The picture is cut in bands that threads paint beside each other; a pixel's value does not depend on the bands.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from gvpipe.arrays import Float32, Floats, Int32, UInt8
from gvpipe.errors import InputError
from gvpipe.mesh.topology import weld
from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.colours import BACK, BACKGROUND, FRONT, error_colours, srgb_codes, to_linear
from gvpipe.rasterizer.scene import Material, Projection, Scene, View, ZBuffer

SHADINGS = ("smooth", "flat")
SIZE_RANGE = (16, 8192)  # pixels, of either side
SAMPLES_RANGE = (1, 8)  # per pixel and axis
THREADS = min(4, os.cpu_count() or 1)
RAMP = 256  # steps of a colour map
GLOSS = 0.05  # of the highlight


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
        self.size, self._samples, self._smooth = size, samples, shading == "smooth"
        self._faces = np.ascontiguousarray(faces, np.int32)
        first, point = weld(base) if self._smooth else (np.zeros(0, np.intp), np.zeros(len(base), np.intp))
        self._points = point.astype(np.int32)[self._faces]
        n_vertices, (width, height) = len(base), size
        self._projection = Projection(np.zeros((n_vertices, 3)), np.zeros((n_vertices, 2), np.int64), np.zeros(n_vertices))
        shape = (height * samples, width * samples)
        self._z_buffer = ZBuffer(np.zeros(shape, np.float32), np.zeros(shape, np.int32))
        self._face_normals, self._point_normals = np.zeros((len(faces), 3)), np.zeros((len(first), 3))
        self._material = Material(
            front=to_linear(FRONT),
            back=to_linear(BACK),
            background=to_linear(BACKGROUND),
            gloss=GLOSS,
            values=np.zeros(0),
            ramp=to_linear(error_colours(np.linspace(0, 1, RAMP))),
            codes=srgb_codes(),
        )
        self._pool = ThreadPoolExecutor(THREADS)

    def draw(self, positions: Float32, camera: Camera, values: Floats | None = None) -> UInt8:
        """Return the picture ``(height, width, 3) uint8``, sRGB.

        Args:
            positions: ``(V, 3)``, model units.
            values: ``(V,)`` in 0..1, shown in the colours of `gvpipe.rasterizer.colours.error_colours`.
        """
        from gvpipe.rasterizer.shading_kernels import face_normals, point_normals, shade

        self._project(positions, camera)
        face_normals(self._faces, self._projection.seen, self._face_normals)
        if self._smooth:
            point_normals(self._points, self._face_normals, self._point_normals)
        scene = Scene(self._faces, self._points, self._projection, camera.distance, self._face_normals, self._point_normals)
        material = self._material
        if values is not None:  # a gloss would hide colours that mean something
            material = material._replace(values=np.ascontiguousarray(values, np.float64), gloss=0.0)
        width, height = self.size
        picture = np.empty((height, width, 3), np.uint8)

        def paint(top: int, bottom: int) -> None:
            self._rasterise(top, bottom)
            shade(self._z_buffer.triangles, scene, material, top, bottom, picture)

        self._in_bands(paint)
        return picture

    def visible(self, positions: Float32, camera: Camera) -> Int32:
        """Return the triangle that each sample sees, -1 for none: ``(height * samples, width * samples) int32``."""
        self._project(positions, camera)
        self._in_bands(self._rasterise)
        return self._z_buffer.triangles.copy()

    def _project(self, positions: Float32, camera: Camera) -> None:
        from gvpipe.rasterizer.raster_kernels import project

        if positions.shape != self._projection.seen.shape:
            raise InputError(f"positions of shape {positions.shape}; {self._projection.seen.shape} is needed")
        width, height = (side * self._samples for side in self.size)
        focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
        rotation, target = np.ascontiguousarray(camera.rotation), np.array(camera.target, np.float64)
        view = View(rotation, target, float(camera.distance), float(focal), width, height)
        project(np.ascontiguousarray(positions, np.float32), view, self._projection)

    def _rasterise(self, top: int, bottom: int) -> None:
        """Fill the z-buffer for rows ``top`` to ``bottom`` of the picture."""
        from gvpipe.rasterizer.raster_kernels import rasterise

        rasterise(self._faces, self._projection, self._z_buffer, top * self._samples, bottom * self._samples)

    def _in_bands(self, paint: Callable[[int, int], None]) -> None:
        # several bands per thread, since some are empty
        edges = np.linspace(0, self.size[1], 2 * THREADS + 1 if THREADS > 1 else 2).round().astype(int).tolist()
        list(self._pool.map(lambda band: paint(*band), pairwise(edges)))
