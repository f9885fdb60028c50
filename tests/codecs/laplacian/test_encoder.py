"""The laplacian codec: errors where they are aimed at, operators, anchors, prediction, awkward inputs, damage, drift."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import sparse
from sequences import grid, waving

import gvpipe.trajectory.prediction
from gvcodecs.laplacian import Laplacian
from gvcodecs.laplacian.anchors import SMALL, choose_anchors
from gvcodecs.laplacian.average_coding import decode_average, encode_average
from gvcodecs.laplacian.delta_rows import N_KNOWN, border_order, delta_causal_order, delta_order
from gvcodecs.laplacian.domain import build_domain, build_surface
from gvcodecs.laplacian.extended_laplacian import MAX_NEIGHBOURS, ExtendedLaplacian, thin_hubs
from gvcodecs.laplacian.header import Header
from gvcodecs.laplacian.mesh_scale import edge_lengths, fineness
from gvcodecs.laplacian.operators import laplacian
from gvpipe.container.bitstream import Bitstream
from gvpipe.errors import FormatError, SettingError
from gvpipe.mesh.topology import components
from gvpipe.metrics.comparison import compare
from gvpipe.sequence import MeshSequence
from gvpipe.trajectory.causal_order import select_vectors

HEADER = Header("mean-value", "kalman", 16, "hierarchy", 0.75, 1 / 16, 1.2, 1.5, 1, (1.0,))


def tube(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed tube (a torus in connectivity), unevenly sampled."""
    u, v = np.meshgrid(np.arange(around), np.arange(along), indexing="ij")
    angle, turn = 2 * np.pi * u / around, 2 * np.pi * v / along
    angle, turn = angle + 0.5 * np.sin(angle), turn + 0.6 * np.sin(turn)
    radius = 2 + 0.7 * np.cos(angle)
    points = np.c_[(radius * np.cos(turn)).ravel(), (radius * np.sin(turn)).ravel(), 0.7 * np.sin(angle).ravel()]
    corner = np.array([[((u + i) % around * along + (v + j) % along).ravel() for j in (0, 1)] for i in (0, 1)])
    (a, c), (b, d) = corner
    return points, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]]).astype(np.int32)


def moving(n_frames: int = 16, shake: float = 5e-4) -> MeshSequence:
    """A mesh that bends, turns and shakes a little."""
    points, faces = tube(12, 40)
    t = np.linspace(0, 2, n_frames)[:, None]
    bend = 0.3 * np.stack([np.sin(t + points[:, 1]), np.cos(2 * t + points[:, 0]), np.sin(3 * t + points[:, 0])], axis=2)
    noise = shake * np.random.default_rng(0).standard_normal((n_frames, len(points), 3))
    c, s = np.cos(t[:, 0]), np.sin(t[:, 0])
    turns = np.stack([np.stack([c, -s, 0 * c], 1), np.stack([s, c, 0 * c], 1), np.stack([0 * c, 0 * c, 0 * c + 1], 1)], 1)
    return MeshSequence(np.einsum("nvi,nij->nvj", points + bend + noise, turns).astype(np.float32), faces)


def decoded(bitstream: Bitstream, like: MeshSequence) -> MeshSequence:
    reader = Laplacian.reader(bitstream)
    return MeshSequence(reader.read(0, bitstream.n_frames), reader.faces, like.fps)


def n_bytes(bitstream: Bitstream, *names: str) -> int:
    return sum(len(data) for name, data in bitstream.sections.items() if name.split(".")[0] in names)


def surface_of(shape: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, object]:
    points, faces = shape
    return points, build_surface(faces.astype(np.int32), len(points))


def test_perceived_error_falls_and_bytes_rise_with_quality() -> None:
    sequence = moving()
    sizes, errors = [], []
    for quality in (20, 40, 60, 80, 100):
        bitstream = Laplacian(quality=quality).encode(sequence).bitstream
        sizes.append(sum(map(len, bitstream.sections.values())))
        errors.append(compare(sequence, decoded(bitstream, sequence)).sted)
    assert sizes == sorted(sizes)
    assert errors == sorted(errors, reverse=True)  # type: ignore[type-var]


