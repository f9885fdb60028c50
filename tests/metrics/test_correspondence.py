"""Sequences in another vertex order are recognised."""

from __future__ import annotations

import numpy as np
import pytest
from sequences import awkward, waving

from gvpipe.foundation.errors import InputError
from gvpipe.metrics.comparison import compare
from gvpipe.metrics.correspondence import match_vertices
from gvpipe.model.sequence import MeshSequence

SEQUENCES = {
    "waving": waving(),
    **{name: awkward()[name] for name in ("triangle soup", "many components", "unreferenced vertices")},
}


def shuffled(sequence: MeshSequence, noise: float = 0.0) -> tuple[MeshSequence, np.ndarray]:
    """The sequence with its vertices and triangles in another order, each triangle turned, and a little noise."""
    rng = np.random.default_rng(0)
    order = rng.permutation(sequence.n_vertices)
    faces = np.argsort(order)[sequence.faces][rng.permutation(len(sequence.faces))][:, [1, 2, 0]]
    moved = np.asarray(sequence.positions[:])[:, order]
    noisy = moved + noise * rng.standard_normal(moved.shape)
    return MeshSequence(noisy.astype(np.float32), faces.astype(np.int32), sequence.fps), order


@pytest.mark.parametrize("name", SEQUENCES)
def test_exact_copy_is_at_distance_zero(name: str) -> None:
    other, _ = shuffled(SEQUENCES[name])
    assert compare(SEQUENCES[name], other).max == 0


def test_noise_far_above_the_spacing_of_a_few_vertices_is_sorted_out_by_triangles() -> None:
    sequence = waving()
    other, order = shuffled(sequence, noise=0.02)  # the sheet's vertices are 0.08 apart
    match = match_vertices(sequence, other)
    assert match is not None and np.array_equal(match, order)
    assert compare(sequence, other).rmse == pytest.approx(0.02 * np.sqrt(3), rel=0.05)


def test_another_mesh_is_refused() -> None:
    sequence = waving()
    faces = sequence.faces.copy()
    faces[0] = faces[0][::-1]
    with pytest.raises(InputError, match="not the same triangles"):
        compare(sequence, MeshSequence(sequence.positions, faces, sequence.fps), surface=False)
