"""Shared pieces under the pca codec: topology alone, hierarchy, block coding, parametric tables, vectors in time."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.connectivity.topology_only import decode_mesh, encode_mesh
from gvpipe.entropy import parametric_tables, range_decoder
from gvpipe.entropy.block_coder import BlockDecoder, BlockEncoder
from gvpipe.errors import CorruptFile
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.temporal_neighbours import temporal_order


def random_mesh(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles over vertices, of which some are copies of one point; the worse the higher the seed."""
    rng = np.random.default_rng(seed)
    n_vertices = int(rng.integers(1, 60))
    faces = rng.integers(0, n_vertices, (int(rng.integers(0, 90)), 3)).astype(np.int32)
    points = np.unique(rng.integers(0, max(1, n_vertices - seed % 5 * 7), n_vertices), return_inverse=True)[1]
    return faces, points


def canonical(faces: np.ndarray) -> list[list[int]]:
    return sorted(min(f[i:] + f[:i] for i in range(3)) for f in faces.tolist())


@pytest.mark.parametrize("reorder", [False, True])
@pytest.mark.parametrize("seed", range(25))
def test_any_mesh_comes_back(seed: int, reorder: bool) -> None:
    faces, points = random_mesh(seed)
    coded = encode_mesh(faces, points, reorder)[0]
    mesh = decode_mesh(coded.mesh, coded.order, 1 << 20)
    assert canonical(coded.permutation[mesh.faces]) == canonical(faces)
    assert np.array_equal(mesh.points[mesh.faces], mesh.point_faces)
    pairs = np.unique(np.c_[points[coded.permutation], mesh.points], axis=0)
    assert len(pairs) == mesh.n_points == points.max() + 1  # the same vertices are copies of one point
    if not reorder:
        assert np.array_equal(coded.permutation, np.arange(len(points)))


@pytest.mark.parametrize("seed", range(25))
def test_hierarchy_orders_every_vertex_after_what_predicts_it(seed: int) -> None:
    faces, _ = random_mesh(seed)
    n_vertices = 60
    hierarchy = build_hierarchy(faces, n_vertices)
    assert np.array_equal(np.sort(hierarchy.order), np.arange(n_vertices))
    rank = np.argsort(hierarchy.order)
    owner = np.repeat(np.arange(n_vertices), np.diff(hierarchy.starts))
    assert (rank[hierarchy.neighbours] < owner).all()
    assert hierarchy.blocks[0] == 0 and hierarchy.blocks[-1] == n_vertices and (np.diff(hierarchy.blocks) > 0).all()


def test_blocks_decode_one_by_one_and_any_prefix_of_them() -> None:
    rng = np.random.default_rng(0)
    scales = 10.0 ** rng.integers(-1, 7, 4)
    blocks = [
        (np.rint(rng.laplace(0, scale, n)).astype(int), rng.integers(0, 5, n))
        for scale, n in zip(scales, (0, 1, 9, 800), strict=True)
    ]
    coder = BlockEncoder(6)
    for values, contexts in blocks:
        coder.add(values, contexts)
    data = coder.finish()
    for n_blocks in range(len(blocks) + 1):
        decoder = BlockDecoder(data, 6, "x")
        for values, contexts in blocks[:n_blocks]:
            assert np.array_equal(decoder.take(contexts), values)
    decoder.end()
    with pytest.raises(CorruptFile):
        BlockDecoder(data, 7, "x")
    with pytest.raises(CorruptFile):
        BlockDecoder(data[:-1], 6, "x")


