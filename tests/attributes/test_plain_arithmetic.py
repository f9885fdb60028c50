"""Kernels give the same bytes in Python's own arithmetic as compiled: plain operations on float64 in a fixed order.

Compiled code has types of its own (``float`` of a float32 stays one), and a decoder in another language has neither's.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from sequences import waving
from shapes import ball

from gvpipe.attributes.attribute_coding import decode_attribute, encode_attribute
from gvpipe.attributes.surface import Surface


def digests() -> list[str]:
    """Hashes of the bytes of attributes by every method, and of what they decode to."""
    sheet = waving(7, 2)
    points, faces = ball(6, 8)
    found = []
    for positions, triangles in ((sheet.read(1, 2)[0], sheet.faces), (points, faces)):
        surface = Surface(triangles, len(positions), np.ascontiguousarray(positions, np.float32))
        random = np.random.default_rng(0)
        bent = positions * np.array([1, 0.7, 0.3]) + 0.02 * random.normal(size=positions.shape)
        for kind, values, bound in (
            ("uv", bent[:, :2], 0.001),
            ("uv", bent[:, 1:], 0.0),
            ("normal", bent, 1.0),
            ("vector", bent, 0.01),
        ):
            data = encode_attribute(values, None, surface, domain="vertex", kind=kind, bound=bound)
            decoded, _ = decode_attribute(data, surface, "x", domain="vertex")
            found.append(hashlib.sha256(data + decoded.tobytes()).hexdigest())
    return found


def test_bytes_are_those_of_plain_arithmetic() -> None:
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    script = "import test_plain_arithmetic as t; print('\\n'.join(t.digests()))"
    run = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.split() == digests()
