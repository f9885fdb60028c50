"""What all fuzzed parsers have in common: a file in parts, seeds, and cases that follow from a number."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gvpipe.foundation.budget import LEAST_BYTES, LEAST_SECONDS

Parts = dict[str, bytes]  # a file taken apart; checksums and lengths are made when it is put together
Mutate = Callable[[Parts, np.random.Generator, "tuple[Seed, ...]"], Parts]


@dataclass(frozen=True)
class Seed:
    """A sound file.

    Args:
        name: of it.
        parts: of it; not to be changed.
    """

    name: str
    parts: Parts = field(repr=False)


@dataclass(frozen=True)
class Target:
    """A parser under test.

    Args:
        name: of it, on the command line.
        seeds: sound files that it reads.
        mutate: from a seed's parts to those of a case; the seeds may lend it parts.
        join: parts to files by name, in one folder; the parser is given the first.
        parse: reads a file, and everything in it. Raises what a user would see.
        refusal: the only exceptions that it may raise.
        memory: bytes that any file may cost, however small.
        seconds: of the processor, as well.
    """

    name: str
    seeds: tuple[Seed, ...]
    mutate: Mutate
    join: Callable[[Parts], dict[str, bytes]]
    parse: Callable[[Path], None]
    refusal: tuple[type[Exception], ...]
    memory: int = LEAST_BYTES
    seconds: float = LEAST_SECONDS

    def case(self, run_seed: int, number: int) -> tuple[Seed, Parts]:
        """The seed and the parts of case ``number``; the first cases are the seeds themselves."""
        if number < len(self.seeds):
            return self.seeds[number], self.seeds[number].parts
        rng = np.random.default_rng([run_seed, zlib.crc32(self.name.encode()), number])
        seed = self.seeds[int(rng.integers(len(self.seeds)))]
        return seed, self.mutate(dict(seed.parts), rng, self.seeds)


class BrokenPromise(AssertionError):
    """A parser took a file, and gave what it must not give."""
