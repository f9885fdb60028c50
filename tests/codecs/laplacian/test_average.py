"""The average in edge shape space: it keeps what positions lose, and survives what codecs must."""

from __future__ import annotations

import numpy as np
import pytest
from sequences import awkward, grid, waving

import gvpipe.model.sequence
from gvcodecs.laplacian.alignment import Groups, rotations
from gvcodecs.laplacian.average import average_mesh
from gvcodecs.laplacian.edge_shape import EdgeShape, EdgeShapeSum, find_hinges
from gvcodecs.laplacian.shape_fit import _measure
from gvpipe.mesh.topology import unique_edges
from gvpipe.model.sequence import MeshSequence

MESHES = awkward()


def bar() -> tuple[np.ndarray, np.ndarray]:
    """A closed bar of square section along x, 4 long: points and triangles."""
    around, along = 8, 25
    angle = 2 * np.pi * np.arange(around) / around
    ring = 0.3 * np.column_stack([np.zeros(around), np.cos(angle), np.sin(angle)])
    points = np.concatenate([ring + np.array([x, 0, 0]) for x in np.linspace(-2, 2, along)])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij"))
    a, b, c, d = (around * (i + di) + (j + dj) % around for di, dj in ((0, 0), (0, 1), (1, 0), (1, 1)))
    caps = [[base, base + k, base + k + 1][:: 1 if base else -1] for base in (0, len(points) - around) for k in range(1, 7)]
    return points, np.concatenate([np.c_[a, c, b], np.c_[b, c, d], caps]).astype(np.int32)


def walking_bar(n_frames: int = 90) -> MeshSequence:
    """The bar walks once round a circle, as long as it is wide, and wags its ends as it goes."""
    points, faces = bar()
    t = 2 * np.pi * np.arange(n_frames)[:, None] / n_frames
    bend = 0.4 * np.sin(3 * t) + 0 * points[:, 0]  # curvature
    turn = bend * points[:, 0]
    safe = np.where(np.abs(bend) < 1e-6, 1e-6, bend)
    x, y = (1 / safe - points[:, 1]) * np.sin(turn), (1 / safe) * (1 - np.cos(turn)) + points[:, 1] * np.cos(turn)
    world = np.stack([x * np.cos(t) - y * np.sin(t), x * np.sin(t) + y * np.cos(t), points[:, 2] + 0 * x], axis=2)
    world += 5 * np.stack([np.sin(t), -np.cos(t), 0 * t], axis=2)
    return MeshSequence(world.astype(np.float32), faces)


