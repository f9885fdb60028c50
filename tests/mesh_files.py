"""Small mesh files and their values, for the tests of all formats."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gvpipe.model.sequence import MeshSequence

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
POSITIONS = hnp.arrays(np.float32, st.tuples(st.integers(1, 4), st.integers(3, 6), st.just(3)), elements=FLOATS)
FACES = np.array([[2, 0, 1], [0, 1, 2], [1, 1, 0]], np.int32)
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLY_ROWS = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
FRAME_SUFFIXES = ["obj", "ply", "off", "glb"]
fast = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def same_bits(a: Any, b: Any) -> bool:
    return np.asarray(a).shape == np.asarray(b).shape and np.asarray(a).tobytes() == np.asarray(b).tobytes()


def grid(n_frames: int = 4, n: int = 5, attributes: Mapping[str, Any] | None = None) -> MeshSequence:
    """A waving sheet of (n + 1)^2 vertices and one vertex that no triangle uses."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    rest = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    moving = np.stack([rest + np.array([0, 0, 1]) * np.sin(rest + 0.3 * f) / 3 for f in range(n_frames)])
    positions = np.concatenate([moving, np.full((n_frames, 1, 3), 7.25)], axis=1)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + n + 1], 1)])
    return MeshSequence(positions.astype(np.float32), faces.astype(np.int32), attributes=attributes or {})


def obj_file(folder: Path, text: str, name: str = "f.obj") -> Path:
    (folder / name).write_bytes(text.encode())
    return folder / name
