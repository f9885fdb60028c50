"""XDMF files (.xdmf, .xmf), as dolfinx, FEniCS and meshio write them: an XML file that names grids, and HDF5 beside it.

A temporal collection has a grid per step, or a spatial collection, whose grids are blocks. Collections of equal length are the
functions of one simulation: all their attributes are read. FEniCS's finite-element functions are read at the corners of their
cells. Source: XDMF, "XDMF model and format"; for functions, vtkXdmfReader of VTK 9.7.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Floats
from gvpipe.grids.cells import POLYHEDRON, SIZES, Cells, equal_cells, listed_cells
from gvpipe.grids.polyhedra import from_streams, ranges
from gvpipe.io.damage import reading
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.blocks import join_blocks
from gvpipe.io.simulation.dataset import DataArray, Dataset
from gvpipe.io.simulation.part_numbers import with_blocks
from gvpipe.io.simulation.steps import read_steps
from gvpipe.io.simulation.xdmf_items import Items
from gvpipe.io.simulation.xdmf_references import References
from gvpipe.io.simulation.xml_root import parse_xml
from gvpipe.model.sequence import MeshSequence

LARGEST_XML = 256 << 20  # bytes
MOST_BLOCKS = 10_000
MOST_KNOWN = 100  # blocks whose cells are kept from step to step
MOST_DEPTH = 50  # of collections in collections
# VTK's type by name, and by the number that mixed topologies have
NAMES = {"TRIANGLE": 5, "QUADRILATERAL": 9, "TETRAHEDRON": 10, "PYRAMID": 14, "WEDGE": 13, "HEXAHEDRON": 12, "TRIANGLE_6": 22,
         "TRI_6": 22, "QUADRILATERAL_8": 23, "QUAD_8": 23, "QUADRILATERAL_9": 28, "QUAD_9": 28, "TETRAHEDRON_10": 24,
         "TET_10": 24, "PYRAMID_13": 27, "WEDGE_15": 26, "WEDGE_18": 32, "HEXAHEDRON_20": 25, "HEX_20": 25,
         "HEXAHEDRON_24": 33, "HEX_24": 33, "HEXAHEDRON_27": 29, "HEX_27": 29,
         "EDGE_3": 21, "POLYVERTEX": 2, "POLYLINE": 4, "POLYGON": 7}  # fmt: skip
NUMBERS = {1: 2, 2: 4, 3: 7, 4: 5, 5: 9, 6: 10, 7: 14, 8: 13, 9: 12, 34: 21, 35: 28, 36: 22, 37: 23, 38: 24, 39: 27, 40: 26,
           16: 42, 41: 32, 48: 25, 49: 33, 50: 29}  # fmt: skip
CORNERS = {5: 3, 9: 4, 10: 4, 14: 5, 13: 6, 12: 8}
COMPONENTS = {"SCALAR": 1, "VECTOR": 3, "TENSOR": 9, "TENSOR6": 6}


def read_xdmf(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the surface of an XDMF file.

    Args:
        path: .xdmf or .xmf.
        options: ``fps`` and ``frames``.

    Raises:
        InputError: h5py is missing for HDF5, it is no such file, it is damaged, or a file that it names is missing.
    """
    with reading(path, "XDMF"):
        steps = options.keep("steps", lambda: XdmfSteps(path))
    return read_steps(steps, path, options)


def _is_uniform(grid: ElementTree.Element) -> bool:
    return grid.get("GridType", "Uniform") == "Uniform"


def _is_spatial(grid: ElementTree.Element) -> bool:
    kind = grid.get("GridType")
    return kind == "Tree" or (kind == "Collection" and grid.get("CollectionType", "Spatial") == "Spatial")


def _others(grids: list[ElementTree.Element]) -> list[str]:
    """What grids have beside a mesh and its numbers."""
    found = [each for grid in grids for each in grid if each.tag == "Set"]
    return [f"{each.tag} {each.get('Name') or 'unnamed'!r}" for each in found]


def _texts_of(value: str) -> list[str]:
    """The texts of an ``Information`` that gvpipe writes; none of another."""
    try:
        found = json.loads(value)
    except (ValueError, RecursionError):
        return []
    return found if isinstance(found, list) and all(isinstance(each, str) for each in found) else []


