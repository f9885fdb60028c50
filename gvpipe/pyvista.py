"""Geometry videos in PyVista: importing this registers a reader for ``.mp4`` (extra ``pyvista``).

An installed gvpipe registers it by an entry point, too, so that ``pv.read("crash.mp4")`` needs no import.

Examples:
    >>> import pyvista as pv  # doctest: +SKIP
    >>> pv.read("crash.mp4").plot(scalars="stress")  # the first frame  # doctest: +SKIP
    >>> reader = pv.get_reader("crash.mp4")  # doctest: +SKIP
    >>> reader.set_active_time_value(0.25)  # doctest: +SKIP
    >>> mesh = reader.read()  # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any

import pyvista as pv
from pyvista.core.utilities.reader import BaseVTKReader

from gvpipe.io.simulation.vtk_frames import to_pyvista
from gvpipe.io.simulation.vtk_objects import from_pyvista
from gvpipe.playback.vtk_video import VtkVideo

__all__ = ["GeometryVideoReader", "from_pyvista", "to_pyvista"]


class _Source(BaseVTKReader):
    """What PyVista's readers ask for a file's data object."""

    def __init__(self) -> None:
        super().__init__()
        self.video: VtkVideo | None = None
        self.active = 0

    def UpdateInformation(self) -> None:
        if self.video is not None:
            self.video.close()
        self.video, self.active = VtkVideo(self._filename), 0

    def Update(self) -> None:
        assert self.video is not None  # a path comes first
        self._data_object = pv.wrap(self.video.frame(self.active))


class GeometryVideoReader(pv.BaseReader, pv.TimeReader):
    """A geometry video as a reader of PyVista, whose time points are frames.

    ``read`` gives the frame of the active time: ``pyvista.PolyData``, or ``pyvista.UnstructuredGrid`` of a file with a volume.
    Data of points and cells are the file's attributes and fields; see `gvpipe.to_vtk`. Frames are decoded when they are read.

    Args:
        path: of the geometry video.

    Raises:
        FileNotFoundError: there is no such file.
        GvpipeError: it is not a geometry video, or it is damaged.
    """

    _class_reader = _Source

    @property
    def video(self) -> VtkVideo:
        """The open file."""
        opened: VtkVideo = self.reader.video
        return opened

    @property
    def number_time_points(self) -> int:
        """F, the number of frames."""
        return len(self.video.times)

    def time_point_value(self, time_point: int) -> float:
        """Seconds of a frame; raises `IndexError`."""
        return float(self.video.times[time_point])

    @property
    def active_time_value(self) -> float:
        """Seconds of the frame that is read next."""
        return self.time_point_value(self.reader.active)

    def set_active_time_value(self, time_value: float) -> None:
        """Choose the frame that is shown at a second: the last one that does not come after it."""
        self.reader.active = self.video.frame_at(time_value)

    def set_active_time_point(self, time_point: int) -> None:
        """Choose a frame by its number; raises `IndexError`."""
        self.reader.active = range(self.number_time_points)[time_point]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the data sets of the active frame's shot have no place for, a line each."""
        return self.video.notes(self.reader.active)

    def read(self, **options: Any) -> Any:
        """The data set of the active frame; options are those of ``pyvista.BaseReader.read``."""
        return super().read(**options)


pv.register_reader(".mp4", GeometryVideoReader)
