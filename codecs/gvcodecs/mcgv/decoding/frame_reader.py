"""From an ``mcgv`` bitstream back to frames, any of them, in any order.

A frame costs its group of pictures (H.264) or its one picture (JPEG), if there are any, and the transforms of its segment.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import chain, islice

import numpy as np

from gvcodecs.mcgv.base.surface import DecodedBase, Slots, open_surface
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.layout.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.layout.chart_coding import decode_charts
from gvcodecs.mcgv.layout.coding import decode_clusters, decode_pixels, decode_slot_clusters
from gvcodecs.mcgv.layout.kd_tree import place_points
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.tiles import place_charts
from gvcodecs.mcgv.motion.affine import AffineMotion
from gvcodecs.mcgv.motion.blended import BYTES_PER_POINT, BlendedMotion, decode_transforms, read_blend
from gvcodecs.mcgv.motion.contract import Fill, Motion, Samples
from gvcodecs.mcgv.motion.skinning_coding import Trajectories
from gvcodecs.mcgv.pictures.no_pictures import NoPictures
from gvcodecs.mcgv.pictures.outliers import SECTION
from gvpipe.coding.corrections.displacements import DisplacementReader, PointVertices
from gvpipe.connectivity.base_mesh import may_run_beside
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Float32, Int32, Integers
from gvpipe.foundation.errors import CorruptFile, corrupt
from gvpipe.media.video import Plane, VideoReader
from gvpipe.model.sequence import are_finite
from gvpipe.runtime.ahead import AHEAD, beside, run_ahead
from gvpipe.runtime.forks import kept

BYTES_PER_PIXEL, BYTES_PER_SLOT = 4, 200
TOGETHER = 16  # frames whose transforms are kept for other threads
LARGE = 1 << 20  # coordinates; fewer do not pay for other threads
PAGE = 1 << 10  # coordinates
MANY_SLOTS = 1 << 14  # whose layout is found beside their blend


class McgvReader:
    """Frames of an ``mcgv`` bitstream. The shared sections are decoded when they are first needed, beside the video.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream, header: Header) -> None:
        self._header, self._bitstream = header, bitstream
        self._bounds = segment_starts(bitstream.n_frames, self._header.segments)
        self._decoded: DecodedBase | None = None
        self._video = _open_video(bitstream, self._header, self._bounds)
        if self._video.n_frames != bitstream.n_frames:
            raise CorruptFile(f"the video has {self._video.n_frames} pictures in place of {bitstream.n_frames}")
        if self._header.outliers != (SECTION in bitstream.sections):
            raise CorruptFile(f"header and section {SECTION!r} do not fit; get the file again from its source")

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._surface.faces

    @property
    def _surface(self) -> DecodedBase:
        with self._open_surface() as (_, finished):
            return finished()

    @contextmanager
    def _open_surface(self) -> Iterator[tuple[Slots, Callable[[], DecodedBase]]]:
        """As `open_surface`; the surface is kept."""
        if (surface := self._decoded) is not None:
            yield surface, lambda: surface
            return
        with open_surface(self._bitstream, self._header) as (slots, finished):
            yield slots, lambda: self._keep(finished())

    def _keep(self, surface: DecodedBase) -> DecodedBase:
        self._decoded = surface
        return surface

    @kept
    def _motion(self) -> Motion:
        return self._read_blended() if self._header.prediction == "blended" else self._read_affine()

    def _read_blended(self) -> Motion:
        """The blend, with the layout, the first transforms and the vertices beside it: most of each is compiled."""
        bitstream, header = self._bitstream, self._header
        has_one = header.segments == 1

        with ExitStack() as stack:
            slots, finished = stack.enter_context(self._open_surface())
            layout = stack.enter_context(beside(lambda: read_layout(bitstream, header, slots), self._has_room(slots)))
            blend = read_blend(bitstream, header, slots)

            def decode() -> Trajectories | None:
                return decode_transforms(bitstream, header, blend, 0) if has_one else None

            only = stack.enter_context(beside(decode, has_one))
            samples = Samples(finished(), layout())
            return BlendedMotion(bitstream, header, samples, blend, self._bounds, only())

    def _has_room(self, slots: Slots) -> bool:
        """Whether the layout is found beside blend and vertices: of large meshes, if the file may take the memory of all."""
        bitstream, budget = self._bitstream, self._bitstream.budget
        needed = bytes_of_layout(self._header, slots) + BYTES_PER_POINT * slots.n_slots
        is_large = slots.n_slots >= MANY_SLOTS and may_run_beside(budget, bitstream.n_vertices, bitstream.n_triangles)
        return is_large and 2 * needed <= budget.memory_beside

    def _read_affine(self) -> Motion:
        bitstream, header = self._bitstream, self._header
        surface = self._surface
        if header.placement == "halves":
            clusters = decode_slot_clusters(bitstream.section("clusters"), surface.n_slots, header.clusters)
            layout = read_layout(bitstream, header, surface, clusters)
        else:
            layout = read_layout(bitstream, header, surface)
            clusters = decode_clusters(bitstream.section("clusters"), layout, header.block, header.clusters)
        return AffineMotion(bitstream, header, surface, clusters, layout, self._bounds)

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the group of pictures that a frame lies in."""
        return self._video.group(frame)

    def close(self) -> None:
        """Let go of decoded pictures; they come back when they are needed."""
        self._video.close()

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a section or the video does not decode, or not to finite positions.
        """
        groups = self._video.read(start, stop)
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        ahead = AHEAD if result.size >= LARGE else 0
        overlaps = ahead > 0 and self._bitstream.budget.is_spare

        def begin() -> list[tuple[int, list[Plane]]]:
            if overlaps:
                result.reshape(-1)[::PAGE] = 0  # memory comes page by page, when it is first written
            return [*islice(groups, 1)]

        with beside(begin, overlaps) as begun:
            motion = self._motion
            frames = _frames(chain(begun(), groups))
        del begun  # it keeps the first pictures
        filling: Iterator[None] = iter(())
        while some := list(islice(frames, TOGETHER)):
            first = some[0][0]
            fills = motion.rebuild(first, [picture for _, picture in some])
            deque(filling, maxlen=0)  # the frames before these
            filling = run_ahead(partial(_fill, result[first - start :][: len(some)]), fills, ahead)
            if not overlaps:
                deque(filling, maxlen=0)
        deque(filling, maxlen=0)
        if self._header.outliers:
            self._outliers.apply(start, result)
        self._surface.fill_still(result)
        if not all([*run_ahead(are_finite, np.array_split(result.ravel(), AHEAD), ahead)]):
            raise corrupt(f"frames {start} to {stop - 1} do not decode to finite positions")
        return result

    @kept
    def _outliers(self) -> DisplacementReader:
        bitstream, surface = self._bitstream, self._surface
        shared = PointVertices.of(surface.vertices, surface.slot, surface.n_slots)
        return DisplacementReader(
            bitstream.section(SECTION), bitstream.n_frames, surface.n_slots, SECTION, shared, budget=bitstream.budget
        )


