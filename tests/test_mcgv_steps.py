"""The steps of the geometry-video codec, and the pieces under them, each against an independent formula."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from placing import halved
from scipy import sparse
from scipy.sparse.linalg import spsolve
from sequences import waving

import gvpipe
from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base import start
from gvcodecs.mcgv.layout.coding import (
    decode_clusters,
    decode_pixels,
    decode_slot_clusters,
    encode_clusters,
    encode_pixels,
    encode_slot_clusters,
)
from gvcodecs.mcgv.layout.kd_tree import choose_size, place_points
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.packing import pack
from gvcodecs.mcgv.layout.padding import Padding
from gvcodecs.mcgv.layout.parameterization import Atlas, parameterize
from gvcodecs.mcgv.motion.affine_coding import decode_transforms, dequantise, encode_transforms, quantise
from gvcodecs.mcgv.motion.affine_fit import AffinePredictor
from gvcodecs.mcgv.motion.segmentation import LocalAffineFit, segment
from gvcodecs.mcgv.pictures.quantiser import LEVELS, OUTLIERS, QP_STEP, Magnitudes, choose_quantiser
from gvpipe.container import bitstream
from gvpipe.container.bitstream import ENTRY, MAGIC, PREFIX, Bitstream, pack_payload, unpack_payload
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.errors import CorruptFile, FormatError, InputError, NewerVersion, TruncatedFile
from gvpipe.media.video import PROFILES
from gvpipe.mesh.lattice import Lattice
from gvpipe.mesh.topology import adjacency, components, k_ring, unique_edges, weld
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.quality_scale import error_of
from gvpipe.registry import open_reader
from gvpipe.sequence import MeshSequence

calmly = settings(max_examples=120, deadline=None)
VALUES = st.one_of(st.integers(-20, 20), st.integers(-(2**39) + 1, 2**39 - 1), st.integers(-5000, 5000))


def bumpy_sheet(n: int = 9, seed: int = 0) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A sheet of n^2 vertices with random bumps, so that no neighbourhood is flat."""
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)))
    random = np.random.default_rng(seed)
    points = np.stack([x.ravel(), y.ravel(), random.normal(0, 1, n * n)], axis=1)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return points, np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)]).astype(np.int32)


def walk(faces: NDArray[np.int32], start: int, k: int) -> set[int]:
    """Vertices that a path of at most k edges reaches."""
    reached = {start}
    for _ in range(k):
        reached = reached.union(*(set(face) for face in faces.tolist() if reached & set(face)))
    return reached


def affine_maps(n: int, seed: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """``(n, 3, 3)`` matrices (as x A) and ``(n, 3)`` translations."""
    random = np.random.default_rng(seed)
    return np.eye(3) + random.normal(0, 0.4, (n, 3, 3)), random.normal(0, 3, (n, 3))


# local affine motion (equation 1)


def test_local_motion_is_the_true_map() -> None:
    """On a mesh that moves affinely, every vertex finds that motion, up to the ridge's pull (1e-6 of the spread)."""
    points, faces = bumpy_sheet()
    linear, shift = affine_maps(4)
    frames = np.einsum("vi,nij->nvj", points, linear) + shift[:, None]
    motion = LocalAffineFit(points, k_ring(adjacency(faces, len(points)), 3)).motion(frames)
    assert motion.shape == (len(points), 4, 4, 3)
    np.testing.assert_allclose(motion[:, :, :3], np.broadcast_to(linear - np.eye(3), (len(points), 4, 3, 3)), atol=1e-4)
    moved = np.einsum("vi,vnij->nvj", points, motion[:, :, :3]) + motion[:, :, 3].swapaxes(0, 1) + points
    np.testing.assert_allclose(moved, frames, atol=1e-4)


def test_local_motion_is_the_ridge_regression() -> None:
    """Each vertex' fit to a random motion equals ordinary least squares over its 3-ring with the ridge as extra rows."""
    points, faces = bumpy_sheet(6)
    points = points / 6 - 0.4
    frames = points + np.random.default_rng(2).normal(0, 0.3, (3, *points.shape))
    motion = LocalAffineFit(points, k_ring(adjacency(faces, len(points)), 3)).motion(frames)
    for v in range(len(points)):
        ring = sorted(walk(faces, v, 3))
        centred = points[ring] - points[ring].mean(axis=0)
        ridge = 1e-6 * (centred**2).sum() + 1e-12
        rows = np.vstack([np.c_[centred, np.ones(len(ring))], np.c_[np.sqrt(ridge) * np.eye(3), np.zeros(3)]])
        for i, frame in enumerate(frames):
            wanted, *_ = np.linalg.lstsq(rows, np.vstack([(frame - points)[ring], np.zeros((3, 3))]), rcond=None)
            wanted[3] -= points[ring].mean(axis=0) @ wanted[:3]  # back from the ring's mean to the origin
            np.testing.assert_allclose(motion[v, i], wanted, atol=1e-8)


# segmentation


def two_halves(n_frames: int = 6) -> tuple[MeshSequence, NDArray[np.bool_]]:
    """A sheet whose left and right halves turn rigidly about different axes."""
    points, faces = bumpy_sheet(14)
    right = points[:, 0] > 6.5
    frames = np.tile(points, (n_frames, 1, 1))
    for f in range(1, n_frames):
        c, s = np.cos(0.15 * f), np.sin(0.15 * f)
        frames[f, right] = (points[right] - 7) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) + 7
        frames[f, ~right] = points[~right] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return MeshSequence(frames.astype(np.float32), faces), right