def test_the_geometric_operator_needs_fewer_bits_than_connectivity_alone_and_prediction_fewer_still() -> None:
    sequence = moving()
    settings = {"quality": 60, "edge_power": 0.0}
    variants = [("tutte", "none"), ("mean-value", "none"), ("mean-value", "rigid"), ("mean-value", "kalman")]
    sizes = [
        n_bytes(Laplacian(operator=o, delta_prediction=p, **settings).encode(sequence).bitstream, "deltas") for o, p in variants
    ]
    assert sizes[1] < 0.9 * sizes[0]
    assert sizes[2] < 0.95 * sizes[1]
    assert sizes[3] < 0.95 * sizes[1]


def test_more_and_finer_anchors_bound_the_drift() -> None:
    """At one step, which a given number of components leaves as it is."""
    sequence = moving()
    coarse, dense, fine = (
        compare(sequence, decoded(Laplacian(quality=50, components=12, **settings).encode(sequence).bitstream, sequence))
        for settings in ({"anchors": 400}, {"anchors": 16}, {"anchors": 4, "anchor_ratio": 0.5})
    )
    assert fine.kg < dense.kg < coarse.kg  # type: ignore[operator]


def test_reorder_gives_the_same_frames_in_another_order() -> None:
    sequence = moving()
    kept, free = Laplacian().encode(sequence).bitstream, Laplacian(reorder=True).encode(sequence).bitstream
    assert not free.section("order")
    a, b = (Laplacian.reader(bitstream).read(0, 16) for bitstream in (kept, free))
    order_a, order_b = np.lexsort(np.round(a[0], 2).T), np.lexsort(np.round(b[0], 2).T)
    assert np.abs(np.sort(a[0][order_a], axis=0) - np.sort(b[0][order_b], axis=0)).max() < 0.05


def test_still_sequences_cost_little_more_than_their_average() -> None:
    points, faces = tube(12, 40)
    still = MeshSequence(np.repeat(points[None].astype(np.float32), 30, axis=0), faces)
    bitstream = Laplacian().encode(still).bitstream
    assert compare(still, decoded(bitstream, still)).kg < 0.5  # type: ignore[operator]
    assert sum(map(len, bitstream.sections.values())) < 6000


def test_every_component_has_an_anchor_and_small_ones_nothing_else() -> None:
    points, faces = grid(12)
    rng = np.random.default_rng(3)
    loose = 144 + np.arange(60).reshape(-1, 3)
    faces = np.concatenate([faces, loose, [[204, 205, 206], [204, 206, 207], [204, 207, 208], [204, 208, 205]]]).astype(
        np.int32
    )
    points = np.concatenate([points, rng.random((66, 3))])  # the last one is in no triangle
    surface = build_surface(faces, len(points))
    n_components, component_of = components(surface.neighbours)
    sizes = np.bincount(component_of)
    walk = border_order(surface.faces, len(points))
    for choice in ("hierarchy", "walk"):
        for spacing in (1, 7, 1000):
            anchors = choose_anchors(choice, spacing, surface.hierarchy, surface.causal, walk, component_of)
            assert len(set(anchors.points)) == len(anchors.points) == len(anchors.causal.order)
            assert set(component_of[anchors.points]) == set(range(n_components))
            small = np.flatnonzero(sizes[component_of] <= SMALL)
            assert set(small) <= set(anchors.points)
            assert spacing > 1 or len(anchors.points) == len(points)
            known = np.repeat(np.arange(len(anchors.points)), np.diff(anchors.causal.starts))
            assert (anchors.causal.neighbours < known).all()
        header = dataclasses.replace(HEADER, anchor_choice=choice)
        domain = build_domain(surface, points, header)
        assert set(domain.delta_points) <= set(np.flatnonzero(sizes[component_of] > SMALL))


def test_selected_rows_know_what_they_knew() -> None:
    _, surface = surface_of(grid(12))
    causal = surface.causal  # type: ignore[attr-defined]
    keep = np.arange(len(causal.order)) < 50
    chosen = select_vectors(causal, keep)
    assert np.array_equal(causal.order[keep][chosen.neighbours], causal.neighbours[: causal.starts[50]])
    assert np.array_equal(chosen.starts, causal.starts[:51])
    assert chosen.blocks[-1] == 50


