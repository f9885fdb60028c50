"""Skinning: linear in its transforms, energies of rows, reconstruction."""

from __future__ import annotations

import numpy as np
import pytest
from blends import apply_weights, blended

from gvcodecs.mcgv.motion.reconstruction_kernels import (
    AT_ONCE,
    Sites,
    in_rows,
    rebuild_blended,
    rebuild_without_pictures,
    skinned_points,
)
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Blend, BlendFit, Weights, homogeneous


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
    skinned = skinned_points(vertices, base, points, weights)
    sites = Sites(vertices, pixels, 0.01 * (np.arange(256.0) - 128))
    rebuild_blended(samples, sites, skinned, in_rows(transforms), result)
    wanted = base + apply_weights(points, weights, transforms)
    wanted[vertices] += 0.01 * (samples[:, pixels].T.astype(float) - 128)
    assert np.allclose(result, wanted, atol=1e-5)


@pytest.mark.parametrize("n_vertices", [1, AT_ONCE - 1, AT_ONCE, 3 * AT_ONCE + 7])
def test_frames_without_pictures_are_those_of_no_residual(n_vertices: int) -> None:
    """To the bit, whatever the order of vertices; some points follow one cluster, some four."""
    draw = np.random.default_rng(n_vertices)
    n_slots, n_frames = n_vertices // 2 + 1, 3
    parts = np.zeros((n_slots, INFLUENCES), np.int32)
    for point, used in enumerate(draw.integers(1, INFLUENCES + 1, n_slots)):
        parts[point, :used] = draw.multinomial(TOTAL - used, np.ones(used) / used) + 1
    weights = Weights(np.where(parts > 0, draw.integers(0, 5, parts.shape), 0).astype(np.int32), parts)
    base, coordinates = draw.standard_normal((n_slots, 3)), homogeneous(draw.standard_normal((n_slots, 3)))
    vertices, slots = draw.permutation(n_vertices), draw.integers(0, n_slots, n_vertices)
    transforms = np.stack([in_rows(each) for each in draw.standard_normal((n_frames, 5, 4, 3))])
    found, wanted = (np.zeros((n_frames, n_vertices, 3), np.float32) for _ in range(2))
    rebuild_without_pictures(vertices, slots, base, coordinates, weights, transforms, found)
    sites = Sites(vertices, np.zeros(n_vertices, np.int64), np.zeros(1))
    skinned = skinned_points(slots, base, coordinates, weights)
    for frame, own in zip(wanted, transforms, strict=True):
        rebuild_blended(np.zeros((3, 1), np.uint8), sites, skinned, own, frame)
    assert np.array_equal(found, wanted)
