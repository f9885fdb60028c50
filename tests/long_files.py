"""Files of codec `pca` in the stream layout that web players fetch in parts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from sequences import waving

import gvpipe

SEGMENT = 12  # frames


def write_long(path: Path, segments: int) -> Path:
    """A mesh that walks away; what all segments share exceeds the player's first request of 64 KB."""
    waves = waving(16, segments * SEGMENT)
    walk = 0.1 * np.arange(waves.n_frames, dtype=np.float32)[:, None, None] * np.array([1, 0, 0], np.float32)
    noise = np.random.default_rng(1).random((2, waves.n_vertices, 60), np.float32)
    attributes = {"noise": noise[0], "more": noise[1]}
    sequence = dataclasses.replace(waves, positions=waves.read(0, waves.n_frames) + walk, attributes=attributes)
    exact = dict.fromkeys(attributes, "exact")
    gvpipe.encode(sequence, path, "pca", stream=True, segment=SEGMENT, quality=90, attributes=exact)
    return path