@pytest.mark.parametrize("prediction", ["kalman", "rigid"])
def test_known_neighbours_are_known_near_and_many(prediction: str) -> None:
    points, faces = tube(12, 40)
    surface = build_surface(faces, len(points))
    walk = border_order(surface.faces, len(points))
    order, blocks, limits = delta_order(prediction, surface.hierarchy, walk, np.ones(len(points), bool))
    assert sorted(walk) == sorted(order) == list(range(len(points)))
    causal = delta_causal_order(prediction, order, blocks, limits, surface.neighbours, np.asarray(points))
    known = np.diff(causal.starts)
    row = np.repeat(np.arange(len(order)), known)
    assert (causal.neighbours < limits[row]).all()
    assert known.max() == N_KNOWN[prediction]
    assert (known[100:] >= 12).all()
    if prediction == "kalman":  # chains are no longer than there are blocks
        block = np.searchsorted(blocks, np.arange(len(order)), side="right")
        assert (block[causal.neighbours] < block[row]).all()
    steps = sparse.csgraph.shortest_path(surface.neighbours, unweighted=True)[order][:, order]
    for i in (140, 200, 479):
        found = steps[i, causal.neighbours[causal.starts[i] : causal.starts[i + 1]]]
        assert (np.diff(found) >= 0).all()
        assert found.max() <= np.sort(steps[i, : limits[i]])[len(found) - 1]


def test_rigid_weights_carry_any_linear_map_of_the_average() -> None:
    """Section 7's assumption, met exactly: deltas that are one linear map of the average's are predicted but for the ridge."""
    points, faces = tube(12, 40)
    surface = build_surface(faces, len(points))
    walk = border_order(surface.faces, len(points))
    order, blocks, limits = delta_order("rigid", surface.hierarchy, walk, np.ones(len(points), bool))
    differential = np.random.default_rng(0).standard_normal((len(points), 3))
    causal = delta_causal_order("rigid", order, blocks, limits, surface.neighbours, differential)
    deltas = (differential @ np.random.default_rng(1).standard_normal((3, 7)))[order]
    row = np.repeat(np.arange(len(order)), np.diff(causal.starts))
    predicted = np.zeros_like(deltas)
    np.add.at(predicted, row, causal.weights[:, None] * deltas[causal.neighbours])
    assert np.linalg.norm((predicted - deltas)[100:]) < 0.1 * np.linalg.norm(deltas[100:])


@pytest.mark.parametrize("operator", ["mean-value", "cotangent", "tutte"])
def test_exact_deltas_and_anchors_give_the_coefficients_back(operator: str) -> None:
    points, surface = surface_of(tube(12, 40))
    domain = build_domain(surface, points, dataclasses.replace(HEADER, operator=operator))  # type: ignore[arg-type]
    coefficients = np.random.default_rng(0).standard_normal((len(points), 5))
    deltas = domain.system.deltas(coefficients)[domain.delta_points]
    solved = domain.system.solve(domain.delta_points, deltas, coefficients[domain.anchors.points])
    assert np.abs(solved - coefficients).max() < 1e-9


def test_a_solution_is_the_least_squares_one() -> None:
    rng = np.random.default_rng(0)
    operator = sparse.csr_array(np.eye(6) - np.roll(np.eye(6), 1, axis=1))
    system = ExtendedLaplacian(operator, np.array([0, 3], np.int32), 2.0)
    deltas, anchored = rng.standard_normal((6, 2)), rng.standard_normal((2, 2))
    extended = np.concatenate([operator.toarray(), 2 * np.eye(6)[[0, 3]]])
    expected = np.linalg.lstsq(extended, np.concatenate([deltas, 2 * anchored]), rcond=None)[0]
    assert np.allclose(system.solve(np.arange(6, dtype=np.int32), deltas, anchored), expected)


