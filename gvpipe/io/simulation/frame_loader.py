"""Simulation files of one time step each, as frame files: the surface of the first serves all that have the same cells."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from gvpipe.grids.cells import Cells
from gvpipe.io.damage import FRAME_AGAIN, reading
from gvpipe.io.formats import BLOCKS
from gvpipe.io.mesh import FrameValues, Mesh
from gvpipe.io.simulation.blocks import load_multi_block
from gvpipe.io.simulation.dataset import Dataset, block_parts, surface_values
from gvpipe.io.simulation.legacy import load_legacy
from gvpipe.io.simulation.meshio_files import MeshioLoader
from gvpipe.io.simulation.pieces import Welding, without_duplicates
from gvpipe.io.simulation.surface import Surface, extract_surface
from gvpipe.io.simulation.xml_grids import load_xml_grid


class SurfaceLoader:
    """Loads the surface of one file after the other.

    Args:
        load: parses a file.
    """

    def __init__(self, load: Callable[[Path], Dataset]) -> None:
        self._load = load
        self._first: tuple[Cells, int, Surface] | None = None
        self._welding = Welding()

    def __call__(self, path: Path) -> Mesh:
        """Load a file; raises `ValueError`."""
        step = without_duplicates(self._load(path), self._welding)
        cells, points = step.cells(), step.points()
        if self._first is not None and self._first[1] == len(points) and self._first[0].equals(cells):
            surface = self._first[2]
        else:
            surface = extract_surface(cells, points)
        self._first = self._first or (cells, len(points), surface)
        return Mesh(
            points[surface.points],
            surface.faces,
            notes=step.notes,
            polygons=surface.polygons,
            parts=block_parts(step, surface),
            animated={name: partial(_guarded, path, name, read) for name, read in surface_values(step, surface).items()},
            not_carried=(*step.not_carried, *surface.not_carried),
        )


def _guarded(path: Path, name: str, read: Callable[[], FrameValues]) -> FrameValues:
    """Numbers of a file; raises `InputError` with its name for whatever goes wrong."""
    with reading(path, "", repr(name), FRAME_AGAIN):
        return read()


def legacy_loader() -> SurfaceLoader:
    """What loads files of legacy VTK."""
    return SurfaceLoader(load_legacy)


def xml_loader() -> SurfaceLoader:
    """What loads files of VTK's XML formats."""
    return SurfaceLoader(load_xml_grid)


def block_loader() -> SurfaceLoader:
    """What loads VTK's multi-block files."""
    return SurfaceLoader(load_multi_block)


def dataset_loader(suffix: str) -> Callable[[Path], Dataset]:
    """What parses files of one time step of an extension of `gvpipe.io.formats.STEPS`."""
    return load_legacy if suffix == ".vtk" else load_multi_block if suffix in BLOCKS else load_xml_grid


def meshio_loader() -> SurfaceLoader:
    """What loads files that meshio reads."""
    return SurfaceLoader(MeshioLoader())
