"""Parsers that go wrong in every way, for the tests of the fuzzer."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from fuzz.mutation import mutate_bytes
from fuzz.parts import BrokenPromise, Parts, Seed, Target
from fuzz.targets import Options

KINDS = {b"C": "crashed", b"B": "broken", b"L": "large", b"H": "hung", b"D": "crashed", b"M": "broken"}
OFTEN = [0.25, 0.25, 0.15, 0.05, 0.1, 0.2]


def bad_targets(options: Options) -> list[Target]:
    """One target; its seed is refused, and what its cases do follows from a letter."""
    return [Target("bad", (Seed("sound", {"file": b"sound"}),), _mutate, lambda parts: dict(parts), _parse, (ValueError,))]


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    letter = list(KINDS)[int(np.searchsorted(np.cumsum(OFTEN), rng.random()))]
    return {"file": letter + mutate_bytes(parts["file"], rng)}


def _parse(path: Path) -> None:
    match path.read_bytes()[:1]:
        case b"C":
            raise KeyError("no such key")
        case b"B":
            raise BrokenPromise("positions are not finite")
        case b"L":
            np.ones(100 << 20, np.uint8)
        case b"H":
            while True:
                pass
        case b"D":
            os.abort()
        case b"M":
            raise ValueError("file: \x1b[31m")
        case _:
            raise ValueError("file: refused")