def test_anchors_make_good_what_rounding_of_deltas_did() -> None:
    """Two steps come near the least squares over all values of anchors; exact deltas leave them as they are."""
    points, surface = surface_of(tube(12, 40))
    domain = build_domain(surface, points, HEADER)  # type: ignore[arg-type]
    wanted = np.random.default_rng(0).standard_normal((len(points), 5)) + 20 * points[:, :1]
    exact = domain.system.deltas(wanted)[domain.delta_points]
    true = wanted[domain.anchors.points]
    assert np.abs(domain.system.fit_anchors(domain.delta_points, exact, wanted) - true).max() < 1e-8

    def error(anchored: np.ndarray) -> np.ndarray:
        return ((domain.system.solve(domain.delta_points, np.rint(exact), anchored) - wanted) ** 2).sum(axis=0)

    fitted = domain.system.fit_anchors(domain.delta_points, np.rint(exact), wanted)
    zero = domain.system.solve(domain.delta_points, np.rint(exact), 0 * true)
    spread = domain.system.solve(domain.delta_points, np.zeros((len(exact), len(true))), np.eye(len(true)))  # (P, A)
    best = np.linalg.lstsq(spread, wanted - zero, rcond=None)[0]
    assert (error(best) <= error(fitted)).all()
    assert (error(fitted) < 0.8 * error(true)).all()
    assert (error(fitted) - error(best) < 0.35 * (error(true) - error(best))).all()


def test_hubs_keep_few_neighbours_and_their_sum() -> None:
    n = 3000
    spokes = np.arange(1, n)
    faces = np.stack([np.zeros(n - 1, int), spokes, np.roll(spokes, -1)], axis=1).astype(np.int32)
    angle = 2 * np.pi * spokes / (n - 1)
    points = np.concatenate([np.zeros((1, 3)), np.stack([np.cos(angle), np.sin(angle), np.sin(9 * angle)], axis=1)])
    whole = laplacian(points, faces)
    thin = thin_hubs(whole)
    assert np.diff(thin.indptr)[0] == MAX_NEIGHBOURS + 1
    assert np.abs(thin.sum(axis=1)).max() < 1e-12
    assert abs(thin - whole)[1:].max() == 0
    kept = thin.indices[thin.indptr[0] : thin.indptr[1]]
    assert np.diff(kept).max() <= n // MAX_NEIGHBOURS + 2
    sequence = MeshSequence(np.stack([points, 1.1 * points + [0, 0, 0.1]]).astype(np.float32), faces)
    assert compare(sequence, decoded(Laplacian().encode(sequence).bitstream, sequence)).kg < 1  # type: ignore[operator]


def test_the_average_comes_back_to_its_precision() -> None:
    points, surface = surface_of(tube(12, 40))
    unit = edge_lengths(points, surface.edges).mean()  # type: ignore[attr-defined]
    sizes = []
    for step in (1 / 4, 1 / 64):
        header = dataclasses.replace(HEADER, average_step=step)
        data, theirs = encode_average(5 + points, surface, header)  # type: ignore[arg-type]
        assert np.array_equal(decode_average(data, surface, header), theirs)  # type: ignore[arg-type]
        wanted = (points - points.mean(axis=0)) / unit
        lengths, expected = (edge_lengths(p, surface.edges) for p in (theirs, wanted))  # type: ignore[attr-defined]
        assert np.abs(lengths - expected).mean() < step
        sizes.append(len(data))
    assert sizes[0] < 0.7 * sizes[1]


def test_dense_regions_are_quantised_finer() -> None:
    points, surface = surface_of(tube(12, 40))
    edges = surface.edges  # type: ignore[attr-defined]
    scale = fineness(points / edge_lengths(points, edges).mean(), edges, 0.75)
    around = np.bincount(edges.ravel(), np.repeat(edge_lengths(points, edges), 2)) / np.bincount(edges.ravel())
    assert np.all(np.diff(scale[np.argsort(around)]) <= 1e-12)
    assert np.all(fineness(points, edges, 0.0) == 1)


