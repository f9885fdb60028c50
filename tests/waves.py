"""Fields on a small sheet, and the round trip that all of their tests make."""

from __future__ import annotations

import numpy as np
from sequences import grid

from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.segment import MODES
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Float32

SHEET, SHEET_FACES = grid(9)
MESH = FieldMesh(SHEET_FACES, len(SHEET))
EXACT = FieldBound(exact=True)


def wave(n_frames: int = 20, n_components: int = 1, mesh: FieldMesh = MESH) -> Float32:
    """A front that travels over the sheet, ``(F, R, C)``, with noise."""
    points = SHEET if mesh.domain == "vertex" else SHEET[mesh.faces].mean(axis=1)
    x = points[:, 0] / np.ptp(SHEET[:, 0]) * 6
    t = np.arange(n_frames)[:, None]
    noise = np.random.default_rng(1).normal(0, 0.01, (n_frames, mesh.n_rows, n_components))
    front = np.tanh(x - t / 4)[:, :, None] * (1 + np.arange(n_components)) + np.sin(t / 3)[:, :, None]
    return np.asarray(front + noise, np.float32)


def encode(
    values: Array, bound: FieldBound, mesh: FieldMesh = MESH, modes: tuple[str, ...] = MODES, holes: bool = False
) -> bytes:
    """The section of ``values (F, R, C)``."""
    return encode_field(lambda a, b: values[a:b], len(values), mesh, bound, holes=holes, modes=modes)


def decode(section: bytes, values: Array, mesh: FieldMesh = MESH) -> Array:
    """All frames of a section; ``values`` gives their number."""
    return FieldReader(section, len(values), mesh, "field").read(0, len(values))
