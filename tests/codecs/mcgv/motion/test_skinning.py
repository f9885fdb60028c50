"""Skinning: linear in its transforms, energies of rows, reconstruction."""

from __future__ import annotations

import numpy as np
from blends import apply_weights, blended

from gvcodecs.mcgv.motion.reconstruction_kernels import Sites, in_rows, rebuild_blended, skinned_points
from gvcodecs.mcgv.motion.skinning import TOTAL, Blend, BlendFit, Weights, homogeneous


def test_blend_is_linear_in_its_transforms() -> None:
    base, _, weights, motions = blended()
    blend = Blend(base, weights, 3)
    rows = np.random.default_rng(1).standard_normal((12, 30))
    assert np.allclose(blend.matrix() @ rows, apply_weights(blend.homogeneous, weights, blend.transforms(rows)))
    fit = BlendFit(blend)
    assert np.abs(motions - fit.matrix @ fit.fit(motions)).max() < 1e-4 * np.abs(motions).max()


def test_rows_have_the_energy_that_they_cause() -> None:
    """One cluster alone: rows of unit size move the points by as much."""
    base, _, _, _ = blended()
    alone = Weights(np.zeros((len(base), 4), np.int32), np.tile(np.array([TOTAL, 0, 0, 0], np.int32), (len(base), 1)))
    matrix = Blend(base, alone, 1).matrix()
    assert np.allclose((matrix.T @ matrix).toarray(), np.eye(4), atol=1e-3)


def test_rebuilding_is_base_blend_and_residual() -> None:
    base, _, weights, _ = blended()
    draw = np.random.default_rng(2)
    transforms = draw.standard_normal((3, 4, 3))
    n = len(base)
    pixels, samples = np.sort(draw.permutation(2 * n)[:n]), draw.integers(16, 236, (3, 2 * n)).astype(np.uint8)
    vertices = draw.permutation(n)
    points = homogeneous(base)
    result = np.zeros((n, 3), np.float32)
    skinned = skinned_points(vertices, base, np.arange(n), points, weights)
    sites = Sites(vertices, pixels, 0.01 * (np.arange(256.0) - 128))
    rebuild_blended(samples, sites, skinned, in_rows(transforms), result)
    wanted = base + apply_weights(points, weights, transforms)
    wanted[vertices] += 0.01 * (samples[:, pixels].T.astype(float) - 128)
    assert np.allclose(result, wanted, atol=1e-5)