def test_segmentation_finds_the_rigid_parts() -> None:
    """Two rigid halves, K = 2: exactly the halves, and the prediction then leaves nothing; the same again.

    Where the halves are one surface, neighbours have a say: a vertex at the border may go either way, here at most 1 in 100.
    """
    sequence, right = two_halves()
    base = sequence.read(0, 1)[0].astype(float)
    joined = segment(sequence, base, adjacency(sequence.faces, len(base)), 2)
    wrong = (joined == joined[13]) != right
    assert set(joined) == {0, 1} and wrong.mean() <= 0.01 and np.abs(base[wrong, 0] - 6.5).max(initial=0) < 1
    torn = sequence.faces[right[sequence.faces].all(axis=1) | ~right[sequence.faces].any(axis=1)]
    clusters = segment(sequence, base, adjacency(torn, len(base)), 2)
    assert np.array_equal(clusters == clusters[13], right)
    predictor, frames = AffinePredictor(base, clusters, 2), sequence.read(0, 6).astype(float)
    assert np.abs(predictor.predict(predictor.fit(frames)) - frames).max() < 1e-5
    assert np.array_equal(segment(sequence, base, adjacency(torn, len(base)), 2), clusters)


@pytest.mark.parametrize("n_clusters", [1, 3, 20, 1000])
def test_segmentation_numbers_its_clusters(n_clusters: int) -> None:
    """Never more than K clusters, none empty; also for more clusters than points, still points and loose points."""
    points, faces = bumpy_sheet(5)
    moving = points + np.random.default_rng(3).normal(0, 0.2, (4, *points.shape))
    for frames, triangles in ((moving, faces), (np.tile(points, (4, 1, 1)), faces), (moving, faces[:3]), (moving[:1], faces)):
        sequence = MeshSequence(frames.astype(np.float32), triangles)
        clusters = segment(sequence, points, adjacency(triangles, 25), n_clusters)
        assert clusters.shape == (25,) and set(clusters.tolist()) == set(range(int(clusters.max()) + 1))
        assert clusters.max() < n_clusters


# prediction (equations 2 to 4)


def test_prediction_is_least_squares() -> None:
    """Per cluster and frame the residual is that of lstsq on homogeneous coordinates; an affine motion leaves none."""
    points, _ = bumpy_sheet()
    random = np.random.default_rng(4)
    clusters = random.integers(0, 4, len(points)).astype(np.int32)
    frames = random.normal(0, 5, (5, *points.shape))
    predictor = AffinePredictor(points, clusters, 6)  # two clusters are empty
    predicted = predictor.predict(predictor.fit(frames))
    homogeneous = np.c_[points, np.ones(len(points))]
    for k in range(4):
        own = clusters == k
        for i in range(5):
            rows, *_ = np.linalg.lstsq(homogeneous[own], frames[i, own], rcond=None)
            np.testing.assert_allclose(predicted[i, own], homogeneous[own] @ rows, atol=1e-9)
    linear, shift = affine_maps(4, 5)
    moved = np.einsum("vi,vij->vj", points, linear[clusters]) + shift[clusters]
    np.testing.assert_allclose(predictor.predict(predictor.fit(moved[None]))[0], moved, atol=1e-10)
    np.testing.assert_allclose(predictor.predict(predictor.rest[None])[0], points, atol=1e-12)
    errors = predictor.squared_errors(frames, predictor.fit(frames))
    for k in range(6):
        alone = AffinePredictor(points, clusters, 6)
        local = (points - alone._frame[k, :3]) / (alone._frame[k, 3] or 1.0)
        direct = np.einsum("vj,njc->nvc", np.c_[local, np.ones(len(points))], predictor.fit(frames)[:, k])
        np.testing.assert_allclose(errors[:, k], ((frames - direct) ** 2).sum(axis=(0, 2)), rtol=1e-8, atol=1e-8)


