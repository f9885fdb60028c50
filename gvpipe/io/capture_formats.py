"""Formats of whole files whose triangles may change from frame to frame, and what writes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

CaptureWriter = Callable[[Any, Path], Any]
"""Writes a `gvpipe.model.capture.Capture` to a path; returns notes: what the format cannot hold."""

CAPTURE_WRITERS: dict[str, CaptureWriter] = {}
