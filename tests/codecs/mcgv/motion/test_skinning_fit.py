"""The fit of skinning: weights, transforms, number of clusters."""

from __future__ import annotations

import numpy as np
import pytest
from blends import apply_weights, blended, check_weights
from sequences import waving

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion import weight_selection
from gvcodecs.mcgv.motion.point_motions import find_motions
from gvcodecs.mcgv.motion.skinning import TOTAL, Blend, BlendFit, Weights, homogeneous
from gvcodecs.mcgv.motion.skinning_fit import fit_blend
from gvcodecs.mcgv.motion.weight_coding import decode_weights, encode_weights, guess_prices
from gvcodecs.mcgv.motion.weight_fit_kernels import prepare
from gvcodecs.mcgv.motion.weight_selection import PointMotions, Ring, choose
from gvpipe.mesh.topology import adjacency
from gvpipe.model.sequence import MeshSequence


def test_choice_finds_the_weights_of_a_blend() -> None:
    base, neighbours, weights, motions = blended()
    blend = Blend(base, weights, 3)
    transforms = blend.transforms(BlendFit(blend).fit(motions))
    # every point sees all clusters, and starts from weights that are wrong
    found = Weights(weights.clusters, weights.weights[::-1].copy())
    ring = Ring(neighbours.indptr.astype(np.int64), neighbours.indices.astype(np.int64))
    points = homogeneous(base)
    prepared = prepare(transforms)
    for price, most in ((0.0, 1.0), (1e-4, 2.0)):
        problem = PointMotions(causal_neighbours(neighbours), ring, points, motions, price)
        found, errors = choose(problem, prepared, guess_prices(), found)
        check_weights(found, 3)
        exact = motions - apply_weights(points, found, transforms)
        assert np.allclose(np.square(exact).sum(axis=1), errors, atol=1e-9)
        # weights are wrong by half a part of TOTAL each at most, and where bits cost something by little more
        spread = np.abs(np.einsum("pr,krm->pkm", points, transforms)).max(axis=1)
        assert (errors <= most * 4 * (np.square(spread) / TOTAL**2).sum(axis=1) + 30 * price).all()


def test_halves_are_chosen_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second one sees the first as it was, and its points still have their clusters in the order of ranks."""
    sequence = waving(16, 30)
    base = np.asarray(sequence.read(0, 1)[0], np.float64)
    neighbours = adjacency(sequence.faces, len(base))
    motions = find_motions(sequence, base, neighbours)
    whole = fit_blend(motions, 1e-3, 8)[0]
    middle = len(base) // 3
    monkeypatch.setattr(weight_selection, "halves", lambda n: [slice(0, middle), slice(middle, n)])
    fitted = fit_blend(motions, 1e-3, 8)[0]
    data = [len(encode_weights(each.weights, causal_neighbours(neighbours))) for each in (whole, fitted)]
    assert not np.array_equal(whole.weights.clusters, fitted.weights.clusters) and data[1] < 1.2 * data[0]
    causal = causal_neighbours(neighbours)
    restored = decode_weights(encode_weights(fitted.weights, causal), causal, fitted.n_clusters)
    for found, chosen in zip(restored, fitted.weights, strict=True):
        assert np.array_equal(found, chosen)


def test_dearer_bits_make_smaller_sections() -> None:
    sequence = waving(16, 30)
    base = np.asarray(sequence.read(0, 1)[0], np.float64)
    neighbours = adjacency(sequence.faces, len(base))
    sizes = []
    for step in (1e-4, 1e-2):
        fitted, fitted_step = fit_blend(find_motions(sequence, base, neighbours), step, 6)
        assert fitted_step == step
        check_weights(fitted.weights, fitted.n_clusters)
        sizes.append(len(encode_weights(fitted.weights, causal_neighbours(neighbours))))
    assert sizes[1] < sizes[0]


def test_as_many_clusters_as_pay() -> None:
    """A finer step asks for more of them; one that no motion reaches, for the fewest."""
    sequence = waving(16, 30)
    base = np.asarray(sequence.read(0, 1)[0], np.float64)
    neighbours = adjacency(sequence.faces, len(base))
    motions = find_motions(sequence, base, neighbours)
    counts = [fit_blend(motions, step, 0)[0].n_clusters for step in (100.0, 0.02, 5e-4)]
    assert counts == sorted(counts) and counts[0] <= 8 < counts[-1]


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


def test_a_cluster_of_simple_motion_costs_the_same_in_any_number_of_frames() -> None:
    still = waving(16, 1)
    base = np.asarray(still.read(0, 1)[0], np.float64)
    neighbours = adjacency(still.faces, len(base))
    prices = []
    for n_frames in (40, 160):  # one trajectory
        lift = np.sin(np.arange(n_frames) / 5)[:, None] * base[:, 0]
        frames = base + lift[:, :, None] * (0, 0, 1)
        sequence = MeshSequence(frames.astype(np.float32), still.faces, 30.0)
        prices.append(find_motions(sequence, base, neighbours).problem(0.01).cluster_price)
    assert prices[0] == prices[1]
