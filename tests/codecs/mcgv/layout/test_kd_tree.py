"""Layout by halving: the pixels of the format's description, neighbours side by side."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from placing import halved
from surfaces import awkward_surfaces, check_layout

from gvcodecs.mcgv.layout import kd_tree
from gvcodecs.mcgv.layout.kd_tree import FRAME, choose_size, place_points, second_moments
from gvcodecs.mcgv.layout.kd_tree_kernels import Halving, place_cells
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.mesh.lattice import Lattice


@pytest.mark.parametrize("name", awkward_surfaces())
@pytest.mark.parametrize("block", [pytest.param(8, marks=pytest.mark.slow), 16])
def test_placement_follows_its_description(name: str, block: int) -> None:
    """The same pixels as a recursion in Python's integers; one pixel each, also in the tightest plane and with groups."""
    points = np.asarray(awkward_surfaces()[name][0])
    groups = np.random.default_rng(9).integers(0, 5, len(points))
    for bits, labels in ((4, None), (12, None), (12, groups), (20, groups)):
        lattice = Lattice.over(points, bits).quantise(points)
        width, height = choose_size(len(points), block)
        for size in ((width, height), (width + 3 * block, height), (block, block * -(-len(points) // block**2))):
            layout = place_points(lattice, labels, *size, block)
            assert (layout.width, layout.height) == size
            check_layout(layout, np.zeros(len(points), np.int32), block)
            wanted = halved(lattice.tolist(), None if labels is None else labels.tolist(), *size, block)
            assert layout.pixel.tolist() == wanted


@pytest.mark.parametrize("name", awkward_surfaces())
def test_halves_on_threads_get_the_same_pixels(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.asarray(awkward_surfaces()[name][0])
    lattice = Lattice.over(points, 12).quantise(points)
    groups = np.random.default_rng(7).integers(0, 3, len(points))
    width, height = choose_size(len(points), 16)
    for size, labels in (((width, height), None), ((width + 48, 3 * height), groups)):
        expected = place_points(lattice, labels, *size, 16).pixel
        with monkeypatch.context() as patch:
            patch.setattr(kd_tree, "LARGE", 1)
            assert np.array_equal(place_points(lattice, labels, *size, 16).pixel, expected)


def test_placement_keeps_neighbours_together() -> None:
    """A regular sheet comes out as it is; two sheets that overlap come apart as groups."""
    x, y = np.meshgrid(np.arange(32), np.arange(32))
    sheet = np.stack([10 * x.ravel(), 10 * y.ravel(), 0 * x.ravel()], axis=1)
    shuffled = np.random.default_rng(0).permutation(len(sheet))
    layout = place_points(sheet[shuffled], None, 32, 32, 16)
    rows, columns = np.divmod(layout.pixel[np.argsort(shuffled)].reshape(32, 32), 32)
    assert (np.abs(np.diff(rows, axis=0)) + np.abs(np.diff(columns, axis=0)) == 1).all()
    assert (np.abs(np.diff(rows, axis=1)) + np.abs(np.diff(columns, axis=1)) == 1).all()
    both, group = np.concatenate([sheet, sheet + np.array([160, 1, 1])]), np.repeat([0, 1], len(sheet))
    apart = place_points(both, group, 64, 32, 16).pixel % 64 // 32
    assert len(np.unique(np.c_[apart, group], axis=0)) == 2
    mixed = place_points(both, None, 64, 32, 16).pixel % 64 // 32
    assert len(np.unique(np.c_[mixed, group], axis=0)) == 4


@given(st.integers(1, 5000), st.sampled_from([8, 16]))
@settings(max_examples=120)
def test_automatic_planes_are_small_and_fair(n_vertices: int, block: int) -> None:
    """Whole blocks, room for all, less than a row of blocks too many, sides within three to one (or all that there are)."""
    width, height = choose_size(n_vertices, block)
    assert width % block == height % block == 0
    needed = -(-n_vertices // block**2)
    assert needed <= (width // block) * (height // block) < needed + max(width, height) // block
    assert max(width, height) <= 3 * min(width, height)


def test_placement_refuses_planes_too_small() -> None:
    with pytest.raises(InputError, match="16x16"):
        place_points(np.zeros((257, 3), np.int64), None, 16, 16, 16)


def test_lattices_too_fine_for_halves_are_corrupt() -> None:
    points = np.array([[0, 0, 0], [1, 2, (1 << 20) - 1]])
    assert sorted(place_points(points, None, 16, 16, 16).pixel) == sorted(set(place_points(points, None, 16, 16, 16).pixel))
    with pytest.raises(CorruptFile, match="too fine"):
        place_points(points + 1, None, 16, 16, 16)


@pytest.mark.parametrize("n_cells", [1, 7, 300])
def test_cells_are_measured(n_cells: int) -> None:
    """The kernel gives the second moments that NumPy does."""
    draw = np.random.default_rng(n_cells)
    points = draw.integers(0, 9, (2000, 3)) * 60
    starts = np.r_[0, np.sort(draw.choice(np.arange(1, 2000), n_cells - 1, replace=False)), 2000].astype(np.int64)
    order = draw.permutation(2000)
    for counts in (None, draw.integers(1, 5, 2000)):
        times = np.ones(2000, np.int64) if counts is None else counts
        n = np.add.reduceat(times, starts[:-1])
        means = np.add.reduceat(points[order] * times[:, None], starts[:-1], axis=0) // n[:, None]
        x, y, z = ((points[order] - np.repeat(means, np.diff(starts), axis=0)) >> 3).T
        products = np.stack([x * x, y * y, z * z, x * y, x * z, y * z], axis=1)
        moments = np.add.reduceat(products * times[:, None], starts[:-1], axis=0)
        assert np.array_equal(second_moments(points, order, starts, 3, counts), moments)


@pytest.mark.parametrize("scale", [1, 60, 40_000])  # places are counted, digit by digit, or runs of points merged
def test_cells_are_halved_down_to_pixels(scale: int) -> None:
    """The kernel gives each vertex the pixel that cutting cell after cell does, sorted anew for every cut."""
    draw = np.random.default_rng(3)
    sides, x = [(4, 4), (4, 2), (1, 3), (3, 4), (1, 1), (4, 1), (2, 4), (48, 80), (7, 30), (16, 5)], 0
    rectangles, starts = [], [0]
    for width, height in sides:
        rectangles.append((x, 5, width, height))
        starts.append(starts[-1] + int(draw.integers(1, width * height + 1)))
        x += width
    points, order = draw.integers(0, 4, (starts[-1], 3)) * scale, draw.permutation(starts[-1])
    directions = draw.integers(-2, 3, (len(sides), 6))
    wanted = np.full(len(order), -1)

    def halve(vertices: Int64, at: tuple[int, int], side: tuple[int, int], turned: Int64) -> None:
        if not len(vertices):
            return
        if side == (1, 1):
            wanted[vertices] = at[1] * 400 + at[0]
            return
        axis = 0 if side[0] >= side[1] else 1
        vertices = vertices[np.argsort(points[vertices] @ turned[3 * axis : 3 * axis + 3], kind="stable")]
        first = side[axis] // 32 * 16 if side[axis] >= 32 else side[axis] // 2
        kept = (2 * len(vertices) * first + side[axis]) // (2 * side[axis])
        one, two, further = list(side), list(side), list(at)
        one[axis], two[axis], further[axis] = first, side[axis] - first, at[axis] + first
        halve(vertices[:kept], at, (one[0], one[1]), turned)
        halve(vertices[kept:], (further[0], further[1]), (two[0], two[1]), turned)

    for cell, (left, top, width, height) in enumerate(rectangles):
        halve(order[starts[cell] : starts[cell + 1]], (left, top), (width, height), directions[cell])
    pixel = np.empty(len(order), np.int64)
    halving = Halving(points, 400, 16, FRAME, -1)
    place_cells(order.copy(), np.array(starts), np.array(rectangles), directions, halving, pixel, False)
    assert np.array_equal(pixel, wanted)
    assert len(np.unique(pixel)) == len(pixel)
