"""The sections of what lies inside of a surface, beside those of any codec."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset_coding.bounds import Given, precision
from gvpipe.asset_coding.directory import CODED, REDUCED, Listed
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.asset_coding.reduction import NO_REDUCTION
from gvpipe.asset_coding.scan import Scan, scan_field
from gvpipe.asset_coding.volume_list import BY_WALK, CELLS, IN_ORDER, ORDER, POINTS, SECTION, VolumeList, pack_volume
from gvpipe.coding.codec import FrameReader
from gvpipe.connectivity.cell_traversal import encode_walk
from gvpipe.connectivity.cells import encode_cells, encode_order
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.graph import FieldGraph
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.grids.borders import cell_edges, cells_behind, inner_edges, node_edges
from gvpipe.grids.cells import Cells
from gvpipe.grids.volume import Volume
from gvpipe.model.sequence import MeshSequence

LOOKS = 8  # frames whose errors are measured
AS_LARGE = 2.0  # a bound over the one that would leave the same error if errors were even: most are smaller
PREFIXES = {"point": "volume.point.", "cell": "volume.cell."}


class VolumeCoder:
    """Codes what lies inside of a sequence's surface.

    Args:
        sequence: with a volume.
        options: bounds by name, those of the surface's numbers.
        kept: names of the surface's attributes and fields that the file has.

    Raises:
        InputError: numbers that are not finite, or of digits that their bound does not keep.
    """

    def __init__(self, sequence: MeshSequence, volume: Volume, options: AssetOptions, kept: Mapping[str, Any]) -> None:
        self._sequence, self._volume = sequence, volume
        self._numbers: list[tuple[str, str, Field, Scan, float, bool]] = []
        for domain, fields in (("point", volume.point_fields), ("cell", volume.cell_fields)):
            for name, field in fields.items():
                if name in kept:
                    self._numbers.append((domain, name, field, *self._bound(name, field, options)))
        self._known: tuple[bytes, dict[str, bytes]] = b"", {}  # sections of one order of vertices

    def _bound(self, name: str, field: Field, options: AssetOptions) -> tuple[Scan, float, bool]:
        """What the numbers are, the bound on each, and whether holes are kept."""
        sequence = self._sequence
        given: Given = options.fields if name in sequence.fields else options.attributes
        is_float, what = field.dtype.kind == "f", f"field {name!r}"
        holes = precision(given.get(name), field.kind, is_float, 1.0, 0, what, vectors=(1, 1.0)).holes
        scan = scan_field(name, field, holes, sequence.name)
        low, high, longest = _with_surface(scan, sequence, name)
        vectors = (field.n_components, longest)
        found = precision(given.get(name), field.kind, is_float, high - low, 0, what, scan.is_whole, vectors)
        if scan.rounding > found.bound / 2:
            raise InputError(
                f"{sequence.name}: inside, field {name!r} is float64, and float32 rounds it by up to {scan.rounding:.2g}; "
                f"give it a bound of {2 * scan.rounding:.2g} or more by --field"
            )
        return scan, found.bound, holes

    def sections(
        self,
        permutation: Int64,
        place: Int64,
        reader: FrameReader,
        shown: tuple[Int32, Int32 | None],
        n_beside: int,
        reorder: bool = False,
        is_final: bool = True,
    ) -> dict[str, bytes]:
        """Return the sections.

        Args:
            permutation: ``(V,)`` the source's vertex of each that is decoded.
            place: its inverse.
            reader: of the decoded surface.
            shown: its triangles ``(T, 3)`` and polygons, as they are decoded.
            n_beside: bytes of the file without these sections.
            reorder: whether cells and inner points may come in another order.
            is_final: whether points are as fine as the surface is; else those of another quality may do, whose size is alike.
        """
        key = permutation.tobytes()
        if is_final or key != self._known[0]:
            self._known = key, self._sections(permutation, place, reader, shown, n_beside, reorder)
        return self._known[1]

    def _sections(
        self,
        permutation: Int64,
        place: Int64,
        reader: FrameReader,
        shown: tuple[Int32, Int32 | None],
        n_beside: int,
        reorder: bool,
    ) -> dict[str, bytes]:
        volume, n_vertices = self._volume, self._sequence.n_vertices
        renamed = np.concatenate([place, np.arange(n_vertices, n_vertices + volume.n_points)])
        cells = Cells(volume.cells.types, volume.cells.offsets, renamed[volume.cells.nodes])
        order = np.arange(len(renamed)) if volume.order is None else volume.order
        order = np.concatenate([order[:n_vertices][permutation], order[n_vertices:]])
        keeps = not reorder or bool(volume.blocks)
        in_order = bytes([IN_ORDER]) + encode_cells(Cells(cells.types, cells.offsets, order[cells.nodes]))
        walked = encode_walk(cells, *shown, (n_vertices, len(order)), keeps)
        rows = {"point": np.arange(volume.n_points), "cell": np.arange(len(cells.types))}
        made = {CELLS: in_order, ORDER: encode_order(order, n_vertices)}
        if walked is not None and len(walked[0]) < len(in_order):
            made[CELLS] = bytes([BY_WALK]) + walked[0]
            if not keeps:
                made[ORDER] = encode_order(None, n_vertices)
                cells = walked[1].cells
                rows = {"point": walked[1].points[n_vertices:] - n_vertices, "cell": walked[1].sources}
        bound = self._point_bound(reader, permutation)
        behind = cells_behind(cells, *shown)
        is_inner = np.ones(len(cells.types), bool)
        is_inner[behind[behind >= 0]] = False
        graphs = {
            "point": FieldGraph(inner_edges(node_edges(cells), n_vertices), volume.n_points, "point"),
            "cell": FieldGraph(_among(cell_edges(cells), is_inner), int(is_inner.sum()), "cell"),
        }
        if volume.n_points:
            points, inner = volume.points, rows["point"]
            made[POINTS] = encode_field(
                lambda start, stop: np.asarray(points[start:stop], np.float32)[:, inner],
                points.shape[0],
                graphs["point"],
                FieldBound(bound) if bound else FieldBound(exact=True),
                "points inside",
                n_beside=n_beside,
            )
        listed = []
        rows["cell"] = rows["cell"][is_inner]
        for number, (domain, name, field, scan, limit, holes) in enumerate(self._numbers):
            section = f"{PREFIXES[domain]}{number}"
            listed.append(_listed(name, field, domain, limit, section, scan))
            if len(rows[domain]):
                n_known = n_beside + sum(map(len, made.values()))
                made[section] = _coded(field.select(rows[domain]), scan, limit, graphs[domain], name, holes, n_known)
        unmoved = frozenset((domain, name) for domain, name, field, *_ in self._numbers if len(field) == 1)
        about = VolumeList(len(cells.types), volume.n_points, bound, volume.blocks, tuple(listed), unmoved)
        return {SECTION: pack_volume(about), **made}

    def _point_bound(self, reader: FrameReader, permutation: Int64) -> float:
        """The bound on coordinates that leaves inner points the surface's root mean square error, and no larger one."""
        sequence = self._sequence
        squares, largest, count = 0.0, 0.0, 0
        for frame in np.unique(np.linspace(0, sequence.n_frames - 1, LOOKS).astype(int)).tolist():
            errors = reader.read(frame, frame + 1)[0].astype(np.float64) - sequence.read_exact(frame, frame + 1)[0][permutation]
            squares, count = squares + float(np.square(errors).sum()), count + errors.size
            largest = max(largest, float(np.linalg.norm(errors, axis=1).max(initial=0)))
        return min(AS_LARGE * math.sqrt(3 * squares / max(count, 1)), largest / math.sqrt(3))


