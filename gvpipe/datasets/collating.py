"""Samples of several sequences as one batch of arrays: filled up to one size, or one behind the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import InputError

OWN = ("key", "positions", "faces", "fps")


def collate(samples: Sequence[Mapping[str, Any]], *, packed: bool = False) -> dict[str, Any]:
    """Make one batch of samples (`Samples`), whose frames, vertices and triangles may differ in number.

    B samples, the largest of F frames, V vertices and T triangles. Filled up, which is the default:

    - ``positions`` ``(B, F, V, 3) float32``, zeros where a sample has none;
    - ``frame_mask`` ``(B, F) bool`` and ``vertex_mask`` ``(B, V) bool``: what a sample has;
    - ``faces`` ``(B, T, 3) int32`` and ``face_mask`` ``(B, T) bool``; rows that a sample lacks are zeros.

    Packed, as PyTorch Geometric lays out batches of graphs; all samples must have the same number of frames:

    - ``positions`` ``(F, sum of V, 3) float32``, the vertices of one sample behind those of the other;
    - ``faces`` ``(sum of T, 3) int32``, which count vertices of the whole batch;
    - ``batch`` ``(sum of V,) int64``: the number of each vertex's sample;
    - ``vertex_offsets`` and ``face_offsets`` ``(B + 1,) int64``: where each sample begins.

    Both have ``key``, a list, and ``fps`` ``(B,) float64``. Other values of samples, which a ``transform`` adds, become lists.

    Args:
        samples: at least one.
        packed: whether they are packed; False: filled up.

    Raises:
        InputError: there is no sample, one lacks positions or triangles, or packed samples differ in their number of frames.

    Examples:
        >>> import numpy as np
        >>> one = {"key": "a", "positions": np.ones((2, 3, 3), np.float32), "faces": np.array([[0, 1, 2]]), "fps": 30.0}
        >>> two = {"key": "b", "positions": np.ones((2, 4, 3), np.float32), "faces": np.array([[1, 2, 3]]), "fps": 24.0}
        >>> batch = collate([one, two])
        >>> batch["positions"].shape, batch["vertex_mask"].sum(axis=1).tolist()
        ((2, 2, 4, 3), [3, 4])
        >>> batch = collate([one, two], packed=True)
        >>> batch["positions"].shape, batch["faces"].tolist(), batch["vertex_offsets"].tolist()
        ((2, 7, 3), [[0, 1, 2], [4, 5, 6]], [0, 3, 7])
    """
    if not samples:
        raise InputError("no sample to collate; give at least one")
    for sample in samples:
        missing = [name for name in OWN if name not in sample]
        if missing:
            raise InputError(f"a sample has no {' and no '.join(missing)}; collate takes what gvpipe.datasets reads")
    positions = [np.asarray(sample["positions"], np.float32) for sample in samples]
    faces = [np.asarray(sample["faces"], np.int32) for sample in samples]
    arrays = _pack(positions, faces) if packed else _fill(positions, faces)
    others = [name for name in samples[0] if name not in OWN]
    return {
        "key": [sample["key"] for sample in samples],
        "fps": np.array([sample["fps"] for sample in samples], np.float64),
        **arrays,
        **{name: [sample.get(name) for sample in samples] for name in others},
    }


def _fill(positions: Sequence[Float32], faces: Sequence[Any]) -> dict[str, Any]:
    n_frames, n_vertices = (np.array([each.shape[axis] for each in positions]) for axis in (0, 1))
    n_faces = np.array([len(each) for each in faces])
    filled = np.zeros((len(positions), n_frames.max(), n_vertices.max(), 3), np.float32)
    corners = np.zeros((len(positions), n_faces.max(), 3), np.int32)
    for k, (points, triangles) in enumerate(zip(positions, faces, strict=True)):
        filled[k, : points.shape[0], : points.shape[1]] = points
        corners[k, : len(triangles)] = triangles
    masks = {"frame_mask": n_frames, "vertex_mask": n_vertices, "face_mask": n_faces}
    return {
        "positions": filled,
        "faces": corners,
        **{name: np.arange(counts.max()) < counts[:, None] for name, counts in masks.items()},
    }


def _pack(positions: Sequence[Float32], faces: Sequence[Any]) -> dict[str, Any]:
    frames = sorted({len(each) for each in positions})
    if len(frames) > 1:
        raise InputError(
            f"samples of {frames[0]} and of {frames[-1]} frames cannot be packed; read as many of each "
            f"(frames=slice(0, {frames[0]})), or fill them up (packed=False)"
        )
    n_vertices = np.array([each.shape[1] for each in positions], np.int64)
    vertex_offsets = np.concatenate([[0], np.cumsum(n_vertices)])
    face_offsets = np.concatenate([[0], np.cumsum([len(each) for each in faces])]).astype(np.int64)
    shifted = [each + np.int32(start) for each, start in zip(faces, vertex_offsets[:-1], strict=True)]
    return {
        "positions": np.concatenate(positions, axis=1),
        "faces": np.concatenate(shifted),
        "batch": np.repeat(np.arange(len(positions)), n_vertices),
        "vertex_offsets": vertex_offsets,
        "face_offsets": face_offsets,
    }