@pytest.mark.parametrize("prediction", ["kalman", "rigid"])
def test_perturbed_predictions_hardly_move_vertices(prediction: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """1e-12 in every prior weight, of the average, the basis, anchors and deltas, moves no vertex by a thousandth of a step."""
    sequence = moving(20, shake=0.02)  # noise teaches weights that mean nothing
    bitstream = Laplacian(quality=80, delta_prediction=prediction).encode(sequence).bitstream
    clean = Laplacian.reader(bitstream).read(0, 20).astype(np.float64)
    original = gvpipe.trajectory.prediction.predict_vectors

    def perturbed(causal: gvpipe.trajectory.causal_order.CausalOrder, *rest: object) -> None:
        noise = 1 + 1e-12 * np.random.default_rng(5).choice([-1, 1], len(causal.weights))
        original(causal._replace(weights=causal.weights * noise), *rest)  # type: ignore[arg-type]

    monkeypatch.setattr("gvpipe.trajectory.coefficient_coding.predict_vectors", perturbed)
    moved = Laplacian.reader(bitstream).read(0, 20).astype(np.float64)
    assert np.abs(clean - moved).max() < 1e-3 * bitstream.header["steps"][0]


def test_any_range_of_frames_equals_the_whole_across_segments() -> None:
    sequence = waving(14, 23)
    bitstream = Laplacian(segment=7).encode(sequence).bitstream
    assert sum(name.startswith("basis") for name in bitstream.sections) == 4
    reader = Laplacian.reader(bitstream)
    whole = reader.read(0, 23)
    for start, stop in ((0, 1), (22, 23), (4, 13), (11, 12), (5, 5)):
        assert np.array_equal(reader.read(start, stop), whole[start:stop])


def test_only_the_operator_that_needs_it_sends_an_average() -> None:
    sequence = waving(8, 6)
    for operator, prediction, sent in (
        ("mean-value", "none", True),
        ("cotangent", "kalman", True),
        ("tutte", "rigid", True),
        ("tutte", "kalman", False),
        ("tutte", "none", False),
    ):
        bitstream = Laplacian(operator=operator, delta_prediction=prediction).encode(sequence).bitstream
        assert ("average" in bitstream.sections) == sent


def test_components_setting_limits_the_basis() -> None:
    sequence = moving()
    few, many = (Laplacian(quality=70, components=n).encode(sequence).bitstream for n in (2, 30))
    assert len(few.section("basis.0")) < len(many.section("basis.0"))


def test_settings_are_checked() -> None:
    for wrong in (
        {"operator": "umbrella"},
        {"delta_prediction": "yes"},
        {"anchors": 0},
        {"anchor_choice": "all"},
        {"anchor_ratio": 0.0},
        {"basis_ratio": 2000.0},
        {"components": -1},
        {"edge_power": 3.0},
        {"average_step": 0.0},
    ):
        with pytest.raises(SettingError, match=next(iter(wrong))):
            Laplacian(**wrong)  # type: ignore[arg-type]


def test_damage_is_noticed_or_harmless() -> None:
    bitstream = Laplacian(quality=40).encode(waving(14, 5)).bitstream
    for name, data in bitstream.sections.items():
        for length in {0, 1, len(data) // 2, len(data) - 1} - ({0} if name == "order" else set()):  # no order: reordered
            with pytest.raises(FormatError):
                _read(_with(bitstream, name, data[:length]))
        for place in range(0, len(data), max(1, len(data) // 25)):
            flipped = bytearray(data)
            flipped[place] ^= 0x55
            try:
                frames = _read(_with(bitstream, name, bytes(flipped)))
            except FormatError:
                continue
            assert frames.shape == (5, 196, 3)
    for key, value in (
        ("operator", "x"),
        ("delta_prediction", None),
        ("anchors", 0),
        ("anchor_choice", 3),
        ("anchor_ratio", 1e-9),
        ("basis_ratio", "a"),
        ("edge_power", -1),
        ("average_step", 0),
        ("segments", 0),
        ("steps", []),
        ("steps", [0.0]),
    ):
        with pytest.raises(FormatError):
            _read(dataclasses.replace(bitstream, header={**bitstream.header, key: value}))
    with pytest.raises(FormatError):
        _read(dataclasses.replace(bitstream, n_frames=1 << 24))


def _with(bitstream: Bitstream, name: str, data: bytes) -> Bitstream:
    return dataclasses.replace(bitstream, sections={**bitstream.sections, name: data})


def _read(bitstream: Bitstream) -> np.ndarray:
    frames: np.ndarray = Laplacian.reader(bitstream).read(0, 5)
    return frames
