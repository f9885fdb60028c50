"""Pictures of a sequence that a plane cuts: the rest of its surface, and the section of its volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Int32, UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.cut import AXES, Cut, cut_triangles, joined, section
from gvpipe.rendering.field_map import FieldMap


@dataclass(frozen=True)
class CutLook:
    """How pictures are painted: size, shading, samples and colours, as of `gvpipe.Renderer`."""

    size: tuple[int, int]
    shading: str
    samples: int
    colors: str


class CutScene:
    """What is left of a sequence below a plane.

    Args:
        sequence: with a volume, whose section is filled, or without.
        cut: the plane.
        look: of the pictures.
        shown: the field that colours show, or None.
    """

    def __init__(self, sequence: MeshSequence, cut: Cut, look: CutLook, shown: FieldMap | None) -> None:
        self._sequence, self._cut, self._look, self._shown = sequence, cut, look, shown
        self._place = cut.at(sequence.read(0, 1)[0].astype(np.float64), sequence.origin)

    def draw(self, frame: int, camera: Camera) -> UInt8:
        """``(H, W, 3) uint8`` a frame.

        Raises:
            InputError: nothing is left below the plane.
        """
        points, faces, values = self.mesh(frame)
        if not len(faces):
            sign = "-" if self._cut.sign < 0 else ""
            at = f"{sign}{AXES[self._cut.axis]}={self._cut.place:g}{' of the box' if self._cut.is_part else ''}"
            raise InputError(f"{self._sequence.name}: nothing of frame {frame} is left by the plane {at}; move it")
        look = self._look
        one = MeshSequence(points[None], faces, self._sequence.fps)
        painter = Renderer.of(one, look.size, look.shading, look.samples, plain=True, colors=look.colors)
        return painter.draw(one.read(0, 1)[0], camera, values)

    def _turned(self, points: Float64, faces: Int32) -> Int32:
        """Triangles of the section, seen from the side that is left out."""
        a, b, c = (points[faces[:, k]] for k in range(3))
        is_wrong = self._cut.sign * np.cross(b - a, c - a)[:, self._cut.axis] < 0
        return np.where(is_wrong[:, None], faces[:, ::-1], faces).astype(np.int32)

    def mesh(self, frame: int) -> tuple[Array, Int32, Float64 | None]:
        """Points ``(n, 3)``, triangles, and the parts of the colours' range of points ``(n,)`` or triangles ``(t, 1)``."""
        sequence, volume = self._sequence, self._sequence.volume
        points = sequence.read(frame, frame + 1)[0].astype(np.float64)
        if volume is not None:
            points = np.concatenate([points, np.asarray(volume.points[frame : frame + 1], np.float64)[0]])
        height = self._cut.sign * (points[:, self._cut.axis] - self._place)
        pieces = [cut_triangles(sequence.faces, height)]
        if volume is not None:
            piece = section(volume.cells, height)
            pieces.append(piece._replace(faces=self._turned(piece.blend(points), piece.faces)))
        places, faces = joined([(piece.blend(points), piece.faces) for piece in pieces])
        shown = self._shown
        if shown is None:
            return places.astype(np.float32), faces, None
        on, inside = shown.values(frame), None if volume is None else shown.inside(volume, frame)
        if shown.domain == "triangle":
            found = [on[pieces[0].sources, 0]]
            if len(pieces) > 1:
                count = len(pieces[1].sources)
                found.append(np.full(count, np.nan) if inside is None else inside[pieces[1].sources])
            return places.astype(np.float32), faces, np.concatenate(found)[:, None]
        missing = len(points) - len(on)
        every = np.concatenate([on, np.full(missing, np.nan) if inside is None else inside])
        return places.astype(np.float32), faces, np.concatenate([piece.blend(every) for piece in pieces])