def _with_surface(scan: Scan, sequence: MeshSequence, name: str) -> tuple[float, float, float]:
    """Smallest and largest value and longest vector, of a frame of the surface, too."""
    one: Field | Attribute = sequence.fields[name] if name in sequence.fields else sequence.attributes[name]
    values = one.read(0, 1) if isinstance(one, Field) else np.asarray(one)
    low, high = float(np.nanmin(values, initial=scan.low)), float(np.nanmax(values, initial=scan.high))
    return low, high, scan.longest


def _among(edges: Int64, is_kept: Array) -> Int64:
    """Edges between rows that are kept, by their numbers among these."""
    number = np.cumsum(is_kept) - 1
    return np.asarray(number[edges[is_kept[edges].all(axis=1)]])


def _listed(name: str, field: Field, domain: str, bound: float, section: str, scan: Scan) -> Listed:
    components = field.n_components if len(field.shape) == 3 else 0
    dtype = field.dtype.name if field.dtype != np.float64 else "float32"
    is_reduced = scan.reduction != NO_REDUCTION
    coding, reduced = (REDUCED, scan.reduction) if is_reduced else (CODED, None)
    span = (scan.low, scan.high)
    return Listed(name, field.kind, domain, components, dtype, field.unit, bound, coding, section, span, reduced)


def _coded(field: Field, scan: Scan, bound: float, graph: FieldGraph, name: str, holes: bool, n_beside: int) -> bytes:
    reduction = scan.reduction
    return encode_field(
        lambda start, stop: reduction.reduce(field.read(start, stop), None),
        len(field),
        graph,
        FieldBound(bound - scan.rounding) if bound else FieldBound(exact=True),
        name,
        holes=holes,
        n_beside=n_beside,
    )
