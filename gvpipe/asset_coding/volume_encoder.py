"""The sections of what lies inside of a surface, beside those of any codec."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gvpipe.asset_coding.bounds import Given
from gvpipe.asset_coding.directory import CODED, REDUCED, entry_of
from gvpipe.asset_coding.field_plan import FieldPlan, plan_field
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.asset_coding.reduction import NO_REDUCTION
from gvpipe.asset_coding.volume_list import (
    AS_POLYHEDRA,
    BY_CORNERS,
    BY_WALK,
    CELLS,
    IN_ORDER,
    ORDER,
    PLAIN_VERSION,
    POINTS,
    SECTION,
    VERSION,
    VolumeList,
    pack_volume,
)
from gvpipe.asset_coding.volume_rows import VolumeRows
from gvpipe.coding.codec import FrameReader
from gvpipe.connectivity.cell_poses import KINDS
from gvpipe.connectivity.cell_traversal import RANKED, encode_walk
from gvpipe.connectivity.cells import encode_cells, encode_order
from gvpipe.connectivity.polyhedral_cells import encode_polyhedral
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.graph import FieldGraph
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.grids.cells import Cells
from gvpipe.grids.volume import Volume
from gvpipe.model.sequence import MeshSequence

LOOKS = 8  # frames whose errors are measured
AS_LARGE = 2.0  # a bound over the one that would leave the same error if errors were even: most are smaller
PREFIXES = {"point": "volume.point.", "cell": "volume.cell."}


class Shown(NamedTuple):
    """The decoded surface.

    Args:
        permutation: ``(V,)`` the source's vertex of each that is decoded.
        reader: of its frames.
        faces: ``(T, 3)`` triangles, in the order in which files have them.
        polygons: ``(P,)`` corners of each polygon; None: all are triangles.
    """

    permutation: Int64
    reader: FrameReader
    faces: Int32
    polygons: Int32 | None


class VolumeCoder:
    """Codes what lies inside of a sequence's surface.

    Args:
        sequence: with a volume.
        options: bounds by name, those of the surface's numbers.
        kept: the surface's attributes and fields that the file has, by name; how fields are coded.

    Raises:
        InputError: numbers that are not finite, or of digits that their bound does not keep.
    """

    def __init__(self, sequence: MeshSequence, volume: Volume, options: AssetOptions, kept: Mapping[str, object]) -> None:
        self._sequence, self._volume = sequence, volume
        self._plans: list[tuple[str, FieldPlan]] = []
        for name, field in (*volume.point_fields.items(), *volume.cell_fields.items()):
            given: Given = options.fields if name in sequence.fields else options.attributes
            if name not in kept:
                continue
            span = _span_of(kept[name], sequence, name)
            plan, _ = plan_field(name, field, given.get(name), sequence.name, span=span, place="inside, ")
            if plan is not None:
                self._plans.append((name, plan))
        self._known: tuple[bytes, dict[str, bytes]] = b"", {}  # sections of one order of vertices

    def sections(self, shown: Shown, n_beside: int, reorder: bool = False, is_final: bool = True) -> dict[str, bytes]:
        """Return the sections.

        Args:
            shown: the surface.
            n_beside: bytes of the file without these sections.
            reorder: whether cells and inner points may come in another order.
            is_final: whether points are as fine as the surface is; else those of another quality may do, whose size is alike.
        """
        key = shown.permutation.tobytes()
        if is_final or key != self._known[0]:
            self._known = key, self._sections(shown, n_beside, reorder)
        return self._known[1]

    def _sections(self, shown: Shown, n_beside: int, reorder: bool) -> dict[str, bytes]:
        volume, n_vertices = self._volume, self._sequence.n_vertices
        cells, sources, inner, made = self._code_cells(shown, reorder)
        rows = VolumeRows(cells, shown.faces, shown.polygons, n_vertices, volume.n_points)
        bound = self._point_bound(shown)
        if volume.n_points:
            made[POINTS] = encode_field(
                lambda start, stop: np.asarray(volume.points[start:stop], np.float32)[:, inner],
                volume.points.shape[0],
                rows.graphs["point"],
                FieldBound(bound) if bound else FieldBound(exact=True),
                "points inside",
                n_beside=n_beside,
            )
        chosen = {"point": inner, "cell": sources[rows.inner]}
        listed = []
        for number, (name, plan) in enumerate(self._plans):
            field, scan, domain = plan.field, plan.scan, plan.field.domain
            section = f"{PREFIXES[domain]}{number}"
            components = field.n_components if len(field.shape) == 3 else 0
            coding, reduced = (CODED, None) if scan.reduction == NO_REDUCTION else (REDUCED, scan.reduction)
            span = (scan.low, scan.high)
            listed.append(entry_of(name, field, components, plan.found.bound, section, span, coding, reduced))
            if len(chosen[domain]):
                some = plan._replace(field=field.select(chosen[domain]))
                made[section] = _coded(name, some, rows.graphs[domain], n_beside + sum(map(len, made.values())))
        unmoved = frozenset((plan.field.domain, name) for name, plan in self._plans if len(plan.field) == 1)
        is_plain = made[CELLS][0] == IN_ORDER or (made[CELLS][0] == BY_WALK and made[CELLS][1] < RANKED)
        version = PLAIN_VERSION if is_plain else VERSION
        counts, is_free = (len(cells.types), volume.n_points), cells.polyhedra is not None
        about = VolumeList(*counts, bound, volume.blocks, tuple(listed), unmoved, version, is_free)
        return {SECTION: pack_volume(about), **made}

    def _code_cells(self, shown: Shown, reorder: bool) -> tuple[Cells, Int64, Int64, dict[str, bytes]]:
        """The cells as they are decoded, the source's cell and inner point of each, and the sections."""
        volume, n_vertices = self._volume, self._sequence.n_vertices
        inner = np.arange(volume.n_points)
        place = np.argsort(shown.permutation)  # permutations are undone by sorting
        renamed = np.concatenate([place, n_vertices + inner])
        cells = volume.cells.renumbered(renamed)
        order = np.arange(len(renamed)) if volume.order is None else volume.order
        order = np.concatenate([order[:n_vertices][shown.permutation], order[n_vertices:]])
        if cells.polyhedra is not None:
            section, points = encode_polyhedral(cells, shown.faces, shown.polygons, (n_vertices, len(order)), not reorder)
            made = {CELLS: bytes([AS_POLYHEDRA]) + section, ORDER: encode_order(None if reorder else order, n_vertices)}
            if reorder:
                inner = points[n_vertices:] - n_vertices
                cells = cells.renumbered(np.argsort(points))
            return cells, np.arange(len(cells.types)), inner, made
        keeps = not reorder or bool(volume.blocks)
        in_order = bytes([IN_ORDER]) + encode_cells(Cells(cells.types, cells.offsets, order[cells.nodes]))
        walked = encode_walk(cells, shown.faces, shown.polygons, (n_vertices, len(order)), keeps)
        made = {CELLS: in_order, ORDER: encode_order(order, n_vertices)}
        sources = np.arange(len(cells.types))
        if walked is not None and len(walked[0]) < len(in_order):
            section, walk = walked
            made[CELLS] = bytes([BY_WALK if np.isin(cells.types, KINDS).all() else BY_CORNERS]) + section
            if not keeps:
                made[ORDER] = encode_order(None, n_vertices)
                cells, sources, inner = walk.cells, walk.sources, walk.points[n_vertices:] - n_vertices
        return cells, sources, inner, made

    def _point_bound(self, shown: Shown) -> float:
        """The bound on coordinates that leaves inner points the surface's root mean square error, and no larger one."""
        sequence = self._sequence
        squares, largest, count = 0.0, 0.0, 0
        for frame in np.unique(np.linspace(0, sequence.n_frames - 1, LOOKS).astype(int)).tolist():
            decoded = shown.reader.read(frame, frame + 1)[0].astype(np.float64)
            errors = decoded - sequence.read_exact(frame, frame + 1)[0][shown.permutation]
            squares, count = squares + float(np.square(errors).sum()), count + errors.size
            largest = max(largest, float(np.linalg.norm(errors, axis=1).max(initial=0)))
        return min(AS_LARGE * math.sqrt(3 * squares / max(count, 1)), largest / math.sqrt(3))


def _span_of(plan: object, sequence: MeshSequence, name: str) -> tuple[float, float]:
    """Smallest and largest number of the surface, of all frames of a field."""
    if isinstance(plan, FieldPlan):
        return plan.scan.low, plan.scan.high
    values = np.asarray(sequence.attributes[name]).astype(np.float64)
    return float(np.fmin.reduce(values, axis=None, initial=np.inf)), float(np.fmax.reduce(values, axis=None, initial=-np.inf))


def _coded(name: str, plan: FieldPlan, graph: FieldGraph, n_beside: int) -> bytes:
    return encode_field(
        lambda start, stop: plan.scan.reduction.reduce(plan.field.read(start, stop), None),
        len(plan.field),
        graph,
        plan.bound,
        name,
        holes=plan.found.holes,
        n_beside=n_beside,
    )
