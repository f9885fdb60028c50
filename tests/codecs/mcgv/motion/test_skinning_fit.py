"""The fit of skinning: weights, transforms, number of clusters."""

from __future__ import annotations

import numpy as np
from blends import apply_weights, blended, check_weights
from sequences import waving

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion.skinning import TOTAL, Blend, BlendFit, Weights, homogeneous
from gvcodecs.mcgv.motion.skinning_fit import Motions, fit_blend
from gvcodecs.mcgv.motion.weight_coding import Prices, encode_weights
from gvcodecs.mcgv.motion.weight_selection import Transforms, choose
from gvpipe.mesh.topology import adjacency


def test_choice_finds_the_weights_of_a_blend() -> None:
    base, neighbours, weights, motions = blended()
    blend = Blend(base, weights, 3)
    transforms = blend.transforms(BlendFit(blend).fit(motions))
    known, ring = causal_neighbours(neighbours), neighbours
    guess = Prices.guess()
    # every point knows all clusters, and starts from weights that are wrong
    clusters, parts = weights.clusters.copy(), weights.weights[::-1].copy()
    errors = np.zeros(len(base))
    near = (ring.indptr.astype(np.int64), ring.indices.astype(np.int64))
    prices = (guess.count, guess.gap, guess.change)
    points = homogeneous(base)
    for price, most in ((0.0, 1.0), (1e-4, 2.0)):
        choose(
            known.starts, known.near, *near, points, motions, Transforms.of(transforms), price, *prices, clusters, parts, errors
        )
        found = Weights(clusters, parts)
        check_weights(found, 3)
        exact = motions - apply_weights(points, found, transforms)
        assert np.allclose(np.square(exact).sum(axis=1), errors, atol=1e-9)
        # weights are wrong by half a part of TOTAL each at most, and where bits cost something by little more
        spread = np.abs(np.einsum("pr,krm->pkm", points, transforms)).max(axis=1)
        assert (errors <= most * 4 * (np.square(spread) / TOTAL**2).sum(axis=1) + 30 * price).all()


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