def _frames(groups: Iterable[tuple[int, list[Plane]]]) -> Iterator[tuple[int, Plane]]:
    """Each frame and its planes, of groups of pictures, which are let go of as they end."""
    for first, planes in groups:
        yield from enumerate(planes, first)


def _fill(positions: Float32, fill: Fill) -> None:
    fill(positions)


def _open_video(bitstream: Bitstream, header: Header, bounds: list[int]) -> VideoReader | NoPictures:
    if not header.pictures:
        return NoPictures(bounds, header.profile.middle)
    return VideoReader(bitstream.pictures, header.profile, header.width, 3 * header.height, bitstream.budget)


def bytes_of_layout(header: Header, slots: Slots) -> int:
    """The memory that finding a layout takes."""
    return BYTES_PER_PIXEL * header.width * header.height + BYTES_PER_SLOT * slots.n_slots


def read_layout(bitstream: Bitstream, header: Header, slots: Slots, groups: Integers | None = None) -> Layout:
    """The slots' pixels in a file; by halves, ``groups (S,)`` belong together, connected pieces if not given.

    Raises:
        CorruptFile: they are not what an encoder writes.
    """
    n_pixels = header.width * header.height
    bitstream.budget.ask(f"a layout of {n_pixels} pixels", bytes_of_layout(header, slots))
    if not header.pictures:
        return Layout(1, 1, np.zeros(slots.n_slots, np.int64))
    if n_pixels < slots.n_slots:
        raise CorruptFile(f"header: planes of {header.width}x{header.height} do not hold {slots.n_slots} samples")
    if header.placement == "halves":
        groups = slots.points.pieces() if groups is None else groups
        return place_points(slots.lattice, groups, header.width, header.height, header.block)
    if header.placement == "tiles":
        charts = decode_charts(bitstream.section(CHARTS), slots.points.causal_neighbours())
        return place_charts(slots.lattice, charts, header.width, header.height, header.block)
    return decode_pixels(bitstream.section("pixels"), slots.n_slots, header.width, header.height)
