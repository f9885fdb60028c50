"""Recordings: geometry videos, or pages of them, written from any loop while its frames come."""

from __future__ import annotations

from gvpipe.recording.recorder import Recorder, record
from gvpipe.recording.rigid_parts import RigidParts

__all__ = ["Recorder", "RigidParts", "record"]
