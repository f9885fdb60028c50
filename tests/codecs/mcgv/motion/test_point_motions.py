"""Coarse surfaces in place of large ones: which points they have, how these are joined, and what blends found on them leave."""

from __future__ import annotations

import numpy as np
import pytest
from sequences import waving

from gvcodecs.mcgv.motion import point_motions
from gvcodecs.mcgv.motion.point_motions import FEW_SITES, MOST_SITES, SPACING, Motions, SampledMotions, find_motions, spacing
from gvcodecs.mcgv.motion.skinning import TOTAL, Blend, BlendFit
from gvcodecs.mcgv.motion.skinning_fit import fit_blend
from gvpipe.mesh.topology import adjacency
from gvpipe.model.sequence import MeshSequence

STEP = 0.01


@pytest.fixture
def surface() -> tuple[MeshSequence, np.ndarray, np.ndarray]:
    """A sheet that waves, beside it one triangle that does too, and the base positions of both."""
    sheet = waving(24, 30)
    n = sheet.n_vertices
    near = sheet.read(0, 30)[:, sheet.faces[0]] + np.array([3, 0, 0], np.float32)
    faces = np.vstack([sheet.faces, [[n, n + 1, n + 2]]]).astype(np.int32)
    sequence = MeshSequence(np.concatenate([sheet.read(0, 30), near], axis=1), faces, 30.0)
    return sequence, sequence.read(0, 1)[0].astype(np.float64), faces


def test_large_surfaces_alone_have_a_coarse_one_of_a_bounded_number_of_points() -> None:
    assert spacing(FEW_SITES) == 1 and spacing(FEW_SITES + 1) == 2 and spacing(10**5) == SPACING
    for n_points in (FEW_SITES + 1, 2 * FEW_SITES + 1, 3 * FEW_SITES + 1, 10**6, 10**7):
        assert FEW_SITES / 2 < -(-n_points // spacing(n_points)) <= MOST_SITES


def test_every_point_has_a_stand_in_of_its_own_piece(surface: tuple[MeshSequence, np.ndarray, np.ndarray],
                                                     monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    _, base, faces = surface
    neighbours = adjacency(faces, len(base))
    monkeypatch.setattr(point_motions, "spacing", lambda n_points: 5)
    sites, nearest = point_motions._choose_sites(neighbours)
    assert set(range(0, len(base), 5)) <= set(sites) and len(base) - 3 in sites  # the first point of the triangle alone
    assert np.array_equal(nearest[sites], np.arange(len(sites)))
    assert set(nearest[-3:]) == set(nearest[sites[sites >= len(base) - 3]])
    assert np.linalg.norm(base - base[sites[nearest]], axis=1).max() < 5 * np.linalg.norm(base[1] - base[0])
    joined = point_motions._contract(neighbours, nearest, len(sites)).tocoo()
    edges = {(nearest[a], nearest[b]) for a, b in zip(*neighbours.tocoo().coords, strict=True)}
    assert set(zip(*joined.coords, strict=True)) == {(a, b) for a, b in edges if a != b}
    assert (joined.data == 1).all()


def test_motions_of_all_points_are_those_of_a_small_surface_turned(
    surface: tuple[MeshSequence, np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    sequence, base, faces = surface
    neighbours = adjacency(faces, len(base))
    whole = find_motions(sequence, base, neighbours).problem(1e-5)
    monkeypatch.setattr(point_motions, "spacing", lambda n_points: 4)
    some = find_motions(sequence, base, neighbours)
    assert isinstance(some, SampledMotions)
    problem = some.problem(1e-5)
    assert problem.price == pytest.approx(whole.price) and problem.motions.shape[1] == whole.motions.shape[1]
    assert problem.cluster_price == pytest.approx(whole.cluster_price)
    turned, own = (np.linalg.norm(np.diff(each.motions, axis=0), axis=1) for each in (problem, whole))
    assert np.allclose(turned, own, atol=1e-4)


def test_a_blend_found_on_some_points_fits_all(
    surface: tuple[MeshSequence, np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    sequence, base, faces = surface
    neighbours = adjacency(faces, len(base))
    frames = sequence.read(0, 30).astype(np.float64)
    moved = np.ascontiguousarray((frames - base).swapaxes(0, 1).reshape(len(base), -1))
    errors = []
    for points in (1, 3):
        monkeypatch.setattr(point_motions, "spacing", lambda n_points, points=points: points)
        motions = find_motions(sequence, base, neighbours)
        assert isinstance(motions, Motions if points == 1 else SampledMotions)
        fitted, _ = fit_blend(motions, STEP, 0)
        if isinstance(motions, SampledMotions):  # what a coarse point follows is what it was given
            thin = motions.thin(motions.spread(motions.thin(fitted)))
            assert np.array_equal(thin.weights.clusters, motions.thin(fitted).weights.clusters)
            again, _ = fit_blend(motions, STEP / 2, 0, before=fitted)
            assert again.weights.clusters.shape == (len(base), 4) and again.n_clusters >= fitted.n_clusters // 2
        assert fitted.weights.clusters.shape == (len(base), 4) and (fitted.weights.weights.sum(axis=1) == TOTAL).all()
        fit = BlendFit(Blend(base, fitted.weights, fitted.n_clusters))
        errors.append(np.sqrt(np.square(moved - fit.matrix @ fit.fit(moved)).mean()))
    assert errors[1] < 1.5 * errors[0] + 0.1 * STEP
