"""How far a long call is: what its caller may follow."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with a stage's name and the part of it that is done, 0..1; stages come one after the other."""


def silent(stage: str, done: float) -> None:
    """Progress that nobody follows."""