class XdmfSteps:
    """The time steps of a file; raises `ValueError` for what it is not."""

    def __init__(self, path: Path) -> None:
        root = _parse(path)
        self._references = References(root)
        self._items = Items(path, self._references)
        temporal = [grid for grid in root.iter("Grid") if grid.get("CollectionType") == "Temporal"]
        if temporal:
            columns = [collection.findall("Grid") for collection in temporal]
            self._steps = [list(grids) for grids in zip(*[c for c in columns if len(c) == len(columns[0])], strict=True)]
            taken = [each for each, c in zip(temporal, columns, strict=True) if len(c) == len(columns[0])]
            self.times: Float64 | None = self._times(temporal[0], [grids[0] for grids in self._steps])
        else:
            every = [self._references.target(grid) for grid in root.findall("Domain/Grid")]
            found = [grid for grid in every if _is_uniform(grid) or _is_spatial(grid)]
            self._steps = [[found[0]]] if found else []
            self.times, taken = None, found[:1]
        if not self._steps:
            raise ValueError("it has no grid; a mesh is needed")
        self.n_steps = len(self._steps)
        within = {id(own) for grid in taken for each in grid.iter("Grid") for own in (each, self._references.target(each))}
        others = [grid for grid in root.iter("Grid") if id(grid) not in within and grid.findall("Attribute")]
        self._left = [
            f"numbers {each.get('Name') or 'unnamed'!r} of another grid"
            for grid in others
            for each in grid.findall("Attribute")
        ]
        self._left += [
            f"grid {grid.get('Name') or 'unnamed'!r}"
            for grid in root.findall("Domain/Grid")
            if not temporal and grid not in taken
        ]
        named = {each.get("Name") or "": each.get("Value") or "" for each in root.findall("Domain/Information")}
        self._texts = {name: partial(_texts_of, value) for name, value in named.items()}
        self._known: dict[str, Cells] = {}
        self._n_visited = 0  # grids of the step that is being opened

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        self._n_visited = 0
        columns = [list(self._blocks(grid, 0)) for grid in self._steps[step]]
        blocks = [(name, [grid]) for name, grid in columns[0]]
        for column in columns[1:]:
            for number, (name, grid) in enumerate(column):
                own = self._home_of(blocks, name, grid, number if len(column) == len(columns[0]) else -1)
                if own is None:
                    blocks.append((name, [grid]))
                else:
                    own.append(grid)
        if len(blocks) == 1 and _is_uniform(self._references.target(self._steps[step][0])):
            return with_blocks(self._open(blocks[0][1]), self._texts)
        return join_blocks([(name, self._open(grids)) for name, grids in blocks])

    def _home_of(
        self, blocks: list[tuple[str, list[ElementTree.Element]]], name: str, grid: ElementTree.Element, number: int
    ) -> list[ElementTree.Element] | None:
        """The grids of a block that have the mesh of another grid: that of its name, else of its number, else none."""
        named = [grids for own, grids in blocks if own == name and name]
        found = named[0] if len(named) == 1 else blocks[number][1] if number >= 0 else None
        return found if found is not None and self._is_same_mesh(found[0], grid) else None

    def _is_same_mesh(self, one: ElementTree.Element, two: ElementTree.Element) -> bool:
        """Whether two grids have equal cells and points."""
        parts = [[self._part(grid, tag) for tag in ("Topology", "Geometry")] for grid in (one, two)]
        texts = [tuple(ElementTree.tostring(part, "unicode") for part in each) for each in parts]
        if texts[0] == texts[1]:
            return True
        (topology, geometry), (other_topology, other_geometry) = parts
        return self._cells(topology).equals(self._cells(other_topology)) and np.array_equal(
            self._points(geometry), self._points(other_geometry)
        )

    def _blocks(self, grid: ElementTree.Element, depth: int) -> Iterator[tuple[str, ElementTree.Element]]:
        """Names and grids of a step: itself, or those that its spatial collection has."""
        self._n_visited += 1
        if self._n_visited > MOST_BLOCKS:
            raise ValueError(f"a step has more than {MOST_BLOCKS} grids")
        grid = self._references.target(grid)
        if _is_uniform(grid):
            yield grid.get("Name", ""), grid
        elif _is_spatial(grid) and depth < MOST_DEPTH:
            for each in grid.findall("Grid"):
                yield from self._blocks(each, depth + 1)
        else:
            raise ValueError(f"its grid {grid.get('Name', '')[:40]!r} is a {grid.get('GridType')}, which is not read")

    def _open(self, grids: list[ElementTree.Element]) -> Dataset:
        """A mesh, and the numbers of all grids that are of it."""
        topology, geometry = self._part(grids[0], "Topology"), self._part(grids[0], "Geometry")
        cells = self._cells(topology)
        point_data: dict[str, DataArray] = {}
        cell_data: dict[str, DataArray] = {}
        left = []
        for attribute in (self._references.target(each) for grid in grids for each in grid.findall("Attribute")):
            name, center = attribute.get("Name") or "unnamed", (attribute.get("Center") or "Node").lower()
            if name in point_data or name in cell_data:
                left.append(name)
                continue
            if attribute.get("ItemType") == "FiniteElementFunction":
                n_dofs = int(attribute.get("ElementDegree") or 1)
                is_flat = n_dofs == 0
                reader = partial(self._function, attribute, cells, is_flat)
                (cell_data if is_flat else point_data)[name] = DataArray(reader)
            elif center in ("node", "cell"):
                (point_data if center == "node" else cell_data)[name] = DataArray(partial(self._numbers, attribute))
            else:
                left.append(name)
        lost = (
            *(f"numbers {name!r} of neither nodes nor cells, or of a name that others have" for name in left),
            *_others(grids),
            *dict.fromkeys(self._left),
        )
        return Dataset(partial(self._points, geometry), lambda: cells, point_data, cell_data, not_carried=lost)

    def _part(self, grid: ElementTree.Element, tag: str) -> ElementTree.Element:
        """A grid's topology or geometry, its own or that of the grid it refers to."""
        found = self._references.child(grid, tag)
        if found is None:
            pointers = self._references.pointers(grid)
            leading = f", and {pointers[0][:60]!r} leads to none" if pointers else ""
            raise ValueError(f"grid {grid.get('Name', '')[:40]!r} has no {tag}{leading}")
        return found

    def _cells(self, topology: ElementTree.Element) -> Cells:
        """The same object for steps that name the same numbers."""
        key = ElementTree.tostring(topology, "unicode")
        if key not in self._known:
            if len(self._known) >= MOST_KNOWN:
                self._known.clear()
            self._known[key] = self._read_cells(topology)
        return self._known[key]

    def _read_cells(self, topology: ElementTree.Element) -> Cells:
        kind = (topology.get("TopologyType") or topology.get("Type") or "").upper()
        nodes = self._items.read(_item(topology)).astype(np.int64)
        if kind == "MIXED":
            return _mixed(nodes.reshape(-1))
        if kind not in NAMES:
            raise ValueError(f"its topology is {kind[:30] or 'nothing'}, which is not read")
        vtk = NAMES[kind]
        size = SIZES.get(vtk, 0) or int(topology.get("NodesPerElement") or (1 if vtk == 2 else 0))
        if size < 1 or nodes.size % size:
            raise ValueError(f"its {nodes.size} nodes are not cells of {size or 'a given number of'} nodes")
        return equal_cells(vtk, nodes.reshape(-1, size))

    def _points(self, geometry: ElementTree.Element) -> Floats:
        kind = (geometry.get("GeometryType") or geometry.get("Type") or "XYZ").upper()
        if kind == "X_Y_Z":
            return np.stack([self._items.read(item).reshape(-1) for item in geometry.findall("DataItem")], axis=1).astype(
                np.float64
            )
        if kind not in ("XYZ", "XY"):
            raise ValueError(f"its geometry is {kind[:30]}, which is not read; XYZ or XY is needed")
        points = self._items.read(_item(geometry)).reshape(-1, len(kind))
        points = points if points.dtype.kind == "f" else points.astype(np.float64)
        flat = np.zeros((len(points), 3 - len(kind)), points.dtype)
        return np.concatenate([points, flat], axis=1).astype(points.dtype.newbyteorder("="), copy=False)

    def _numbers(self, attribute: ElementTree.Element) -> Array:
        return self._items.read(_item(attribute))

    def _function(self, attribute: ElementTree.Element, cells: Cells, is_flat: bool) -> Array:
        """A function's values at the corners of its cells, or in its cells: ``(N, C)``."""
        dofs, vector, starts, listed = (self._items.read(item).reshape(-1) for item in _items(attribute, 4))
        width = COMPONENTS.get((attribute.get("AttributeType") or "Scalar").upper(), 1)
        per_cell = np.diff(starts.astype(np.int64))
        listed = listed.astype(np.int64)
        if len(per_cell) != len(listed) or len(np.unique(per_cell)) != 1 or per_cell[0] * len(listed) != len(dofs):
            raise ValueError("a function has cells of different numbers of values, which are not read")
        if len(listed) and not 0 <= listed.min() <= listed.max() < len(cells.types):
            raise ValueError(f"a function has cells up to {int(listed.max())}; there are {len(cells.types)}")
        if len(dofs) and not 0 <= dofs.min() <= dofs.max() < len(vector):
            raise ValueError(f"a function has values up to {int(dofs.max())}; there are {len(vector)}")
        values = vector[dofs.astype(np.int64)].reshape(len(listed), width, -1)  # (cells, components, values of a cell)
        if is_flat:
            result = np.zeros((len(cells.types), width))
            result[listed] = values[:, :, 0]
            return result
        n_corners = CORNERS.get(int(cells.types[0]), 0)
        if not n_corners or values.shape[2] < n_corners:
            raise ValueError(f"a function has {values.shape[2]} values a cell; one per corner is needed")
        nodes = cells.nodes[cells.offsets[listed, None] + np.arange(n_corners)]
        result = np.zeros((int(cells.nodes.max()) + 1, width))
        result[nodes.reshape(-1)] = values[:, :, :n_corners].transpose(0, 2, 1).reshape(-1, width)
        return result

    def _times(self, collection: ElementTree.Element, grids: list[ElementTree.Element]) -> Float64 | None:
        own = collection.find("Time")
        if own is not None and own.find("DataItem") is not None:
            values = self._items.read(_item(own)).astype(np.float64).reshape(-1)
            if own.get("TimeType", "").lower() == "hyperslab" and len(values) == 3:
                values = values[0] + values[1] * np.arange(len(grids))
            return values if len(values) == len(grids) else None
        found = [next(self._references.target(grid).iter("Time"), None) for grid in grids]
        if any(time is None or time.get("Value") is None for time in found):
            return None
        return np.array([float(time.get("Value", "0")) for time in found if time is not None])


