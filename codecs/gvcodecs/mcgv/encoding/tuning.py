"""What was tuned of the search for a file of a target error, each value with the record of what decided it.

Records are docs/decisions/NUMBER-*.md. Values that name none were set with those of the same group.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tuning:
    """Factors of errors are parts of the target error unless they say otherwise; a pair bounds from below and above.

    Args:
        blended_guess, affine_guess: step by the error that it leaves, of pictures (0062, 0079).
        blended_error, affine_error: errors that end a search. The published mode is no finer than asked (0079).
        bare_error: the same without pictures, where a quality is sought, so that errors of two encodes compare (0075).
        fine_error: the same for the error of rigid parts (0067).
        large_first: from this error on, the first encode of a large sequence is kept (0065).
        keeps_bare_blend, keeps_blend: errors that a first blend without, and with pictures is kept for (0063).
        second_blend: error that another blend is fitted for (0063).
        most_change: times, of a step at once.
        reuse_within: of log(error): as far from a measured encode its blend serves another quality (0024).
        no_error: below this, an error is none.
        bare_rounds: encodes in one search without pictures (0075).
        least_pictures: part of the bytes that pictures must take for an encode without them to be tried (0075).
        bare_finer: error that a blend alone is to leave at its second attempt (0075).
        nearly: error of that attempt up to which there is a third (0075).
        coarsest_bases: lattice steps of base frames, in target errors (0068).
        large_base: part of the bytes that a base frame must take for the second of them to be tried (0068).
        rebased_by: a coarser base frame has so many times the lattice step at least (0068).
        refits: last fits of a blend: for so many times the step, and for which error; 0: for the step (0063).
        published_error: in lattice steps, what the published mode's base frame leaves at least (0067).
        least_rigid: part of the points that move with one cluster alone, for the error of rigid parts to be tried (0067).
        fine_lattices: lattice steps of base frames for it, in those errors: the smallest mesh is taken (0067).
        fine_worth: bytes may grow by the quotient of the errors to this power (0067).
        hopeless: in those errors: where a blend leaves more at any step, it is not tried (0067).
    """

    blended_guess: float = 3.5
    affine_guess: float = 1.65
    blended_error: tuple[float, float] = (0.9, 0.99)
    affine_error: tuple[float, float] = (1.0, 1.1)
    bare_error: tuple[float, float] = (0.935, 0.955)
    fine_error: tuple[float, float] = (0.96, 1.0)
    large_first: float = 0.81
    keeps_bare_blend: tuple[float, float] = (0.75, 1.4)
    keeps_blend: tuple[float, float] = (0.8, 1.4)
    second_blend: float = 0.9
    most_change: float = 4.0
    reuse_within: float = 0.35
    no_error: float = 1e-9
    bare_rounds: int = 5
    least_pictures: float = 0.02
    bare_finer: float = 0.95
    nearly: float = 1.25
    coarsest_bases: tuple[float, float] = (1.0, 1.3)
    large_base: float = 0.25
    rebased_by: float = 1.2
    refits: tuple[tuple[float, float], ...] = ((1.0, 1.0), (1.0, 1.07), (0.8, 0.0), (1.0, 0.93))
    published_error: float = 0.43
    least_rigid: float = 0.99
    fine_lattices: tuple[float, ...] = (1.05, 1.2, 1.35, 1.5)
    fine_worth: float = 0.3
    hopeless: float = 1.5

    def guess(self, prediction: str) -> float:
        """Step by the error that it leaves, of a prediction."""
        return self.blended_guess if prediction == "blended" else self.affine_guess

    def close_enough(self, prediction: str) -> tuple[float, float]:
        """Errors that end a search, of a prediction."""
        return self.blended_error if prediction == "blended" else self.affine_error


TUNING = Tuning()
