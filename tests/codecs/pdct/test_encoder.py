"""Whole files of pdct: seeds, kept coefficients, rigid motion, welded vertices."""

from __future__ import annotations

import numpy as np
import pytest
from clips import decode, error, two_plates
from sequences import waving

from gvcodecs.pdct import Pdct
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.welding import find_points


def test_rigid_motion_costs_next_to_nothing() -> None:
    sequence = two_plates()
    more, fewer = (sum(map(len, Pdct(clusters=k).encode(sequence).bitstream.sections.values())) for k in (1, 2))
    assert fewer < 0.9 * more


def test_fewer_kept_coefficients_cost_less_and_lose_more() -> None:
    sequence = waving(20, 20)
    coded = [Pdct(kept=kept, clusters=4).encode(sequence).bitstream for kept in (0.02, 0.1, 0.4, 1.0)]
    sizes = [len(b.sections["clip.0"]) for b in coded]
    errors = [error(sequence, decode(b)) for b in coded]
    assert sizes == sorted(sizes)
    assert errors == sorted(errors, reverse=True)


def test_the_seed_triangles_keep_their_precision() -> None:
    """At the coarsest quality, some vertices (the seeds) are still within half a step of 16 bits."""
    sequence = waving()
    decoded = decode(Pdct(quality=0).encode(sequence).bitstream)
    extent = np.ptp(sequence.read(0, 40), axis=(0, 1)).max()
    worst = np.abs(sequence.read(0, 40) - decoded).max(axis=(0, 2))
    assert (worst < 0.51 * extent / 65535 + 1e-6).sum() >= 3 * 15


def soup(sequence: MeshSequence) -> MeshSequence:
    """Every triangle with vertices of its own, and a moving vertex that no triangle uses."""
    frames = sequence.read(0, sequence.n_frames)
    corners = np.concatenate([frames[:, sequence.faces.ravel()], frames[:, :1] + np.float32(0.5)], axis=1)
    return MeshSequence(corners, np.arange(sequence.faces.size).reshape(-1, 3).astype(np.int32), sequence.fps)


@pytest.mark.parametrize("reorder", [False, True])
def test_vertices_of_one_trajectory_are_one_point(reorder: bool) -> None:
    one = waving(14, 16)
    sequence = soup(one)
    encoded = Pdct(reorder=reorder).encode(sequence)
    bitstream, own = encoded.bitstream, sequence.reordered(encoded.permutation, sequence.faces)
    decoded, points = decode(bitstream), find_points(own)
    assert points.max() + 1 == one.n_vertices + 1
    members = np.unique(points, return_index=True)[1]
    assert np.array_equal(decoded, decoded[:, members[points]])
    welded = Pdct(reorder=reorder).encode(one).bitstream
    assert len(bitstream.section("clip.0")) < 1.1 * len(welded.section("clip.0"))


def test_clip_names_the_frames_per_clip() -> None:
    sequence = waving(6, 20)
    assert Pdct(clip=8).encode(sequence).bitstream.sections == Pdct(segment=8).encode(sequence).bitstream.sections
