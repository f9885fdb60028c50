"""The laplacian codec: errors that fall with quality, order, segments, settings, damage, rounding."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from perturbation import perturb_predictions
from sequences import waving
from tubes import decoded, kg, tube

from gvcodecs.laplacian import Laplacian
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import FormatError, SettingError
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence


def moving(n_frames: int = 16, shake: float = 5e-4) -> MeshSequence:
    """A mesh that bends, turns and shakes a little."""
    points, faces = tube(12, 40)
    t = np.linspace(0, 2, n_frames)[:, None]
    bend = 0.3 * np.stack([np.sin(t + points[:, 1]), np.cos(2 * t + points[:, 0]), np.sin(3 * t + points[:, 0])], axis=2)
    noise = shake * np.random.default_rng(0).standard_normal((n_frames, len(points), 3))
    c, s = np.cos(t[:, 0]), np.sin(t[:, 0])
    turns = np.stack([np.stack([c, -s, 0 * c], 1), np.stack([s, c, 0 * c], 1), np.stack([0 * c, 0 * c, 0 * c + 1], 1)], 1)
    return MeshSequence(np.einsum("nvi,nij->nvj", points + bend + noise, turns).astype(np.float32), faces)


def n_bytes(bitstream: Bitstream, *names: str) -> int:
    return sum(len(data) for name, data in bitstream.sections.items() if name.split(".")[0] in names)


def test_perceived_error_falls_and_bytes_rise_with_quality() -> None:
    sequence = moving()
    sizes, errors = [], []
    for quality in (20, 40, 60, 80, 100):
        bitstream = Laplacian(quality=quality).encode(sequence).bitstream
        sizes.append(sum(map(len, bitstream.sections.values())))
        sted = compare(sequence, decoded(bitstream, sequence)).sted
        assert sted is not None
        errors.append(sted)
    assert sizes == sorted(sizes)
    assert errors == sorted(errors, reverse=True)


def test_the_geometric_operator_needs_fewer_bits_than_connectivity_alone_and_prediction_fewer_still() -> None:
    sequence = moving()
    settings: dict[str, Any] = {"quality": 60, "edge_power": 0.0}
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
        kg(sequence, Laplacian(quality=50, components=12, **settings).encode(sequence).bitstream)
        for settings in ({"anchors": 400}, {"anchors": 16}, {"anchors": 4, "anchor_ratio": 0.5})
    )
    assert fine < dense < coarse


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
    assert kg(still, bitstream) < 0.5
    assert sum(map(len, bitstream.sections.values())) < 6000


@pytest.mark.parametrize("prediction", ["kalman", "rigid"])
def test_perturbed_predictions_hardly_move_vertices(prediction: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """1e-12 in every prior weight, of the average, the basis, anchors and deltas, moves no vertex by a thousandth of a step."""
    sequence = moving(20, shake=0.02)  # noise teaches weights that mean nothing
    bitstream = Laplacian(quality=80, delta_prediction=prediction).encode(sequence).bitstream
    clean = Laplacian.reader(bitstream).read(0, 20).astype(np.float64)
    perturb_predictions(monkeypatch)
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


@pytest.mark.parametrize("prediction", ["kalman", "rigid"])
def test_an_exactly_flat_average_is_left_out(prediction: str) -> None:
    """Its differential coordinates are rounding noise, and weights that follow from them reach 1e14."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0), indexing="ij")
    a = np.arange(1600).reshape(40, 40)
    corners = [(a[:-1, :-1], a[1:, :-1], a[1:, 1:]), (a[:-1, :-1], a[1:, 1:], a[:-1, 1:])]
    faces = np.concatenate([np.stack(each, -1).reshape(-1, 3) for each in corners]).astype(np.int32)
    sheet = np.stack([x.ravel(), y.ravel(), np.zeros(1600)], 1)
    falling = MeshSequence(np.stack([sheet - [0, 0, t * t / 30] for t in range(8)]).astype(np.float32), faces)
    bitstream = Laplacian(delta_prediction=prediction).encode(falling).bitstream
    assert bitstream.header["operator"] == "tutte"
    assert "average" not in bitstream.sections
    assert kg(falling, bitstream) < 0.2


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
            Laplacian(**wrong)


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