def test_prediction_is_stable() -> None:
    """One, two and three points, coplanar and collinear ones, far from the origin: finite, no worse than the mean, and moved by
    no more than a few times as much as the input is."""
    random = np.random.default_rng(6)
    shapes = [random.normal(size=(n, 3)) for n in (1, 2, 3, 4, 30)]
    shapes += [random.normal(size=(30, 3)) * [1, 1, flat] for flat in (0, 1e-12, 1e-5, 1e-3)] + [
        np.outer(np.arange(9.0), [1, 2, 3])
    ]
    for offset in (0.0, 1e4):
        for points in shapes:
            frames = random.normal(size=(3, *points.shape)) + offset
            predictor = AffinePredictor(points + offset, np.zeros(len(points), np.int32), 1)
            predicted = predictor.predict(predictor.fit(frames))
            spread = np.sqrt(((frames - frames.mean(axis=1, keepdims=True)) ** 2).sum())
            still = np.sqrt(((frames - (points + offset)) ** 2).sum())
            assert np.sqrt(((frames - predicted) ** 2).sum()) <= max(spread, still) * (1 + 1e-9) + 1e-9
            nudged = frames + random.choice([-1e-9, 1e-9], frames.shape)
            assert np.abs(predictor.predict(predictor.fit(nudged)) - predicted).max() < 1e-7


# transforms section


