"""Trajectory images: pictures that are coefficients, not frames."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import grid, waving

import gvpipe
from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Blend, BlendFit, Weights
from gvcodecs.mcgv.pictures.trajectories import (
    _decode_outliers,
    _encode_outliers,
    count_pictures,
    decode_segment,
    encode_segment,
)
from gvpipe.coding.registry import open_reader
from gvpipe.container.cursor import Cursor, varint
from gvpipe.container.mp4 import read_file
from gvpipe.entropy.integers import encode_integers
from gvpipe.foundation.errors import CorruptFile, SettingError
from gvpipe.media.video import VideoReader
from gvpipe.model.sequence import MeshSequence


def one_cluster(base: np.ndarray) -> BlendFit:
    """A blend in which all points follow one affine motion."""
    alone = np.zeros((len(base), INFLUENCES), np.int32)
    parts = alone.copy()
    parts[:, 0] = TOTAL
    return BlendFit(Blend(base, Weights(alone, parts), 1))


def bent(n: int = 12, n_frames: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """Base positions of a sheet, and displacements that are affine plus a bump: ``(V, 3)``, ``(V, 3n)``."""
    base, _ = grid(n)
    t = np.arange(n_frames)[:, None] / n_frames
    affine = np.stack([0.3 * t * base[:, 1], 0.1 * t + 0 * base[:, 0], np.sin(3 * t) * base[:, 0]], axis=2)
    bump = 0.05 * np.exp(-30 * ((base[:, :2] - 0.5) ** 2).sum(axis=1)) * np.sin(9 * t)
    affine[:, :, 2] += bump
    return base, np.ascontiguousarray(affine.swapaxes(0, 1).reshape(len(base), -1))


@pytest.mark.parametrize("largest", [1e9, 3.0])
def test_a_segment_comes_back_within_its_error(largest: float) -> None:
    """What the planes lose by rounding to a sixth of a step is little; what they cannot hold comes back by itself."""
    base, trajectories = bent()
    fit = one_cluster(base)
    error = trajectories.size * 1e-3**2
    coded = encode_segment(trajectories, fit, largest, error)
    samples = np.clip(np.rint(coded.left * 6) / 6, -largest, largest)
    assert (np.abs(coded.left) > 3.0).any()
    basis, coefficients = decode_segment(Cursor(coded.section, "s"), samples, coded.step, fit.matrix, 30)
    decoded = (basis.vectors @ coefficients + basis.mean[:, None]).T
    assert np.square(decoded - trajectories).sum() < 1.5 * error


def test_affine_motion_leaves_nothing_to_the_planes() -> None:
    base, _ = grid(9)
    turned = base @ np.array([[0.9, 0.2, 0.1], [-0.3, 1.1, 0.4], [0.0, 0.5, 0.7]])
    weight = np.linspace(0, 1, 20)[:, None, None]
    trajectories = ((turned - base) * weight).swapaxes(0, 1).reshape(len(base), -1)
    coded = encode_segment(trajectories, one_cluster(base), 1e9, trajectories.size * 1e-4**2)
    assert len(coded.left) >= 1 and np.abs(coded.left).max() < 1.5


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 7), st.integers(1, 9), st.integers(0, 2**32))
def test_outliers_come_back_where_they_were(n_vertices: int, n_components: int, seed: int) -> None:
    left = np.random.default_rng(seed).normal(0, 40, (n_vertices, n_components))
    samples = np.zeros((n_components, n_vertices))
    _decode_outliers(Cursor(_encode_outliers(left, 30.0), "s"), samples)
    assert np.array_equal(samples.T, np.where(np.abs(left) > 30.0, np.rint(left), 0))


@pytest.mark.parametrize("gaps", [[3, 0], [2, 7], [-1], [9], [1 << 38, 1 << 38]])
def test_outliers_out_of_place_are_corrupt(gaps: list[int]) -> None:
    coded = encode_integers(np.array(gaps))
    data = varint(len(gaps)) + varint(len(coded)) + coded + encode_integers(np.ones(len(gaps), np.int64))
    with pytest.raises(CorruptFile, match="outlier"):
        _decode_outliers(Cursor(data, "s"), np.zeros((3, 3)))


def test_one_wild_vertex_is_sent_apart(tmp_path: Path) -> None:
    """A vertex that jumps about beyond any plane's range costs itself, not everyone's precision."""
    calm = waving(16, 20)
    positions = np.array(calm.positions[:])
    positions[:, 77] += np.random.default_rng(1).normal(0, 300, (20, 3)).astype(np.float32)
    wild = MeshSequence(positions, calm.faces, calm.fps)
    gvpipe.encode(wild, tmp_path / "w.mp4", prediction="blended", transform="klt", quality=90, clusters=2)
    decoded = np.asarray(gvpipe.decode(tmp_path / "w.mp4").positions[:])
    error = np.linalg.norm(decoded - positions, axis=2)
    diagonal = np.linalg.norm(np.ptp(positions[0], axis=0))
    assert np.sqrt(np.square(error).mean()) < 1e-3 * diagonal and error.max() < 0.02 * diagonal


def test_a_frame_costs_its_segment_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gvpipe.encode(waving(8, 40), tmp_path / "a.mp4", prediction="blended", transform="klt", segment=10)
    decoded: list[int] = []
    plain = VideoReader._decode

    def counted(self: VideoReader, group: int) -> object:
        decoded.append(group)
        return plain(self, group)

    monkeypatch.setattr(VideoReader, "_decode", counted)
    counts = [count_pictures(n) for n in read_file(tmp_path / "a.mp4").header["components"]]
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert decoded == []
        for k in (17, 12, 19, 10):
            assert video[k].shape == (64, 3)
    assert sorted(decoded) == list(range(counts[0], counts[0] + counts[1]))


def test_targets_are_met(tmp_path: Path) -> None:
    """A search opens bitstreams that were never written: their headers must hold what JSON gives back, lists for one."""
    sequence = waving(8, 12)
    gvpipe.encode(sequence, tmp_path / "a.mp4", target_kg=1.0, prediction="blended", transform="klt")
    kg = gvpipe.compare(sequence, gvpipe.decode(tmp_path / "a.mp4")).kg
    assert kg is not None and kg <= 1.0


def test_info_tells_of_frames_not_of_pictures(tmp_path: Path) -> None:
    gvpipe.encode(waving(8, 40), tmp_path / "a.mp4", prediction="blended", transform="klt")
    info = gvpipe.info(tmp_path / "a.mp4")
    bitstream = read_file(tmp_path / "a.mp4")
    assert (info.frames, info.fps, len(gvpipe.open(tmp_path / "a.mp4"))) == (40, 24.0, 40)
    pictures = count_pictures(bitstream.header["components"][0])
    assert pictures < 40
    assert VideoReader(bitstream.video, *_shape(bitstream.header)).n_frames == pictures


@pytest.mark.slow
def test_klt_is_smaller_at_small_errors(tmp_path: Path) -> None:
    sequence = waving(24, 60)

    def measure(quality: float, transform: str) -> tuple[int, float]:
        path = tmp_path / "a.mp4"
        size = gvpipe.encode(sequence, path, prediction="blended", transform=transform, quality=quality).bytes
        return size, gvpipe.compare(sequence, gvpipe.decode(path)).rmse

    size, error = measure(90, "none")  # near quality 77 both are as large, and below it blends alone are smaller
    coarser, finer = measure(80, "klt"), measure(98, "klt")
    assert finer[1] < error < coarser[1]
    assert np.interp(np.log(error), np.log([finer[1], coarser[1]]), np.log([finer[0], coarser[0]])) < np.log(size)


@pytest.mark.parametrize("wrong", [{"image": "jpeg"}, {"prediction": "affine"}, {"transform": "dct"}])
def test_settings_that_do_not_go_together_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingError, match="transform"):
        Mcgv(**{"prediction": "blended", "transform": "klt", **wrong})


@pytest.mark.parametrize(
    "wrong",
    [
        {"transform": "dct"},
        {"components": [0]},
        {"components": [10**9]},
        {"components": [True]},
        {"components": []},
        {"components": 3},
        {"steps": [0.0]},
        {"steps": [float("nan")]},
        {"steps": [1e300]},
        {"steps": ["1"]},
        {"fineness": 0},
        {"fineness": 1.5},
        {"prediction": "affine"},
        {"profile": "jpeg"},
    ],
)
def test_headers_are_hostile(wrong: dict[str, Any], klt: gvpipe.container.bitstream.Bitstream) -> None:
    with pytest.raises(CorruptFile):
        open_reader(dataclasses.replace(klt, header={**klt.header, **wrong})).read(0, 1)


@pytest.fixture(scope="module")
def klt(tmp_path_factory: pytest.TempPathFactory) -> gvpipe.container.bitstream.Bitstream:
    """A small file of trajectory images with several pictures."""
    path = tmp_path_factory.mktemp("klt") / "a.mp4"
    gvpipe.encode(waving(8, 12), path, prediction="blended", transform="klt", quality=90)
    bitstream = read_file(path)
    assert bitstream.header["components"][0] > 3
    return bitstream


def _shape(header: Any) -> tuple[Any, int, int]:
    from gvpipe.media.video import PROFILES

    return PROFILES[header["profile"]], header["width"], 3 * header["height"]