def lengths(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    edges = unique_edges(faces)
    found: np.ndarray = np.linalg.norm(points[..., edges[:, 1], :] - points[..., edges[:, 0], :], axis=-1)
    return found


def length_errors(points: np.ndarray, sequence: MeshSequence) -> np.ndarray:
    """Relative errors of edge lengths against their mean over the frames."""
    wanted = lengths(sequence.read(0, sequence.n_frames).astype(np.float64), sequence.faces).mean(axis=0)
    errors: np.ndarray = np.abs(lengths(points, sequence.faces) / wanted - 1)
    return errors


def rigidly_moved(sequence: MeshSequence, seed: int = 0) -> MeshSequence:
    rng = np.random.default_rng(seed)
    turns = rotations(rng.normal(size=(sequence.n_frames, 3, 3)))
    return MeshSequence(
        sequence.read(0, sequence.n_frames) @ turns + rng.normal(size=(sequence.n_frames, 1, 3)), sequence.faces
    )


def fitted(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Points moved and turned onto a target as one body."""
    one = Groups(np.zeros(len(points), np.int64))
    moved: np.ndarray = one.turned(points[None], target)[0] + target.mean(axis=0) - points.mean(axis=0)
    return moved


def test_a_walk_in_a_circle_keeps_its_lengths_where_the_mean_shrinks() -> None:
    sequence = walking_bar()
    mean = sequence.read(0, sequence.n_frames).astype(np.float64).mean(axis=0)
    average = average_mesh(sequence, sequence.faces)
    assert length_errors(mean, sequence).mean() > 0.3
    assert length_errors(average, sequence).max() < 0.01
    extent = np.ptp(average - average.mean(axis=0), axis=0)
    assert np.linalg.norm(extent) > 0.9 * np.linalg.norm([4, 0.6, 0.6])


def test_the_average_of_stillness_is_the_mesh_itself() -> None:
    points, faces = bar()
    for n_frames in (1, 30):
        still = MeshSequence(np.repeat(points[None].astype(np.float32), n_frames, axis=0), faces)
        np.testing.assert_allclose(average_mesh(still, faces), still.read(0, 1)[0], rtol=0, atol=1e-12)


def test_rigid_motion_changes_no_average() -> None:
    points, faces = bar()
    bent = points + 0.3 * np.sin(points[:, [1, 2, 0]])
    moved = rigidly_moved(MeshSequence(np.repeat(bent[None].astype(np.float32), 40, axis=0), faces))
    np.testing.assert_allclose(fitted(average_mesh(moved, faces), bent), bent, rtol=0, atol=2e-6)  # float32 positions
    deforming = walking_bar(40)
    given, other = average_mesh(deforming, faces), average_mesh(rigidly_moved(deforming), faces)
    assert np.abs(lengths(given, faces) / lengths(other, faces) - 1).max() < 2e-3


def test_the_frame_is_that_of_the_mean_positions() -> None:
    sequence = waving(10, 20)
    mean = sequence.read(0, 20).astype(np.float64).mean(axis=0)
    average = average_mesh(sequence, sequence.faces)
    np.testing.assert_allclose(average, mean, rtol=0, atol=0.1)  # half an edge; the sheet turns by half a radian
    side_b, side_c = (mean[sequence.faces[:, i]] - mean[sequence.faces[:, 0]] for i in (1, 2))
    face = sequence.faces[np.argmax(np.linalg.norm(np.cross(side_b, side_c), axis=1))]
    np.testing.assert_allclose(average[face].mean(axis=0), mean[face].mean(axis=0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", MESHES)
def test_awkward_sequences_have_finite_averages_of_their_size(name: str) -> None:
    sequence = MESHES[name]
    average = average_mesh(sequence, sequence.faces)
    assert average.shape == (sequence.n_vertices, 3) and average.dtype == np.float64
    frames = sequence.read(0, sequence.n_frames).astype(np.float64)
    size = np.ptp(frames, axis=(0, 1)).max()
    centre = frames.mean(axis=(0, 1))
    assert np.abs(average - centre).max() <= 1.5 * size
    np.testing.assert_array_equal(average, average_mesh(sequence, sequence.faces))


def test_components_that_turn_apart_stay_apart() -> None:
    points, faces = bar()
    t = np.arange(60) * 2 * np.pi / 60
    spin = np.stack([np.cos(t), -np.sin(t), 0 * t, np.sin(t), np.cos(t), 0 * t, 0 * t, 0 * t, 1 + 0 * t], axis=1).reshape(
        -1, 3, 3
    )
    still = np.repeat(points[None], 60, axis=0)
    both = np.concatenate([still - [0, 4, 0], points @ spin + [0, 4, 0]], axis=1)
    sequence = MeshSequence(both.astype(np.float32), np.concatenate([faces, faces + len(points)]).astype(np.int32))
    average = average_mesh(sequence, sequence.faces)
    assert length_errors(average, sequence).max() < 1e-3
    gap = average[len(points) :].mean(axis=0) - average[: len(points)].mean(axis=0)
    assert 4 < np.linalg.norm(gap) < 10


def test_a_jump_cut_does_no_harm() -> None:
    sequence = walking_bar(40)
    frames = sequence.read(0, 40).copy()
    frames[25:] = frames[25:] @ np.diag([-1.0, -1.0, 1.0]).astype(np.float32) + np.float32(50)
    cut = MeshSequence(frames, sequence.faces)
    assert length_errors(average_mesh(cut, cut.faces), cut).max() < 0.01


def test_angles_about_pi_are_averaged_on_the_circle() -> None:
    """A hinge nearly closed, flapping through the fold: plus and minus pi must not average to flat."""
    angle = np.pi + np.linspace(-0.1, 0.1, 11)
    wing = np.stack([0.5 + 0 * angle, -np.cos(angle), np.sin(angle)], axis=1)
    fixed = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0.0]])
    frames = np.concatenate([np.repeat(fixed[None], 11, axis=0), wing[:, None]], axis=1)
    sums = EdgeShapeSum(np.array([[0, 1, 2], [1, 0, 3]], np.int32))
    sums.add(frames.astype(np.float32))
    assert abs(abs(sums.average().angles[0]) - np.pi) < 1e-6


def test_hinges_pair_faces_and_skip_degenerate_ones() -> None:
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 1, 1], [2, 0, 0]], np.int32)
    np.testing.assert_array_equal(find_hinges(faces), [[0, 1, 2, 3], [0, 1, 3, 4]])
    assert find_hinges(np.zeros((0, 3), np.int32)).shape == (0, 4)


def test_derivatives_are_those_of_the_errors() -> None:
    points, faces = grid(3)
    points += 0.2 * np.random.default_rng(0).normal(size=points.shape)
    edges, hinges = unique_edges(faces), find_hinges(faces)
    shape = EdgeShape(edges, np.full(len(edges), 0.5), hinges, np.full(len(hinges), 0.3), np.full(len(hinges), 0.8))
    state = _measure(shape, 1.0, points)
    for column in range(points.size):
        step = np.zeros(points.size)
        step[column] = 1e-6
        ahead, behind = (_measure(shape, 1.0, points + sign * step.reshape(-1, 3)).errors for sign in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 2e-6, state.jacobian[:, [column]].toarray().ravel(), rtol=0, atol=1e-6)


def test_frames_are_read_once_and_a_chunk_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    sequence = walking_bar()
    reads: list[tuple[int, int]] = []

    class Lazy:
        shape = sequence.positions.shape

        def __getitem__(self, key: slice) -> np.ndarray:
            reads.append((key.start, key.stop))
            return sequence.positions[key]

    whole = average_mesh(sequence, sequence.faces)
    monkeypatch.setattr(gvpipe.model.sequence, "CHUNK_BYTES", 7 * 12 * sequence.n_vertices)
    parts = average_mesh(MeshSequence(Lazy(), sequence.faces), sequence.faces)
    assert reads == [(first, min(first + 7, 90)) for first in range(0, 90, 7)]
    assert np.abs(lengths(parts, sequence.faces) / lengths(whole, sequence.faces) - 1).max() < 2e-3


def test_a_part_of_the_frames_has_an_average_of_its_own() -> None:
    sequence = waving(8, 20)
    part = MeshSequence(sequence.read(5, 12), sequence.faces)
    np.testing.assert_array_equal(average_mesh(sequence, sequence.faces, 5, 12), average_mesh(part, sequence.faces))