@pytest.mark.parametrize("seed", range(12))
def test_compiled_range_decoder_reads_what_the_library_writes(seed: int) -> None:
    """Symbols of any tables and raw bits in any mixture; then nothing is left."""
    constriction = pytest.importorskip("constriction")
    rng = np.random.default_rng(seed)
    coder = constriction.stream.queue.RangeEncoder()
    written: list[tuple[np.ndarray | None, int, int]] = []
    for _ in range(int(rng.integers(0, 600))):
        if rng.random() < 0.3:
            width = int(rng.integers(1, 17))
            written.append((None, width, int(rng.integers(0, 1 << width))))
            coder.encode(
                np.array([written[-1][2]], np.int32), constriction.stream.model.Uniform(), np.array([1 << width], np.int32)
            )
        else:
            table = rng.integers(0, 4097, int(rng.integers(2, 88))) * (rng.random() < 0.9)
            table[rng.integers(0, len(table))] += 1
            written.append((table, 0, int(rng.integers(0, len(table)))))
            model = constriction.stream.model.Categorical(table.astype(float) / float(table.sum()), perfect=False)
            coder.encode(written[-1][2], model)
    words = coder.get_compressed().astype(np.uint32)
    state = range_decoder.start(words)
    for table, width, value in written:
        if table is None:
            assert range_decoder.decode_bits(state, words, width) == value
        else:
            assert range_decoder.decode_symbol(state, words, range_decoder.edges_of(table)) == value
    assert range_decoder.may_be_exhausted(state, words)
    assert len(words) < 3 or not range_decoder.may_be_exhausted(range_decoder.start(words), words)


def test_a_context_without_a_table_is_corrupt() -> None:
    coder = BlockEncoder(3)
    coder.add(np.arange(40), np.arange(40) % 2)
    decoder = BlockDecoder(coder.finish(), 3, "x")
    with pytest.raises(CorruptFile, match="no table"):
        decoder.take(np.array([2]))


@pytest.mark.parametrize("mean", [0.15, 0.3, 1.0, 7.0, 60.0])
def test_tables_told_by_two_numbers_fit_laplacian_residuals(mean: float) -> None:
    values = np.rint(np.random.default_rng(1).laplace(0, mean, 20000)).astype(int)
    magnitudes = np.bincount(np.where(values >= 0, 2 * values, -2 * values - 1))[:16]
    counts = np.pad(magnitudes, (0, parametric_tables.N_TOKENS - len(magnitudes)))
    zero, ratio, bits = parametric_tables.best(counts)
    shares = counts[counts > 0] / counts.sum()
    entropy = -(counts.sum() * shares * np.log2(shares)).sum()
    if mean < 2:  # above, the counts cut at token 16 are not a Laplacian
        assert bits < 1.03 * entropy + 100
    table = parametric_tables.table(zero, ratio)
    assert (table > 0).all() and abs(table.sum() - parametric_tables.TOTAL) < 0.01 * parametric_tables.TOTAL


@pytest.mark.parametrize("n_frames", [1, 2, 3, 4, 7, 16, 17, 100])
def test_frame_rows_hold_every_row_after_what_predicts_it(n_frames: int) -> None:
    causal = temporal_order(n_frames)
    assert np.array_equal(np.sort(causal.order), np.arange(3 * n_frames))
    rank, owner = np.argsort(causal.order), np.repeat(np.arange(3 * n_frames), np.diff(causal.starts))
    assert (rank[causal.neighbours] < owner).all() and (causal.neighbours % 3 == causal.order[owner] % 3).all()
    assert causal.blocks[-1] == 3 * n_frames


def test_rows_come_back_within_a_step_and_a_prefix_of_blocks_alone() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(50)[:, None]
    target = np.repeat(np.sin(time / rng.uniform(3, 20, 12)) * 40 * 0.7 ** np.arange(12), 3, axis=0)
    target *= np.tile([1, -2, 0.5], 50)[:, None]
    causal = temporal_order(50)
    data, decoded = encode_vectors(target, 0.01, causal)
    assert np.abs(target - decoded).max() < 0.0059  # ROUND_UP lets 0.58 of a step pass
    assert np.allclose(decode_vectors(data, 12, 0.01, causal, "x"), decoded, atol=1e-9)
    part = decode_vectors(data, 12, 0.01, causal, "x", n_blocks=1)
    known = causal.order[: causal.blocks[1]]
    assert np.allclose(part[known], decoded[known], atol=1e-9)
    assert 8 * len(data) < 0.6 * target.size * np.log2(np.abs(target).mean() / 0.01)
