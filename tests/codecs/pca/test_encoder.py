"""The pca codec: round trip, order, bound, levels of detail, awkward inputs, damage, drift."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from perturbation import perturb_predictions

from gvcodecs.pca import Pca
from gvcodecs.pca.reader import PcaReader
from gvpipe.coding.quality_scale import error_of
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import FormatError, InputError, SettingError
from gvpipe.model.sequence import MeshSequence


def grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Points ``(side**2, 3)`` and triangles of an open sheet."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    points = np.c_[x.ravel(), y.ravel(), 0 * x.ravel()]
    i = np.arange(side * side).reshape(side, side)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel()
    return points, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]])


def tube(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed tube (a torus in connectivity): no boundary."""
    u, v = np.meshgrid(np.arange(around), np.arange(along), indexing="ij")
    angle, turn = 2 * np.pi * u / around, 2 * np.pi * v / along
    radius = 2 + 0.7 * np.cos(angle)
    points = np.c_[(radius * np.cos(turn)).ravel(), (radius * np.sin(turn)).ravel(), 0.7 * np.sin(angle).ravel()]

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        vertices: np.ndarray = (i % around) * along + j % along
        return vertices.ravel()

    a, b, c, d = at(u, v), at(u + 1, v), at(u, v + 1), at(u + 1, v + 1)
    return points, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]])


def moving(points: np.ndarray, n_frames: int) -> np.ndarray:
    """Bend and shake points smoothly: ``(F, V, 3)``."""
    t = np.linspace(0, 2, n_frames)[:, None]
    bent = points[None] + 0.3 * np.stack(
        [np.sin(t + points[:, 1]), np.cos(2 * t + points[:, 0]), np.sin(3 * t + 2 * points[:, 0] * points[:, 1])], axis=2
    )
    return bent.astype(np.float32)


def make(points: np.ndarray, faces: np.ndarray, n_frames: int = 12) -> MeshSequence:
    return MeshSequence(moving(points, n_frames), faces)


def decode(bitstream: Bitstream) -> np.ndarray:
    return Pca.reader(bitstream).read(0, bitstream.n_frames)


def kg(a: np.ndarray, b: np.ndarray) -> float:
    spread = a.astype(np.float64) - a.astype(np.float64).mean(axis=1, keepdims=True)
    return float(100 * np.linalg.norm(a - b) / np.linalg.norm(spread))


def rotated(faces: np.ndarray) -> set[tuple[int, ...]]:
    return {tuple(np.roll(f, -int(np.argmin(f)))) for f in np.asarray(faces).tolist()}


SHEET, TUBE = grid(14), tube(10, 24)


@pytest.mark.parametrize("predictor", ["navg", "lsp", "rbf", "kalman"])
@pytest.mark.parametrize("shape", [SHEET, TUBE], ids=["sheet", "tube"])
def test_round_trip_meets_the_error_aimed_at(shape: tuple[np.ndarray, np.ndarray], predictor: str) -> None:
    sequence = make(*shape)
    bitstream = Pca(quality=60, predictor=predictor).encode(sequence).bitstream
    reader = Pca.reader(bitstream)
    assert kg(sequence.read(0, 12), reader.read(0, 12)) < 1.2 * error_of(60)
    assert rotated(reader.faces) == rotated(sequence.faces)


def test_error_falls_and_bytes_rise_with_quality() -> None:
    sequence = make(*TUBE)
    results = []
    for quality in (0, 25, 50, 75, 100):
        bitstream = Pca(quality=quality).encode(sequence).bitstream
        results.append((sum(map(len, bitstream.sections.values())), -kg(sequence.read(0, 12), decode(bitstream))))
    assert results == sorted(results)


def test_reorder_gives_the_same_frames_in_another_order() -> None:
    sequence = make(*TUBE)
    kept, free = Pca().encode(sequence).bitstream, Pca(reorder=True).encode(sequence).bitstream
    assert not free.section("order")
    a, b = decode(kept), decode(free)
    order_a, order_b = np.lexsort(np.round(a[0], 3).T), np.lexsort(np.round(b[0], 3).T)
    assert np.abs(a[:, order_a] - b[:, order_b]).max() < 0.02


def test_same_input_same_bytes() -> None:
    sequence = make(*SHEET)
    assert Pca().encode(sequence).bitstream.sections == Pca().encode(sequence).bitstream.sections


def test_any_range_of_frames_equals_the_whole_across_segments() -> None:
    sequence = make(*SHEET, n_frames=23)
    bitstream = Pca(segment=7).encode(sequence).bitstream
    assert sum(name.startswith("basis") for name in bitstream.sections) == 4
    whole, reader = decode(bitstream), Pca.reader(bitstream)
    for start, stop in ((0, 1), (22, 23), (4, 13), (11, 12), (0, 23), (5, 5)):
        assert np.array_equal(reader.read(start, stop), whole[start:stop])