def _parse(path: Path) -> ElementTree.Element:
    if path.stat().st_size > LARGEST_XML:
        raise ValueError(f"it has {path.stat().st_size} bytes of XML; put its numbers into HDF5")
    return parse_xml(path.read_bytes(), "Xdmf")


def _item(element: ElementTree.Element) -> ElementTree.Element:
    return _items(element, 1)[0]


def _items(element: ElementTree.Element, count: int) -> list[ElementTree.Element]:
    found = element.findall("DataItem")
    if len(found) < count:
        raise ValueError(f"{element.tag} {element.get('Name', '')[:40]!r} has {len(found)} DataItems; {count} are needed")
    return found[:count]


def _mixed(flat: Array) -> Cells:
    """Cells of several types: each is its number, for some the count of its nodes, and its nodes."""
    types: list[int] = []
    starts: list[int] = []
    sizes: list[int] = []
    at = 0
    numbers = flat.tolist()
    streams: list[tuple[int, int]] = []
    while at < len(numbers):  # every cell says where the next one starts
        kind = NUMBERS.get(numbers[at])
        if kind is None:
            raise ValueError(f"its topology has a cell of type {numbers[at]}, which is not read")
        if kind == POLYHEDRON:
            stop = _end_of_stream(numbers, at + 1)
            streams.append((at + 1, stop))
            types.append(kind)
            starts.append(at + 1)
            sizes.append(0)
            at = stop
            continue
        has_count = not SIZES.get(kind)
        size = SIZES.get(kind) or (numbers[at + 1] if at + 1 < len(numbers) else -1)
        start = at + 1 + has_count
        if size < 1 or start + size > len(numbers):
            raise ValueError("its mixed topology is cut short")
        types.append(kind)
        starts.append(start)
        sizes.append(size)
        at = start + size
    kinds, counts = np.array(types, np.uint8), np.array(sizes, np.int64)
    nodes = flat[ranges(np.array(starts, np.int64), counts)]
    bounds = np.array(streams, np.int64).reshape(-1, 2)
    return listed_cells(kinds, from_streams(flat.astype(np.int64), bounds[:, 0], bounds[:, 1]), nodes, counts)


def _end_of_stream(numbers: list[int], at: int) -> int:
    """Where a polyhedron's faces end: their number, then for each the number of its corners and these."""
    if at >= len(numbers):
        raise ValueError("its mixed topology is cut short")
    left, at = numbers[at], at + 1
    while left > 0 and at < len(numbers) and numbers[at] >= 0:
        left, at = left - 1, at + 1 + numbers[at]
    if left or at > len(numbers):
        raise ValueError("its mixed topology is cut short")
    return at
