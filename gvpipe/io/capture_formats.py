"""Formats of whole files whose triangles may change from frame to frame, and what writes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gvpipe.io.late import late
from gvpipe.io.scene_formats import USD

CaptureWriter = Callable[[Any, Path], Any]
"""Writes a `gvpipe.model.capture.Capture` to a path; returns notes: what the format cannot hold."""

CAPTURE_WRITERS: dict[str, CaptureWriter] = {
    ".glb": late("gltf.capture_writer", "write_capture"),
    ".pvd": late("simulation.pvd_writer", "write_capture"),
    ".vtkhdf": late("simulation.vtkhdf_capture", "write_capture"),
    ".abc": late("alembic.capture_writer", "write_capture"),
    **dict.fromkeys(USD, late("usd.capture_writer", "write_capture")),
}