def test_levels_of_detail_follow_the_same_motion() -> None:
    sequence = make(*TUBE)
    bitstream = Pca(quality=80).encode(sequence).bitstream
    reader = PcaReader(bitstream)
    full, counts = reader.read(0, 12), reader.levels
    assert counts[0] == 240 and counts == sorted(counts, reverse=True) and counts[-1] < 120
    for lod in range(1, len(counts)):
        coarse, faces = reader.read(0, 12, lod=lod), reader.level_faces(lod)
        assert coarse.shape == (12, counts[lod], 3)
        assert faces.max(initial=0) < counts[lod] and len(np.unique(faces)) == counts[lod]
        distance = np.linalg.norm(full[0][None] - coarse[0][:, None], axis=2)
        vertex = distance.argmin(axis=1)  # every vertex of a level is one of the whole, in all frames
        assert np.abs(full[:, vertex] - coarse).max() < 1e-5
        assert len(np.unique(np.sort(faces, axis=1), axis=0)) == len(faces)
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # still closed
    with pytest.raises(InputError, match="level"):
        reader.read(0, 1, lod=len(counts))


def soup(shape: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    points, faces = shape
    return points[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


def pieces() -> tuple[np.ndarray, np.ndarray]:
    """Many small components, of one to four triangles."""
    points, faces = grid(12)
    return soup((points * 3 + np.floor(points * 6), faces[::3]))


AWKWARD = {
    "soup": soup(SHEET),
    "pieces": pieces(),
    "one triangle": (np.eye(3), np.array([[0, 1, 2]])),
    "one vertex": (np.zeros((1, 3)), np.zeros((0, 3), int)),
    "two vertices": (np.eye(3)[:2], np.zeros((0, 3), int)),
    "no faces": (SHEET[0], np.zeros((0, 3), int)),
    "unreferenced vertices": (np.concatenate([SHEET[0], 2 + np.eye(3), 2 + np.eye(3)]), SHEET[1]),
    "degenerate triangles": (SHEET[0], np.concatenate([SHEET[1], [[0, 0, 1], [5, 5, 5], [7, 8, 7]]])),
    "repeated triangles": (SHEET[0], np.concatenate([SHEET[1], SHEET[1][:20]])),
    "both sides": (SHEET[0], np.concatenate([SHEET[1], SHEET[1][:, ::-1]])),
    "non-manifold edge": (np.random.default_rng(1).random((5, 3)), np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 0, 2]])),
    "bow tie": (np.random.default_rng(2).random((5, 3)), np.array([[0, 1, 2], [0, 3, 4]])),
    "tetrahedron": (np.eye(4)[:, :3], np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])),
    "random triangles": (np.random.default_rng(3).random((40, 3)), np.random.default_rng(4).integers(0, 40, (200, 3))),
    "far from the origin": (SHEET[0] + [0, 5000, 0], SHEET[1]),
    "a fan of 200": (
        np.concatenate([np.zeros((1, 3)), np.c_[np.cos(np.arange(200)), np.sin(np.arange(200)), np.arange(200) / 99]]),
        np.c_[np.zeros(199, int), np.arange(1, 200), np.arange(2, 201)],
    ),
}


@pytest.mark.parametrize("n_frames", [1, 2, 9])
@pytest.mark.parametrize("name", AWKWARD)
def test_awkward_meshes_come_back(name: str, n_frames: int) -> None:
    sequence = make(*AWKWARD[name], n_frames=n_frames)
    original = sequence.read(0, n_frames)
    for predictor in ("kalman", "rbf"):
        bitstream = Pca(quality=70, predictor=predictor).encode(sequence).bitstream
        reader = PcaReader(bitstream)
        spread = np.linalg.norm(original - original.mean(axis=1, keepdims=True), axis=2)
        error = np.linalg.norm(reader.read(0, n_frames) - original, axis=2)
        assert error.max() <= 0.02 * max(np.sqrt((spread**2).mean()), 0.1)
        assert sorted(map(tuple, _canonical(reader.faces))) == sorted(map(tuple, _canonical(sequence.faces)))
        for lod in range(len(reader.levels)):
            assert reader.read(0, 1, lod=lod).shape[1] == reader.levels[lod]
            assert reader.level_faces(lod).max(initial=-1) < reader.levels[lod]


def _canonical(faces: np.ndarray) -> list[list[int]]:
    turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3 if len(faces) else np.zeros((0, 3), int)
    rows: list[list[int]] = np.take_along_axis(faces, turns, axis=1).tolist()
    # a triangle with a repeated vertex may start at either of the two
    return [min(r[i:] + r[:i] for i in range(3)) for r in rows]


