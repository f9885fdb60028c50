"""What files and streams of pdct hold, and how far it is from the source."""

from __future__ import annotations

from typing import Any

import numpy as np
from sequences import grid

from gvcodecs.pdct import Pdct, StreamEncoder
from gvpipe.container.bitstream import Bitstream
from gvpipe.model.sequence import MeshSequence


def decode(bitstream: Bitstream) -> np.ndarray:
    return Pdct.reader(bitstream).read(0, bitstream.n_frames)


def error(sequence: MeshSequence, decoded: np.ndarray) -> float:
    return float(np.sqrt(((sequence.read(0, sequence.n_frames) - decoded) ** 2).sum(axis=2).mean()))


def two_plates() -> MeshSequence:
    """Two sheets, apart, each turning about an axis of its own."""
    points, faces = grid(8)
    t = np.linspace(0, 1, 9)[:, None]
    x, y = points[:, 0], points[:, 1]
    one = np.stack([x * np.cos(t), y + 0 * t, x * np.sin(t)], axis=2)
    two = np.stack([3 + x + 0 * t, y * np.cos(2 * t), -y * np.sin(2 * t)], axis=2)
    return MeshSequence(np.concatenate([one, two], axis=1).astype(np.float32), np.concatenate([faces, faces + 64]))


def coded_stream(sequence: MeshSequence, **chosen: Any) -> bytes:
    encoder = StreamEncoder(sequence.faces, Pdct(**chosen), sequence.fps)
    return b"".join(encoder.add(frame) for frame in sequence.read(0, sequence.n_frames)) + encoder.finish()
