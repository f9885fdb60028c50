"""More small sequences, and those of `gvpipe.testing`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence
from gvpipe.testing.sequences import awkward as awkward
from gvpipe.testing.sequences import grid as grid
from gvpipe.testing.sequences import held as held
from gvpipe.testing.sequences import partly_still as partly_still
from gvpipe.testing.sequences import same_triangles as same_triangles
from gvpipe.testing.sequences import waving as waving


def rigid(n: int = 12, n_frames: int = 60) -> MeshSequence:
    """Two sheets that turn about different axes, each as a whole."""
    points, faces = grid(n)
    angle = np.linspace(0, 2, n_frames)[:, None]
    x, y = points[:, 0], points[:, 1]
    first = np.stack([x * np.cos(angle), y + 0 * angle, x * np.sin(angle)], axis=2)
    second = np.stack([x + 2 + 0 * angle, y * np.cos(angle), y * np.sin(angle)], axis=2)
    positions = np.concatenate([first, second], axis=1).astype(np.float32)
    return MeshSequence(positions, np.concatenate([faces, faces + n * n]).astype(np.int32), 24.0, name="rigid")


def wrinkled(n_frames: int = 24) -> MeshSequence:
    """Two sheets that turn as a whole; waves that no joint knows run over the first."""
    sequence = rigid(12, n_frames)
    frames = sequence.read(0, n_frames).copy()
    x, y = frames[0, :144, 0], frames[0, :144, 1]
    phase = np.arange(n_frames)[:, None] / 3
    frames[:, :144, 1] += (0.05 * np.sin(14 * x + phase) * np.sin(17 * y)).astype(np.float32)
    return replace(sequence, positions=frames, parts=(Part("waves", (0, 144), (0, 242)), Part("stiff", (144, 288), (242, 484))))


def patched(n: int = 9, n_frames: int = 12, still: float = 0.3) -> MeshSequence:
    """A waving sheet with a seam and a corner of loose triangles, of which the part left of ``still`` never moves; shuffled."""
    sheet = waving(n, n_frames)
    positions, faces = np.array(sheet.positions[:]), sheet.faces
    x, y = grid(n)[0][np.random.default_rng(3).permutation(n * n), :2].T  # of the vertices, as `waving` shuffles them
    positions[:, x <= still] = positions[:1, x <= still]
    middle = np.stack([x, y])[:, faces].mean(axis=2)  # (2, T)
    part = np.where(middle[1] > 0.5, 1, 0) + np.where((middle > 0.6).all(axis=0), 2 + np.arange(len(faces)), 0)
    pairs = np.stack([faces, np.broadcast_to(part[:, None], faces.shape)], axis=2).reshape(-1, 2)
    copies, corners = np.unique(pairs, axis=0, return_inverse=True)
    order = np.random.default_rng(4).permutation(len(copies))
    own = np.argsort(order)[corners.ravel()].reshape(-1, 3).astype(np.int32)
    return MeshSequence(positions[:, copies[order, 0]], own, sheet.fps, name="patched")


def random_mesh(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles over vertices, of which some are copies of one point; the worse the higher the seed."""
    rng = np.random.default_rng(seed)
    n_vertices = int(rng.integers(1, 60))
    faces = rng.integers(0, n_vertices, (int(rng.integers(0, 90)), 3)).astype(np.int32)
    points = np.unique(rng.integers(0, max(1, n_vertices - seed % 5 * 7), n_vertices), return_inverse=True)[1]
    return faces, points