def test_still_and_collapsed_sequences_come_back() -> None:
    points, faces = SHEET
    still = MeshSequence(np.repeat(points[None], 30, axis=0), faces)
    bitstream = Pca().encode(still).bitstream
    assert kg(still.read(0, 30), decode(bitstream)) < 0.15
    assert sum(map(len, bitstream.sections.values())) < 2500
    point = MeshSequence(np.full((5, len(points), 3), 7.5), faces)
    assert np.abs(decode(Pca().encode(point).bitstream) - 7.5).max() < 0.01
    origin = MeshSequence(np.zeros((5, len(points), 3)), faces)
    assert np.abs(decode(Pca().encode(origin).bitstream)).max() < 0.01


def test_a_soup_costs_little_more_than_its_surface() -> None:
    whole, torn = make(*SHEET), make(*soup(SHEET))
    sizes = [len(Pca(reorder=True).encode(s).bitstream.section("coefficients.0")) for s in (whole, torn)]
    assert sizes[1] < 1.1 * sizes[0]


def test_components_setting_limits_the_basis() -> None:
    sequence = make(*TUBE)
    few, many = (Pca(quality=60, components=n).encode(sequence).bitstream for n in (2, 30))
    assert len(few.section("basis.0")) < len(many.section("basis.0"))


def test_settings_are_checked() -> None:
    for wrong in ({"quality": 101}, {"predictor": "oracle"}, {"beta": 2.0}, {"components": -1}, {"segment": 0}):
        with pytest.raises(SettingError):
            Pca(**wrong)


@pytest.mark.parametrize("predictor", ["lsp", "rbf", "kalman"])
def test_perturbed_predictions_hardly_move_vertices(predictor: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """1e-12 in every prior weight moves no vertex by more than a thousandth of a step."""
    sequence = make(*TUBE, n_frames=20)
    bitstream = Pca(quality=80, predictor=predictor).encode(sequence).bitstream
    clean = Pca.reader(bitstream).read(0, 20).astype(np.float64)
    perturb_predictions(monkeypatch)
    moved = Pca.reader(bitstream).read(0, 20).astype(np.float64)
    assert np.abs(clean - moved).max() < 1e-3 * bitstream.header["steps"][0]


def test_damage_is_noticed_or_harmless() -> None:
    bitstream = Pca(quality=40, reorder=False).encode(make(*SHEET, n_frames=5)).bitstream
    for name, data in bitstream.sections.items():
        for length in {0, 1, len(data) // 2, len(data) - 1} - ({0} if name == "order" else set()):  # no order: reordered
            with pytest.raises(FormatError):
                decode(_with(bitstream, name, data[:length]))
        for place in range(0, len(data), max(1, len(data) // 25)):
            flipped = bytearray(data)
            flipped[place] ^= 0x55
            try:
                frames = decode(_with(bitstream, name, bytes(flipped)))
            except FormatError:
                continue
            assert frames.shape == (5, 196, 3)
    wrong = {"predictor": "x", "segments": 0, "beta": "a", "first": 1}
    for key, value in (*wrong.items(), ("steps", []), ("steps", [0.0])):
        header = {**bitstream.header, key: value}
        with pytest.raises(FormatError):
            decode(dataclasses.replace(bitstream, header=header))


def _with(bitstream: Bitstream, name: str, data: bytes) -> Bitstream:
    return dataclasses.replace(bitstream, sections={**bitstream.sections, name: data})


def test_levels_of_non_manifold_meshes_hold_no_degenerate_triangle() -> None:
    from gvpipe.mesh.hierarchy import build_hierarchy, level_faces

    rng = np.random.default_rng(11)
    for _ in range(150):
        n_points = int(rng.integers(18, 40))
        faces = rng.integers(0, n_points, (int(rng.integers(10, 90)), 3)).astype(np.int32)
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        hierarchy = build_hierarchy(faces, n_points)
        for waves in range(len(hierarchy.waves)):
            left = level_faces(faces, n_points, waves)
            assert (left != np.roll(left, 1, axis=1)).all()


def test_a_cloud_of_points_round_trips() -> None:
    points = np.random.default_rng(2).random((4000, 3))
    sequence = make(points, np.zeros((0, 3), np.int32), 3)
    assert kg(np.asarray(sequence.positions), decode(Pca().encode(sequence).bitstream)) < 0.2


def test_counts_beyond_reason_are_refused_before_allocation() -> None:
    bitstream = Pca().encode(make(*grid(5))).bitstream
    huge = dataclasses.replace(bitstream, n_frames=1 << 24, header={**bitstream.header})
    with pytest.raises(FormatError):
        PcaReader(huge).read(0, 1)
    hostile = b"\xff\x7f" + bitstream.sections["basis.0"][1:]
    with pytest.raises(FormatError):
        PcaReader(dataclasses.replace(bitstream, sections={**bitstream.sections, "basis.0": hostile})).read(0, 1)
