from __future__ import annotations

from fuzz.parts import Seed, Target


def browser_targets(seeds: tuple[Seed, ...]) -> list[Target]:
    return []
