"""Blended prediction: points, weights, transforms and what a reader makes of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import sparse
from sequences import awkward, grid, waving

from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.base.distinct_positions import keep_apart
from gvcodecs.mcgv.base.welded_points import Points, weld_vertices
from gvcodecs.mcgv.motion.reconstruction_kernels import Sites, SkinnedPoints, rebuild_blended
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Blend, BlendFit, Weights, homogeneous
from gvcodecs.mcgv.motion.skinning_coding import decode_trajectories, encode_trajectories
from gvcodecs.mcgv.motion.skinning_fit import Motions, fit_blend
from gvcodecs.mcgv.motion.weight_coding import decode_weights, encode_weights, guess_prices
from gvcodecs.mcgv.motion.weight_fit_kernels import Transforms
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, cluster_of, list_clusters, new_list, rank_of, suggest
from gvcodecs.mcgv.motion.weight_selection import PointMotions, choose
from gvpipe.connectivity.welded_mesh import WeldedMesh
from gvpipe.container.mp4 import read_file
from gvpipe.errors import CorruptFile, FormatError, NewerVersion
from gvpipe.mesh.lattice import Lattice
from gvpipe.mesh.topology import adjacency
from gvpipe.registry import open_reader
from gvpipe.sequence import MeshSequence
from gvpipe.trajectory.welding import find_points

GOLDEN = Path(__file__).parent / "golden"

Float64 = NDArray[np.float64]


def sheet(n: int = 12) -> tuple[Float64, sparse.csr_array]:
    """Points of a bumpy sheet and their adjacency."""
    points, faces = grid(n)
    points = points.copy()
    points[:, 2] += 0.1 * np.sin(7 * points[:, 0]) * np.cos(5 * points[:, 1])
    return points, adjacency(faces, len(points))


def random_weights(neighbours: sparse.csr_array, n_clusters: int, seed: int, own: float = 0.4) -> Weights:
    """Weights that some points have of their own and the others from their lists, as a file may hold them."""
    draw = np.random.default_rng(seed)
    causal = causal_neighbours(neighbours)
    n_points = len(causal.starts) - 1
    clusters, parts = np.zeros((n_points, INFLUENCES), np.int32), np.zeros((n_points, INFLUENCES), np.int32)
    listed = new_list()
    for point in range(n_points):
        n_listed = list_clusters(point, causal, Weights(clusters, parts), listed)
        if n_listed and draw.random() >= own:
            n = suggest(listed, n_listed)
            clusters[point, :n], parts[point, :n] = listed.clusters[:n], listed.shares[:n]
            continue
        n = int(draw.integers(1, min(INFLUENCES, n_clusters) + 1))
        chosen = draw.permutation(n_clusters)[:n]
        ranks = [rank_of(int(c), listed.clusters, n_listed) for c in chosen]
        clusters[point, :n] = chosen[np.argsort(ranks)]
        ends = np.sort(draw.permutation(TOTAL - 1)[: n - 1]) + 1
        parts[point, :n] = np.diff(np.r_[0, ends, TOTAL])
    return Weights(clusters, parts)


def check_weights(weights: Weights, n_clusters: int) -> None:
    """Weights add up to TOTAL, used ones come first, and no cluster comes twice."""
    assert weights.clusters.min() >= 0 and weights.clusters.max() < n_clusters
    assert (weights.weights.sum(axis=1) == TOTAL).all() and weights.weights.min() >= 0
    used = weights.weights > 0
    assert (np.diff(used.astype(int), axis=1) <= 0).all()
    for clusters, row in zip(weights.clusters, used, strict=True):
        assert len(set(clusters[row])) == row.sum()


# points


def test_points_are_numbered_along_the_codecs_order() -> None:
    lattice = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    faces = np.array([[0, 1, 2], [3, 5, 4]], np.int32)
    visits = np.array([3, 0, 5, 4, 1, 2])  # the codec goes through vertices 1 4 5 0 3 2
    points, point, members = weld_vertices(lattice, faces, visits)
    assert members.tolist() == [1, 4, 5, 0]
    assert point.tolist() == [3, 0, 1, 0, 1, 2]
    assert points.faces.tolist() == [[3, 0, 1], [0, 2, 1]]
    assert points.neighbours.toarray().tolist() == [[0, 1, 1, 1], [1, 0, 1, 1], [1, 1, 0, 0], [1, 1, 0, 0]]


def test_points_that_move_keep_the_sides_between_them() -> None:
    """Also those of triangles whose third corner stands still, which are no triangles any more."""
    mesh = WeldedMesh(
        faces=np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2]], np.int32),
        point=np.arange(5),
        lattice=np.arange(15, dtype=np.int32).reshape(5, 3),
        point_faces=np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]], np.int32),
    )
    points = Points.moving(mesh, np.array([1, 2, 3]))
    assert points.faces.tolist() == [[0, 2, 1]]
    assert points.neighbours.toarray().tolist() == [[0, 1, 1], [1, 0, 1], [1, 1, 0]]
    points = Points.moving(mesh, np.array([0, 1, 3, 4]))
    assert len(points.faces) == 0
    assert points.neighbours.toarray().tolist() == [[0, 1, 0, 0], [1, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0]]
    assert points.pieces().tolist() == [0, 0, 0, 0]
    whole = Points.moving(mesh, np.arange(5))
    assert np.array_equal(whole.faces, mesh.point_faces) and whole.n_points == 5


# weights


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.integers(0, 40), unique=True, max_size=MAX_LISTED), st.integers(0, 40))
def test_ranks_number_all_clusters_once(listed: list[int], cluster: int) -> None:
    array = np.zeros(MAX_LISTED, np.int64)
    array[: len(listed)] = listed
    ranks = [rank_of(c, array, len(listed)) for c in range(41)]
    assert sorted(ranks) == list(range(41))
    assert [ranks[c] for c in listed] == list(range(len(listed)))
    assert cluster_of(ranks[cluster], array, len(listed)) == cluster


@pytest.mark.parametrize("n_clusters", [1, 2, 5, 60, 1024])
@pytest.mark.parametrize("own", [0.0, 0.3, 1.0])
def test_weights_round_trip(n_clusters: int, own: float) -> None:
    _, neighbours = sheet()
    weights = random_weights(neighbours, n_clusters, seed=n_clusters, own=own)
    check_weights(weights, n_clusters)
    data = encode_weights(weights, causal_neighbours(neighbours))
    decoded = decode_weights(data, neighbours, n_clusters)
    assert np.array_equal(decoded.weights, weights.weights)
    assert np.array_equal(decoded.clusters * (decoded.weights > 0), weights.clusters * (weights.weights > 0))
    if own == 0 and n_clusters == 1:
        assert len(data) < 40  # following costs next to nothing


def test_hostile_weights() -> None:
    """Any bytes: weights that make sense, or CorruptFile."""
    _, neighbours = sheet()
    data = encode_weights(random_weights(neighbours, 9, seed=3), causal_neighbours(neighbours))
    draw = np.random.default_rng(0)
    refused = 0
    for _ in range(300):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            check_weights(decode_weights(bytes(changed), neighbours, 9), 9)
        except CorruptFile:
            refused += 1
    assert refused > 100
    with pytest.raises(CorruptFile):  # clusters that the header does not have
        decode_weights(data, neighbours, 2)


def blended(n_frames: int = 20, n_clusters: int = 3, seed: int = 0) -> tuple[Float64, sparse.csr_array, Weights, Float64]:
    """A sheet, its adjacency, smooth weights in 1 / TOTAL, and displacements that follow them."""
    base, neighbours = sheet()
    draw = np.random.default_rng(seed)
    centres = base[draw.permutation(len(base))[:n_clusters]]
    near = np.exp(-8 * np.square(base[:, None] - centres).sum(axis=2))
    parts = np.zeros((len(base), INFLUENCES), np.int32)
    parts[:, :n_clusters] = np.maximum(1, TOTAL * near / near.sum(axis=1, keepdims=True))
    parts[np.arange(len(base)), parts.argmax(axis=1)] += TOTAL - parts.sum(axis=1)
    clusters = np.tile(np.r_[np.arange(n_clusters), np.zeros(INFLUENCES - n_clusters)].astype(np.int32), (len(base), 1))
    maps = np.cumsum(draw.standard_normal((n_frames, n_clusters, 4, 3)), axis=0) * 0.05
    each = np.einsum("pr,nkrc->npkc", homogeneous(base), maps)
    moved = np.einsum("npkc,pk->npc", each, parts[:, :n_clusters] / TOTAL)
    return base, neighbours, Weights(clusters, parts), moved.swapaxes(0, 1).reshape(len(base), -1)


def test_choice_finds_the_weights_of_a_blend() -> None:
    base, neighbours, weights, motions = blended()
    blend = Blend(base, weights, 3)
    transforms = blend.transforms(BlendFit(blend).fit(motions))
    # every point sees all clusters, and starts from weights that are wrong
    found = Weights(weights.clusters, weights.weights[::-1].copy())
    ring = (neighbours.indptr.astype(np.int64), neighbours.indices.astype(np.int64))
    points = homogeneous(base)
    flat = transforms.reshape(-1, transforms.shape[2])
    prepared = Transforms(np.ascontiguousarray(transforms.swapaxes(1, 2)), flat @ flat.T)
    for price, most in ((0.0, 1.0), (1e-4, 2.0)):
        problem = PointMotions(causal_neighbours(neighbours), *ring, points, motions, price)
        found, errors = choose(problem, prepared, guess_prices(), found)
        check_weights(found, 3)
        exact = motions - _applied(points, found, transforms)
        assert np.allclose(np.square(exact).sum(axis=1), errors, atol=1e-9)
        # weights are wrong by half a part of TOTAL each at most, and where bits cost something by little more
        spread = np.abs(np.einsum("pr,krm->pkm", points, transforms)).max(axis=1)
        assert (errors <= most * 4 * (np.square(spread) / TOTAL**2).sum(axis=1) + 30 * price).all()


def _applied(points: Float64, weights: Weights, transforms: Float64) -> Float64:
    """Displacements of a blend, said plainly."""
    each = np.einsum("pr,pjrm->pjm", points, transforms[weights.clusters])
    return np.asarray(np.einsum("pj,pjm->pm", weights.weights / TOTAL, each))


def test_dearer_bits_make_smaller_sections() -> None:
    sequence = waving(16, 30)
    base = np.asarray(sequence.read(0, 1)[0], np.float64)
    neighbours = adjacency(sequence.faces, len(base))
    sizes = []
    for step in (1e-4, 1e-2):
        fitted, fitted_step = fit_blend(Motions(sequence, base, neighbours), step, 6)
        assert fitted_step == step
        check_weights(fitted.weights, fitted.n_clusters)
        sizes.append(len(encode_weights(fitted.weights, causal_neighbours(neighbours))))
    assert sizes[1] < sizes[0]


def test_as_many_clusters_as_pay() -> None:
    """A finer step asks for more of them; one that no motion reaches, for the fewest."""
    sequence = waving(16, 30)
    base = np.asarray(sequence.read(0, 1)[0], np.float64)
    neighbours = adjacency(sequence.faces, len(base))
    motions = Motions(sequence, base, neighbours)
    counts = [fit_blend(motions, step, 0)[0].n_clusters for step in (100.0, 0.02, 5e-4)]
    assert counts == sorted(counts) and counts[0] <= 8 < counts[-1]


# blending


def test_blend_is_linear_in_its_transforms() -> None:
    base, _, weights, motions = blended()
    blend = Blend(base, weights, 3)
    rows = np.random.default_rng(1).standard_normal((12, 30))
    assert np.allclose(blend.matrix() @ rows, _applied(blend.homogeneous, weights, blend.transforms(rows)))
    fit = BlendFit(blend)
    assert np.abs(motions - fit.matrix @ fit.fit(motions)).max() < 1e-4 * np.abs(motions).max()


def test_rows_have_the_energy_that_they_cause() -> None:
    """One cluster alone: rows of unit size move the points by as much."""
    base, _, _, _ = blended()
    alone = Weights(np.zeros((len(base), 4), np.int32), np.tile(np.array([TOTAL, 0, 0, 0], np.int32), (len(base), 1)))
    matrix = Blend(base, alone, 1).matrix()
    assert np.allclose((matrix.T @ matrix).toarray(), np.eye(4), atol=1e-3)


def test_clusters_without_points_and_flat_ones() -> None:
    base = np.zeros((5, 3))
    base[:, 0] = np.arange(5)
    weights = Weights(np.full((5, 4), 1, np.int32), np.tile(np.array([TOTAL, 0, 0, 0], np.int32), (5, 1)))
    blend = Blend(base, weights, 3)  # clusters 0 and 2 have nobody, 1 is a line
    fit = BlendFit(blend)
    motions = np.random.default_rng(0).standard_normal((5, 6))
    rows = fit.fit(motions)
    assert np.isfinite(blend.transforms(rows)).all()
    line = np.column_stack([np.arange(5), np.ones(5)])
    best = line @ np.linalg.lstsq(line, motions, rcond=None)[0]
    assert np.allclose(fit.matrix @ rows, best, atol=1e-3)


def test_rebuilding_is_base_blend_and_residual() -> None:
    base, _, weights, _ = blended()
    draw = np.random.default_rng(2)
    transforms = draw.standard_normal((3, 4, 3))
    n = len(base)
    pixels, samples = np.sort(draw.permutation(2 * n)[:n]), draw.integers(16, 236, (3, 2 * n)).astype(np.uint8)
    vertices = draw.permutation(n)
    points = homogeneous(base)
    result = np.zeros((n, 3), np.float32)
    skinned = SkinnedPoints(base[vertices], points[vertices], weights.clusters[vertices], weights.weights[vertices] / TOTAL)
    sites = Sites(vertices, pixels, 0.01 * (np.arange(256.0) - 128))
    rebuild_blended(samples, sites, skinned, transforms, result)
    wanted = base + _applied(points, weights, transforms)
    wanted[vertices] += 0.01 * (samples[:, pixels].T.astype(float) - 128)
    assert np.allclose(result, wanted, atol=1e-5)


# trajectories


@pytest.mark.parametrize(("n_clusters", "n_frames"), [(1, 1), (3, 2), (5, 40), (40, 9)])
def test_trajectories_round_trip(n_clusters: int, n_frames: int) -> None:
    draw = np.random.default_rng(n_frames)
    rows = np.cumsum(draw.standard_normal((4 * n_clusters, n_frames, 3)), axis=1).reshape(4 * n_clusters, -1)
    sizes = []
    for step in (1.0, 0.05):
        data, coded = encode_trajectories(rows, step)
        decoded = decode_trajectories(data, n_clusters, n_frames, step, "transforms.0")
        assert np.array_equal(decoded.rows(0, n_frames), coded.rows(0, n_frames))
        assert np.allclose(decoded.rows(n_frames // 2, n_frames), coded.rows(0, n_frames)[:, 3 * (n_frames // 2) :])
        error = np.sqrt(np.square(decoded.rows(0, n_frames) - rows).mean())
        assert error < 0.6 * step
        sizes.append(len(data))
    assert sizes[0] < sizes[1]


def test_hostile_trajectories() -> None:
    data, _ = encode_trajectories(np.cumsum(np.ones((12, 30)), axis=1), 0.1)
    draw = np.random.default_rng(0)
    for _ in range(100):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            assert decode_trajectories(bytes(changed), 3, 10, 0.1, "transforms.0").rows(0, 10).shape == (12, 30)
        except CorruptFile:
            continue
    for cut in range(len(data)):
        with pytest.raises(CorruptFile):
            decode_trajectories(data[:cut], 3, 10, 0.1, "transforms.0")


# files


def test_versions_and_predictions_must_fit() -> None:
    """Files without the key are version 1, and affine; version 3 has another mesh than those before."""
    sequence = waving(10, 12)
    published = read_file(GOLDEN / "mcgv-1-h264.mp4")
    assert published.version == 1 and "prediction" not in published.header and "weights" not in published.sections
    affine = Mcgv(prediction="affine", clusters=3, quality=30).encode(sequence).bitstream
    assert affine.version == 4 and affine.header["prediction"] == "affine" and "weights" not in affine.sections
    chosen = Mcgv(prediction="blended", clusters=3).encode(sequence).bitstream
    assert chosen.version == 4 and chosen.header["prediction"] == "blended" and "clusters" not in chosen.sections
    for wrong in (
        dataclasses.replace(published, version=2),
        dataclasses.replace(chosen, header={**chosen.header, "prediction": ["blended"]}),
    ):
        with pytest.raises(CorruptFile, match="prediction"):
            open_reader(wrong)
    for wrong in (
        dataclasses.replace(chosen, version=1),
        dataclasses.replace(chosen, version=2),
        dataclasses.replace(chosen, header={**chosen.header, "prediction": "affine"}),
    ):
        with pytest.raises(FormatError):
            open_reader(wrong).read(0, 1)
    with pytest.raises(NewerVersion):
        open_reader(dataclasses.replace(chosen, version=5))


def test_blends_beat_the_published_prediction() -> None:
    """At equal quality: fewer bytes, and a smaller error."""
    sequence = waving(24, 60)
    sizes, errors = [], []
    for prediction in ("blended", "affine"):
        stream = Mcgv(prediction=prediction, quality=60).encode(sequence).bitstream
        sizes.append(sum(map(len, stream.sections.values())) + len(stream.video))
        decoded = open_reader(stream).read(0, 60)
        errors.append(float(np.square(decoded - np.asarray(sequence.positions[:])).mean()))
    assert sizes[0] < sizes[1]
    assert errors[0] < errors[1]


@pytest.mark.parametrize("name", awkward())
def test_base_frame_tells_places_apart(name: str) -> None:
    """However coarse the quality: nearly as many lattice points as places of frame 0 that 16 bits tell apart."""
    sequence: MeshSequence = awkward()[name]
    first = sequence.read(0, 1)[0][np.unique(find_points(sequence), return_index=True)[1]]
    counts, steps = [], []
    for codec in (Mcgv(prediction="blended", quality=0), Mcgv(prediction="blended", base_bits=16)):
        lattice = codec._lattice(first, 1e3)
        steps.append(lattice.step)
        counts.append(len(np.unique(keep_apart(lattice, first), axis=0)))
    assert counts[0] >= 0.99 * counts[1]
    assert steps[0] >= steps[1] * (1 - 1e-4)  # 2**16 and 2**16 - 1 steps along the longest side


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(0.05, 4.0))
@settings(deadline=None)
def test_points_get_lattice_points_of_their_own(seed: int, n: int, spread: float) -> None:
    """Different ones while there is room; nearest ones if no point is near another; never further off than a step."""
    draw = np.random.default_rng(seed)
    first = np.concatenate([[[0, 0, 0], [64, 64, 64]], 30 + spread * draw.standard_normal((n, 3))]).astype(np.float32)
    first = np.concatenate([first, first[2 : 2 + n // 8]])  # points that part later
    lattice = Lattice((0.0, 0.0, 0.0), 1.0)
    points = keep_apart(lattice, first)
    nearest = lattice.quantise(first)
    assert (points.min() >= 0) and (points <= nearest.max(axis=0)).all()
    assert np.abs(points - nearest).max() <= 1
    cells, counts = np.unique(nearest, axis=0, return_counts=True)
    alone = (nearest[:, None] == cells[counts == 1]).all(axis=2).any(axis=1)
    assert np.array_equal(points[alone], nearest[alone])
    if counts.max() <= 4:
        assert len(np.unique(points, axis=0)) == len(points)


def test_pieces_that_part_are_predicted_each_for_itself() -> None:
    """Two sheets that start as one surface, edge on edge, and fly apart: no vertex follows the other sheet."""
    points, faces = grid(12)
    left = points - [points[:, 0].max(), 0, 0]
    drift = np.linspace(0, 3, 20)[:, None, None] * np.array([1.0, 0, 0.5])
    frames = np.concatenate([left - drift, points + drift], axis=1).astype(np.float32)
    sequence = MeshSequence(frames, np.concatenate([faces, faces + len(points)]).astype(np.int32), fps=25.0)
    stream = Mcgv(prediction="blended", quality=60).encode(sequence).bitstream
    extent = float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    errors = np.linalg.norm(open_reader(stream).read(0, 20) - frames, axis=2) / extent
    assert errors.max() < 0.02 and "outliers" not in stream.sections