@pytest.mark.parametrize("scale", [0, 1, 3, 1000, 1e8])
@pytest.mark.parametrize("n_frames", [1, 2, 3, 40])
def test_transforms_round_trip(scale: float, n_frames: int) -> None:
    """Noise, random walks and smooth motion at any size come back exactly; smooth motion costs less than noise."""
    random = np.random.default_rng(n_frames)
    noise = np.rint(random.normal(0, scale, (n_frames, 3, 4, 3))).astype(np.int64)
    smooth = np.rint(scale * np.sin(np.arange(n_frames)[:, None, None, None] / 40 + random.uniform(0, 6, (3, 4, 3)))).astype(
        np.int64
    )
    coded = []
    for lattice in (noise, noise.cumsum(axis=0), smooth):
        coded.append(encode_transforms(lattice))
        assert np.array_equal(decode_transforms(coded[-1], n_frames, 3, "transforms.0"), lattice)
    assert n_frames < 40 or scale < 1000 or len(coded[2]) < len(coded[0])
    for cut in range(0, len(coded[0]), 1 + len(coded[0]) // 60):
        with pytest.raises(CorruptFile, match=r"transforms\.0"):
            decode_transforms(coded[0][:cut], n_frames, 3, "transforms.0")


def test_transforms_quantise_within_half_a_step() -> None:
    random = np.random.default_rng(7)
    rest, moved = random.normal(0, 1, (5, 4, 3)), random.normal(0, 9, (8, 5, 4, 3))
    for step in (1e-6, 0.01, 3.0):
        assert np.abs(dequantise(quantise(moved, rest, step), rest, step) - moved).max() <= step / 2 * (1 + 1e-9)


# parameterization and packing


def awkward_surfaces() -> dict[str, tuple[NDArray[np.float64], NDArray[np.int32]]]:
    points, faces = bumpy_sheet(12)
    random = np.random.default_rng(8)
    soup = random.normal(size=(90, 3))
    fan = np.array([[0, i, i + 1] for i in range(1, 40)], np.int32)
    return {
        "sheet": (points, faces),
        "unreferenced": (np.vstack([points, random.normal(size=(30, 3))]), faces),
        "soup": (soup, np.arange(90, dtype=np.int32).reshape(30, 3)),
        "non-manifold": (soup[:42], np.vstack([fan, fan[:, ::-1], [[0, 1, 41]]]).astype(np.int32)),
        "degenerate": (np.vstack([points, points[:5]]), np.vstack([faces, [[0, 0, 1], [144, 145, 146]]]).astype(np.int32)),
        "one triangle": (soup[:3], np.array([[0, 1, 2]], np.int32)),
        "a point": (soup[:1], np.zeros((0, 3), np.int32)),
        "all in one place": (np.zeros((20, 3)), np.arange(18, dtype=np.int32).reshape(6, 3)),
        "a line": (np.outer(np.arange(20.0), [1, 0, 0]), np.array([[i, i + 1, i + 2] for i in range(18)], np.int32)),
        "tiny": (points * 1e-20, faces),
        "huge and far": (points * 1e20 + 1e24, faces),
    }


@pytest.mark.parametrize("name", awkward_surfaces())
@pytest.mark.parametrize("block", [8, 16])
def test_layout_invariants(name: str, block: int) -> None:
    """Every vertex has a pixel of its own inside whole blocks; charts keep to one cluster, blocks to one chart; repeatable."""
    points, faces = awkward_surfaces()[name]
    clusters = np.unique(np.random.default_rng(9).integers(0, 4, len(points)), return_inverse=True)[1].astype(np.int32)
    for labels in (np.zeros(len(points), np.int32), clusters):
        atlas = parameterize(points, faces, labels)
        assert atlas.chart.shape == (len(points),) and set(atlas.chart.tolist()) == set(range(atlas.n_charts))
        assert np.isfinite(atlas.uv).all() and ((atlas.fill > 0) & (atlas.fill <= 1)).all()
        assert len(np.unique(np.c_[atlas.chart, labels], axis=0)) == atlas.n_charts
        layout = pack(atlas, block, 1.5, None)
        check_layout(layout, atlas.chart, block)
        assert np.array_equal(layout.pixel, pack(parameterize(points, faces, labels), block, 1.5, None).pixel)
        order = np.random.default_rng(1).permutation(len(points))  # the codec's, which files have before version 3
        walked = dataclasses.replace(layout, pixel=layout.pixel[order])
        back = decode_pixels(encode_pixels(walked), order, layout.width, layout.height)
        assert np.array_equal(back.pixel, layout.pixel)
        coded = encode_slot_clusters(labels[order])
        assert np.array_equal(decode_slot_clusters(coded, order, 4), labels)
        coded = encode_clusters(labels, layout, block)
        assert np.array_equal(decode_clusters(coded, layout, block, 4), labels)


def check_layout(layout: Layout, chart: NDArray[Any], block: int) -> None:
    assert layout.width % block == layout.height % block == 0
    assert len(np.unique(layout.pixel)) == len(layout.pixel) == len(chart)
    assert layout.pixel.min() >= 0 and layout.pixel.max() < layout.width * layout.height
    y, x = np.divmod(layout.pixel, layout.width)
    owner: dict[tuple[int, int], int] = {}
    for by, bx, c in zip((y // block).tolist(), (x // block).tolist(), chart.tolist(), strict=True):
        assert owner.setdefault((by, bx), c) == c


def test_given_size_fits_or_says_so() -> None:
    """From far too small to generous: an InputError that names the size, or a layout of exactly that size."""
    points, faces = bumpy_sheet(20)
    atlas = parameterize(points, faces, (points[:, 0] > 9).astype(np.int32))
    fitted = []
    for side in range(1, 9):
        for size in ((8 * side, 8 * side), (8 * side, 64), (64, 8 * side)):
            try:
                layout = pack(atlas, 8, 2.0, size)
            except InputError as exc:
                assert f"{size[0]}x{size[1]}" in str(exc) and "\n" not in str(exc)
            else:
                assert (layout.width, layout.height) == size and size[0] * size[1] >= 400
                check_layout(layout, atlas.chart, 8)
                fitted.append(size)
    assert (64, 64) in fitted and (8, 8) not in fitted and (16, 16) not in fitted


def test_points_at_one_place_of_a_chart_get_pixels_of_their_own() -> None:
    """They crowd around it."""
    uv = np.repeat(np.array([[0.0, 0], [1, 0], [0, 1]]), [1, 40, 1], axis=0)
    layout = pack(Atlas(np.zeros(42, np.int32), uv, np.array([0.5])), 8, 1.5, None)
    check_layout(layout, np.zeros(42), 8)


# placement by halving


@pytest.mark.parametrize("name", awkward_surfaces())
@pytest.mark.parametrize("block", [8, 16])
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
@calmly
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


# padding (equations 5 and 6)


@pytest.mark.parametrize("block", [8, 16])
def test_padding_minimises_psi(block: int) -> None:
    """One sparse system of all blocks gives the same planes; psi's gradient is zero at free pixels; vertices keep theirs."""
    random = np.random.default_rng(block)
    width, height = 3 * block, 2 * block
    used = random.permutation(width * height)
    used = used[(used // width // block != 1) | (used % width // block != 2)]  # one block stays empty
    pixel = np.concatenate([used[:40], [0, width - 1]])
    pixel = pixel[np.sort(np.unique(pixel, return_index=True)[1])]
    values = random.normal(0, 50, (4, len(pixel)))
    planes = Padding(Layout(width, height, pixel), block).fill(values, 7.25).reshape(4, -1)
    assert np.array_equal(planes[:, pixel], values)
    y, x = np.divmod(np.arange(width * height), width)
    pairs = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        inside = (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        p = np.flatnonzero(inside)
        q = p + dy * width + dx
        same = (y[p] // block == y[q] // block) & (x[p] // block == x[q] // block)
        pairs.append(np.c_[p[same], q[same]])
    p, q = np.concatenate(pairs).T
    assert len(p) == 6 * (4 * block**2 - 6 * block + 2)
    rows = np.arange(len(p))
    difference = sparse.csr_array((np.r_[np.ones(len(p)), -np.ones(len(p))], (np.r_[rows, rows], np.r_[p, q])))
    laplacian = sparse.csr_array(difference.T @ difference)
    block_of = y // block * 3 + x // block
    empty = ~np.isin(block_of, block_of[pixel])
    assert empty.any() and (planes[:, empty] == 7.25).all()
    free = ~empty
    free[pixel] = False
    free_at = np.flatnonzero(free)
    system = sparse.csc_array(laplacian[free_at][:, free_at])
    wanted = spsolve(system, -(laplacian[free_at][:, pixel] @ values.T)).T
    np.testing.assert_allclose(planes[:, free_at], wanted, atol=1e-9)
    assert np.abs((laplacian @ planes.T)[free_at]).max() < 1e-9
    assert planes[:, ~empty].max() <= values.max() + 1e-9 and planes[:, ~empty].min() >= values.min() - 1e-9


def test_padding_of_full_and_single_blocks() -> None:
    """A block full of vertices is passed on; one vertex fills its block evenly."""
    full = Padding(Layout(8, 8, np.random.default_rng(0).permutation(64)), 8)
    values = np.arange(64.0)[None]
    assert np.array_equal(np.sort(full.fill(values, 0.0).ravel()), values[0])
    np.testing.assert_allclose(
        Padding(Layout(16, 8, np.array([5])), 8).fill(np.array([[3.5]]), -1.0)[0, :, :8], 3.5, rtol=1e-12
    )


# quality


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("largest", [1e-9, 1e-3, 0.05, 0.5, 20.0])
def test_quality_is_monotone(name: str, largest: float) -> None:
    """The step that a coefficient sees is the one asked for; levels are finer; nearly all residuals fit."""
    profile = PROFILES[name]
    usual = 2.7 if name == "h264-10" else 2.1  # decades to 100 by the slope up to 75
    magnitudes = Magnitudes()
    magnitudes.add(largest * np.linspace(-1, 1, 30_001) ** 9)
    effective = []
    for quality in np.linspace(0, 100, 201):
        wanted = 2.0 * 0.08 * 10 ** -np.interp(quality, [0, 75, 100], [0, 0.75 * usual, 2.7])
        chosen = choose_quantiser(wanted, profile, magnitudes)
        reach = chosen.step * profile.amplitude * (1 + 1e-9)
        assert isinstance(chosen.level, int)
        levels = wanted / chosen.step
        if name == "jpeg":
            assert 1 <= chosen.level <= 255 and levels >= LEVELS[0] * (1 - 1e-9)
            step = float(chosen.level)
        else:
            assert 1 <= chosen.level <= (63 if profile.depth == 10 else 51)
            step = QP_STEP * 2 ** (chosen.level / 6)
            assert levels >= LEVELS[0] * 2 ** (-1 / 6)  # quantisers come in sixths of an octave
        if largest > reach:
            assert levels <= LEVELS[1] * (1 + 1e-9)
            assert levels <= LEVELS[0] * (1 + 1e-9) or magnitudes.common <= reach
        effective.append(chosen.step * step)
        assert effective[-1] == pytest.approx(wanted, rel=1e-9)
    assert np.all(np.diff(effective) <= np.array(effective[1:]) * 1e-9)


def test_magnitudes_are_those_of_the_sorted_coordinates() -> None:
    """Within a bin, an eighth of an octave; however they come, zeros and subnormal numbers too."""
    rng = np.random.default_rng(2)
    for scale in (1e-310, 1.0, 1e300):
        values = scale * rng.standard_t(2, (40, 50, 3))
        magnitudes = Magnitudes()
        for part in np.split(values, [1, 17]):
            magnitudes.add(part)
        wanted = np.quantile(np.abs(values), 1 - OUTLIERS)
        assert magnitudes.largest == np.abs(values).max()
        assert wanted * 0.999 <= magnitudes.common <= wanted * 1.2 or scale < 1e-307
    still = Magnitudes()
    still.add(np.zeros((2, 3, 3)))
    assert still.largest == still.common == 0.0 == Magnitudes().common


# entropy coding


@calmly
@given(st.lists(st.tuples(VALUES, st.integers(0, 6)), max_size=60), st.booleans())
def test_integers_round_trip(pairs: list[tuple[int, int]], grouped: bool) -> None:
    values = np.array([value for value, _ in pairs], np.int64)
    contexts = np.array([context for _, context in pairs], np.int64) if grouped else None
    data = encode_integers(values, contexts)
    assert np.array_equal(decode_integers(data, len(values), contexts), values)
    for bad in (data + b"\0", data[:-1]):
        try:
            assert len(decode_integers(bad, len(values), contexts)) == len(values)
        except CorruptFile:
            continue
        raise AssertionError("a byte more or less went unnoticed")


@calmly
@given(st.binary(max_size=80), st.integers(0, 50), st.booleans())
def test_garbage_is_corrupt_or_decodes(data: bytes, count: int, grouped: bool) -> None:
    contexts = np.arange(count) % 3 if grouped else None
    try:
        assert len(decode_integers(data, count, contexts)) == count
    except CorruptFile as exc:
        assert "\n" not in str(exc)


def test_damaged_integers_never_fail_otherwise() -> None:
    """Every byte of a real block changed in several ways."""
    random = np.random.default_rng(10)
    values, contexts = np.rint(random.laplace(0, 30, 500)).astype(np.int64), random.integers(0, 4, 500)
    data = encode_integers(values, contexts)
    for i in range(len(data)):
        for mask in (1, 0x40, 0x80, 0xFF):
            damaged = bytearray(data)
            damaged[i] ^= mask
            with contextlib.suppress(CorruptFile):
                assert decode_integers(bytes(damaged), 500, contexts).shape == (500,)


def test_integers_cost_about_their_entropy() -> None:
    """Within 2 % and the tables' bytes of the empirical entropy; contexts that tell pay off; too large a value is refused."""
    random = np.random.default_rng(11)
    contexts = random.integers(0, 2, 20_000)
    values = np.rint(random.normal(0, np.where(contexts == 1, 4.0, 0.4))).astype(np.int64)

    def entropy(x: NDArray[np.int64]) -> float:
        share = np.unique(x, return_counts=True)[1] / len(x)
        return float(-(share * np.log2(share)).sum() * len(x) / 8)

    apart = sum(entropy(values[contexts == c]) for c in (0, 1))
    assert apart < len(encode_integers(values, contexts)) < 1.02 * apart + 120
    assert len(encode_integers(values, contexts)) < len(encode_integers(values)) < 1.03 * entropy(values) + 120
    for value in (2**39, -(2**39) - 1, 2**61):
        with pytest.raises(ValueError, match="does not fit"):
            encode_integers(np.array([value]))


# binary


@calmly
@given(st.lists(st.integers(0, 2**64 - 1), max_size=8))
def test_varints(values: list[int]) -> None:
    """LEB128: as long as the bits need, read back in order, no prefix accepted."""
    data = b"".join(map(varint, values))
    assert len(data) == sum(max(1, -(-value.bit_length() // 7)) for value in values)
    cursor = Cursor(data, "x")
    assert [cursor.varint(2**64 - 1) for _ in values] == values and cursor.left == 0
    cursor.end()
    if values:
        with pytest.raises(CorruptFile, match="section 'x'"):
            short = Cursor(data[:-1], "x")
            for _ in values:
                short.varint(2**64 - 1)


def test_cursor_checks_every_read() -> None:
    for read in (lambda c: c.take(4), lambda c: c.array("<u2", 2), lambda c: c.array("<f8", 1 << 62), lambda c: c.varint(0x81),
                 lambda c: c.end(), lambda c: c.struct(ENTRY)):  # fmt: skip
        cursor = Cursor(b"\x82\x01\x03", "x")
        with pytest.raises(CorruptFile, match="section 'x' is corrupt"):
            read(cursor)
    with pytest.raises(CorruptFile, match="longer than 10"):
        Cursor(b"\xff" * 20, "x").varint(2**80)
    for value in (-1, 2**64):
        with pytest.raises(ValueError, match="varint"):
            varint(value)


# bitstream


def small_stream() -> Bitstream:
    header = {"text": "ä", "list": [1, 2.5, None]}
    return Bitstream("mcgv", 1, 7, 11, 5, 29.97, header, {"mesh": b"12345", "order": b"", "x" * 64: bytes(40)}, b"video")


def test_payload_round_trip() -> None:
    stream = small_stream()
    back, extra = unpack_payload(pack_payload(stream, {"id": "abc"}))
    assert back == dataclasses.replace(stream, video=b"") and extra == {"id": "abc"}
    assert list(back.sections) == list(stream.sections) and pack_payload(stream, {"id": "abc"}) == pack_payload(
        stream, {"id": "abc"}
    )


def test_every_damage_to_a_payload_is_noticed() -> None:
    """Every prefix, every byte changed in each bit, and bytes too many."""
    payload = pack_payload(small_stream(), {"id": "abc"})
    for cut in range(len(payload)):
        with pytest.raises(TruncatedFile if cut >= len(MAGIC) else FormatError):
            unpack_payload(payload[:cut])
    for i in range(len(payload)):
        for bit in range(8):
            damaged = bytearray(payload)
            damaged[i] ^= 1 << bit
            with pytest.raises(FormatError):
                unpack_payload(bytes(damaged))
    for extra in (b"\0", payload):
        with pytest.raises(CorruptFile):
            unpack_payload(payload + extra)
    newer = bytearray(payload)
    newer[len(MAGIC) : len(MAGIC) + 2] = (2).to_bytes(2, "little")
    with pytest.raises(NewerVersion, match="upgrade"):
        unpack_payload(bytes(newer))


def sealed(header: bytes, sections_: dict[str, bytes] | None = None) -> bytes:
    """A payload with right checksums around any header."""
    parts = {"header": zlib.compress(header), **(sections_ or {})}
    table = MAGIC + PREFIX.pack(1, len(parts))
    for name, data in parts.items():
        table += bytes([len(name)]) + name.encode() + ENTRY.pack(len(data), zlib.crc32(data))
    return table + zlib.crc32(table).to_bytes(4, "little") + b"".join(parts.values())


def test_hostile_headers() -> None:
    """Right checksums, wrong content: always CorruptFile."""
    good = {
        "codec": "mcgv",
        "version": 1,
        "frames": 1,
        "vertices": 1,
        "triangles": 0,
        "fps": 1.0,
        "container": {},
        "settings": {},
    }
    assert unpack_payload(sealed(json.dumps(good).encode()))[0].n_frames == 1
    wrong: list[Any] = [None, -1, 0.5, "x", [], {}, True, 10**400, 1e308, float("nan"), float("inf")]
    for key in good:
        texts = [json.dumps({**good, key: value}) for value in wrong if key != "codec"] + [json.dumps({**good, key: 0})] * (
            key == "frames"
        )
        texts.append(json.dumps({k: v for k, v in good.items() if k != key}))
        for text in texts:
            if key in ("container", "settings") and '": {}' in text and json.loads(text).get(key) in ({}, []):
                continue
            if key == "fps" and json.loads(text).get(key) in (0.5, True):
                continue
            with pytest.raises(CorruptFile):
                unpack_payload(sealed(text.encode()))
    for raw in (b"", b"{", b"[1]", b"\xff\xfe", b"[" * 100_000, b" " * (1 << 21) + json.dumps(good).encode()):
        with pytest.raises(CorruptFile):
            unpack_payload(sealed(raw))


def test_hostile_codec_headers(sequence: MeshSequence) -> None:
    """A header that lies, with every checksum right: CorruptFile when it opens or when a frame is read, and no NaN ever."""
    stream = Mcgv(preset="ultrafast", clusters=3, gop=4).encode(sequence).bitstream
    wanted = open_reader(stream).read(0, 11)
    assert np.isfinite(wanted).all()
    for key, value in stream.header.items():
        changes: list[Any] = [None, "x", [], 0, -1, 10**9, float("nan"), float("inf"), True, 1e-310]
        if key == "base":
            changes = [
                [*value[:i], bad, *value[i + 1 :]] for i in range(4) for bad in (float("nan"), float("inf"), None, "1")
            ] + [value[:3]]
        for change in changes:
            if change == 10**9 and key.endswith("_step"):
                continue  # a step like any other
            broken = dataclasses.replace(stream, header={**stream.header, key: change})
            with pytest.raises(CorruptFile):
                open_reader(broken).read(0, 11)
        with pytest.raises(CorruptFile):
            open_reader(dataclasses.replace(stream, header={k: v for k, v in stream.header.items() if k != key}))
    for field in ("n_frames", "n_vertices", "n_triangles"):
        for change in (-1, 1, 1000):
            with pytest.raises(CorruptFile):
                broken = dataclasses.replace(stream, **{field: getattr(stream, field) + change})
                open_reader(broken).read(0, broken.n_frames)
    for name, data in stream.sections.items():
        for bad in (None, b"", data[:-1], data + b"\0", bytes(len(data)), b"\xff" * len(data)):
            left = {k: v for k, v in stream.sections.items() if k != name or bad is not None}
            broken = dataclasses.replace(stream, sections={**left, **({name: bad} if bad is not None else {})})
            if name == "order" and bad == b"":
                continue  # the codec's own order
            with pytest.raises(CorruptFile):
                open_reader(broken).read(0, 11)


@pytest.mark.parametrize("scale", [1e-38, 1e-30, 1e-10, 1e10, 1e30, 3e37])
def test_any_float32_scale(sequence: MeshSequence, scale: float) -> None:
    """A model of any size that float32 holds comes back at the same relative error."""
    codec = Mcgv(preset="ultrafast", clusters=3, gop=4)
    scaled = MeshSequence((sequence.read(0, 11) * np.float64(scale)).astype(np.float32), sequence.faces)
    back = open_reader(codec.encode(scaled).bitstream).read(0, 11)
    kg = measure_errors(sequence, lambda start, stop: (back[start:stop].astype(float) / scale).astype(np.float32)).kg
    assert kg is not None and 0.8 * error_of(75) < kg < 1.2 * error_of(75)


# quantize, topology


@calmly
@given(st.integers(0, 2**32 - 1), st.integers(1, 20), st.sampled_from([1e-30, 1e-3, 1.0, 1e6, 1e30]))
def test_lattice(seed: int, bits: int, scale: float) -> None:
    """Indices fill 0..2^bits - 1 along the longest side, points come back within half a step, lattice points exactly."""
    points = np.random.default_rng(seed).normal(size=(20, 3)) * scale * [1, 0.1, 3]
    lattice = Lattice.over(points, bits)
    indices = lattice.quantise(points)
    assert indices.min() == 0 and indices.max() == 2**bits - 1
    assert np.abs(lattice.place(indices) - points).max() <= lattice.step / 2 * (1 + 1e-6)
    assert np.array_equal(lattice.quantise(lattice.place(indices)), indices)


def test_lattice_of_one_place() -> None:
    lattice = Lattice.over(np.full((3, 3), 7.5), 12)
    assert np.array_equal(lattice.place(lattice.quantise(np.full((3, 3), 7.5))), np.full((3, 3), 7.5))


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_k_ring_is_what_a_walk_reaches(k: int) -> None:
    """Against breadth-first search, on a random surface with loose points, degenerate and repeated triangles."""
    random = np.random.default_rng(k)
    faces = np.vstack([random.integers(0, 26, (14, 3)), [[3, 3, 3], [4, 4, 9], [4, 4, 9]]]).astype(np.int32)
    neighbours: dict[int, set[int]] = {v: set() for v in range(30)}
    for a, b, c in faces.tolist():
        for p, q in ((a, b), (b, c), (c, a)):
            if p != q:
                neighbours[p].add(q)
                neighbours[q].add(p)
    matrix = k_ring(adjacency(faces, 30), k)
    assert (matrix.data == 1).all() and np.array_equal(adjacency(faces, 30).toarray(), adjacency(faces, 30).toarray().T)
    seen: set[int] = set()
    n_components = 0
    for v in range(30):
        reached = front = {v}
        for _ in range(k):
            front = set().union(*(neighbours[w] for w in front)) - reached
            reached = reached | front
        assert set(matrix[[v]].indices.tolist()) == reached
        whole, todo = {v}, [v]
        while todo:
            new = neighbours[todo.pop()] - whole
            whole |= new
            todo += new
        n_components += v not in seen
        seen |= whole
    count, labels = components(adjacency(faces, 30))
    assert count == n_components and len(labels) == 30
    edges = {(p, q) for p in neighbours for q in neighbours[p] if p < q}
    assert sorted(map(tuple, unique_edges(faces).tolist())) == sorted(edges)


def test_weld() -> None:
    """First vertices of distinct points, and each vertex' point."""
    points = np.random.default_rng(2).integers(0, 2, (40, 3))
    first, point = weld(points)
    assert np.array_equal(points[first][point], points) and len(first) == len(set(map(tuple, points.tolist())))
    assert all(f == np.flatnonzero((points == points[f]).all(axis=1))[0] for f in first)


@pytest.mark.parametrize(
    ("n_frames", "segments", "n_sections"),
    [(60, 40, 50), pytest.param(4200, start.MAX_SEGMENTS, bitstream.MAX_SECTIONS, marks=pytest.mark.slow)],
)
def test_more_segments_than_sections_are_not_written(
    n_frames: int, segments: int, n_sections: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bitstream has 4096 sections at most; segments then get longer than was asked for.

    Small limits, no farther apart, stand for the real ones.
    """
    assert n_sections - segments <= bitstream.MAX_SECTIONS - start.MAX_SEGMENTS
    monkeypatch.setattr(start, "MAX_SEGMENTS", segments)
    monkeypatch.setattr(bitstream, "MAX_SECTIONS", n_sections)
    away = np.linspace(0, 1, n_frames, dtype=np.float32)[:, None, None]
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    sequence = MeshSequence(square + away, np.array([[0, 1, 2], [0, 2, 3]], np.int32), 30.0)
    gvpipe.encode(sequence, tmp_path / "a.mp4", segment=1, clusters=1, preset="ultrafast")
    assert gvpipe.decode(tmp_path / "a.mp4").n_frames == n_frames


def test_lattices_too_fine_for_halves_are_corrupt() -> None:
    points = np.array([[0, 0, 0], [1, 2, (1 << 20) - 1]])
    assert sorted(place_points(points, None, 16, 16, 16).pixel) == sorted(set(place_points(points, None, 16, 16, 16).pixel))
    with pytest.raises(CorruptFile, match="too fine"):
        place_points(points + 1, None, 16, 16, 16)


def test_b_frames_only_where_they_pay() -> None:
    """Nearly empty pictures go without: tables that tell their order would cost more than they save."""
    sequence = waving(16, 64)
    coarse = Mcgv(prediction="blended", quality=40).encode(sequence).bitstream.video
    assert b"ctts" not in coarse
    rng = np.random.default_rng(0)
    noisy = np.asarray(sequence.positions[:]) + rng.normal(0, 0.02, (64, sequence.n_vertices, 3))
    fine = Mcgv(prediction="affine", quality=75).encode(MeshSequence(noisy.astype(np.float32), sequence.faces)).bitstream.video
    assert b"ctts" in fine
