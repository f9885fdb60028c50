"""Files of version 3: one sample for each point that moves, none for what stands still."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from sequences import patched

from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base.surface import read_surface
from gvcodecs.mcgv.decoding import frame_reader as mcgv_reader
from gvcodecs.mcgv.decoding import trajectory_reader
from gvcodecs.mcgv.decoding.frame_reader import read_layout
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.layout import kd_tree
from gvcodecs.mcgv.motion import blended
from gvpipe.coding.registry import open_reader
from gvpipe.connectivity import base_mesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.budget import THRIFTY, UNLIMITED
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.still_vertices import encode_flags, find_still
from gvpipe.trajectory.welding import find_points

FAST: dict[str, Any] = {"preset": "ultrafast", "clusters": 3, "gop": 4, "reorder": False}
ROUTES: list[dict[str, Any]] = [
    {"prediction": "affine"},
    {"prediction": "affine", "placement": "halves", "quality": 95},
    {"prediction": "blended"},
    {"prediction": "blended", "placement": "charts", "profile": "precise"},
    {"prediction": "blended", "image": "jpeg"},
    {"prediction": "blended", "transform": "klt"},
]


def decode(stream: Bitstream) -> np.ndarray:
    return open_reader(stream).read(0, stream.n_frames)


@pytest.mark.parametrize("settings", ROUTES, ids=str)
def test_points_stay_whole_and_still_vertices_still(settings: dict[str, Any]) -> None:
    sequence = patched()
    stream = Mcgv(**{**FAST, **settings}).encode(sequence).bitstream
    header = Header.of(stream)
    surface = read_surface(stream, header)
    frames, source = decode(stream), np.asarray(sequence.positions[:])
    points, still = find_points(sequence), find_still(sequence)
    assert surface.n_slots == len(np.unique(points[~still]))
    first = np.unique(points, return_index=True)[1]
    assert np.array_equal(frames, frames[:, first[points]])
    assert (frames[:, still] == frames[0, still]).all()
    assert np.abs(frames[0, still] - source[0, still]).max() <= 1.5 * header.base.step * (1 + 1e-6)
    assert np.array_equal(surface.vertices, np.flatnonzero(~still))
    reader = open_reader(stream)
    for frame in (7, 0, 11, 3):
        assert np.array_equal(reader.read(frame, frame + 1)[0], frames[frame])


@pytest.mark.parametrize("settings", [*ROUTES, {"prediction": "blended", "quality": 20}], ids=str)
def test_threads_decode_the_same(settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Several groups of pictures or one, from any frame on: as on one thread."""
    for gop in (4, 64):
        stream = Mcgv(**{**FAST, **settings, "gop": gop}).encode(patched(n_frames=40)).bitstream
        expected = decode(stream)
        with monkeypatch.context() as patch:
            for module in (mcgv_reader, blended, kd_tree, base_mesh):
                patch.setattr(module, "LARGE", 1)
            patch.setattr(mcgv_reader, "MANY_SLOTS", 1)
            for start, stop in ((0, 40), (3, 38), (17, 18), (5, 5)):
                for budget in (UNLIMITED, THRIFTY):
                    reader = open_reader(dataclasses.replace(stream, budget=budget))
                    assert np.array_equal(reader.read(start, stop), expected[start:stop])


@pytest.mark.parametrize("settings", ROUTES, ids=str)
def test_of_what_never_moves_one_point_has_samples(settings: dict[str, Any]) -> None:
    sequence = patched(still=1.0)
    stream = Mcgv(**{**FAST, **settings}).encode(sequence).bitstream
    header = Header.of(stream)
    assert read_surface(stream, header).n_slots == 1
    frames = decode(stream)
    assert np.abs(frames - sequence.positions[:1]).max() <= 2 * header.base.step


def test_one_frame_has_samples_for_all_points() -> None:
    sequence = MeshSequence(np.asarray(patched().positions[:1]), patched().faces)
    stream = Mcgv(**FAST).encode(sequence).bitstream
    assert "still" not in stream.sections
    assert read_surface(stream, Header.of(stream)).n_slots == len(np.unique(find_points(sequence)))


@pytest.mark.parametrize("settings", [ROUTES[0], ROUTES[2], ROUTES[5]], ids=str)
def test_flags_that_do_not_fit_are_corrupt(settings: dict[str, Any]) -> None:
    """Other points than those that the other sections tell of, all points, or bytes that are no flags."""
    stream = Mcgv(**{**FAST, **settings}).encode(patched()).bitstream
    n_points = len(np.unique(find_points(patched())))
    assert decode(stream).shape == (12, stream.n_vertices, 3)
    for flags in (np.ones(n_points, bool), np.arange(n_points) % 2 == 0, np.zeros(n_points, bool)):
        with pytest.raises(CorruptFile):
            decode(dataclasses.replace(stream, sections={**stream.sections, "still": encode_flags(flags)}))
    data = stream.section("still")
    for broken in (b"", data[:-1], data + b"\0", bytes(len(data)), b"\xff" * len(data)):
        with pytest.raises(CorruptFile):
            decode(dataclasses.replace(stream, sections={**stream.sections, "still": broken}))
    bare = {name: data for name, data in stream.sections.items() if name != "still"}
    with pytest.raises(CorruptFile):
        decode(dataclasses.replace(stream, sections=bare))


def test_planes_must_hold_the_slots() -> None:
    """Not the vertices: those are more."""
    stream = Mcgv(**FAST, prediction="blended").encode(patched(24, 4)).bitstream
    assert 256 < stream.header["width"] * stream.header["height"] < stream.n_vertices
    assert np.isfinite(decode(stream)).all()
    header = Header.of(stream)
    with pytest.raises(CorruptFile, match="do not hold"):
        read_layout(stream, dataclasses.replace(header, width=16, height=16), read_surface(stream, header))


def test_components_are_limited_by_slots(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what an encoder counts: with copies there are more vertices."""
    stream = Mcgv(**FAST, prediction="blended", transform="klt").encode(patched()).bitstream
    header = Header.of(stream)
    assert header.images is not None
    most = max(header.images.components) * read_surface(stream, header).n_slots
    assert 0 < most < max(header.images.components) * stream.n_vertices
    monkeypatch.setattr(trajectory_reader, "MAX_VALUES", most)
    assert np.isfinite(decode(stream)).all()
    monkeypatch.setattr(trajectory_reader, "MAX_VALUES", most - 1)
    with pytest.raises(CorruptFile, match="components"):
        decode(stream)
