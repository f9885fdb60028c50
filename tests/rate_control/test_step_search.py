"""The step that meets an error: mended, and interpolated between anchors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gvpipe.coding.codec import Encoded
from gvpipe.container.bitstream import Bitstream
from gvpipe.rate_control.step_search import CLOSE_ENOUGH, Anchor, Goal, StepTrial, find_step, step_between

EMPTY = Encoded(Bitstream("none", 1, 1, 1, 0, 30.0), np.arange(1))


def pretend(step: float, exponent: float) -> StepTrial:
    return StepTrial(EMPTY, step, 0.3 * step**exponent)


@pytest.mark.parametrize("exponent", [0.6, 1.0, 1.3])
def test_steps_are_mended_until_the_error_is_close(exponent: float) -> None:
    aimed = find_step(lambda step: pretend(step, exponent), 1.0, Goal(1.0))
    assert CLOSE_ENOUGH[0] <= aimed.error <= CLOSE_ENOUGH[1]


def test_errors_that_do_not_follow_the_step_end_the_loop() -> None:
    tried: list[float] = []

    def attempt(step: float) -> StepTrial:
        tried.append(step)
        return StepTrial(EMPTY, step, 0.0)

    assert find_step(attempt, 1.0, Goal(1e30)).step in tried
    assert len(tried) == 3


@pytest.mark.parametrize("factor", [0.0002, 0.002, 0.02])
def test_errors_that_hardly_follow_the_step_are_met(factor: float) -> None:
    """As of blends, which leave most of the error however fine the step."""
    found = find_step(
        lambda step: StepTrial(EMPTY, step, (0.8**2 + factor * step**2) ** 0.5), 1.0, Goal(1.0, rounds=6, levels_off=True)
    )
    assert CLOSE_ENOUGH[0] <= found.error <= CLOSE_ENOUGH[1]


def test_an_error_that_no_step_leaves_is_not_looked_for() -> None:
    tried: list[float] = []

    def attempt(step: float) -> StepTrial:
        tried.append(step)
        return StepTrial(EMPTY, step, (0.8**2 + 0.01 * step**2) ** 0.5)

    found = find_step(attempt, 1.0, Goal(0.5, rounds=6, levels_off=True))
    assert len(tried) == 3 and found.step == min(tried)
    assert found.rest == pytest.approx(0.8) and find_step(lambda step: pretend(step, 1.0), 1.0, Goal(1.0)).rest == 0


@pytest.mark.parametrize("first", [3.0, 4.0, 6.0, 8.0])
def test_an_error_just_above_the_rest_is_met(first: float) -> None:
    found = find_step(
        lambda step: StepTrial(EMPTY, step, (0.95**2 + 0.01 * step**2) ** 0.5),
        first,
        Goal(1.0, (0.9, 0.99), 0.8, 5, levels_off=True),
    )
    assert found.error <= 0.99


def test_steps_that_round_everything_away_do_not_end_the_search() -> None:
    found = find_step(
        lambda step: StepTrial(EMPTY, step, step / (1 + step**2) ** 0.5), 8.0, Goal(0.3, rounds=5, levels_off=True)
    )
    assert CLOSE_ENOUGH[0] <= found.error / 0.3 <= CLOSE_ENOUGH[1]


@pytest.mark.parametrize("pays", [False, True])
def test_steps_that_save_too_little_are_not_taken(pays: bool) -> None:
    """An error below the one asked for stays, where a larger one would save next to nothing."""

    def attempt(step: float) -> StepTrial:
        return StepTrial(EMPTY, step, (0.8**2 + 0.01 * step**2) ** 0.5)

    found = find_step(
        attempt, 1.0, Goal(0.93, rounds=6, levels_off=True, cost=lambda trial: -trial.step if pays else trial.step)
    )
    assert (
        CLOSE_ENOUGH[0] <= found.error / 0.93 <= CLOSE_ENOUGH[1]
        if pays
        else found.step == 1.0 and found.error < CLOSE_ENOUGH[0] * 0.93
    )
    far = find_step(attempt, 1.0, Goal(1.2, rounds=6, levels_off=True, cost=lambda trial: trial.step))
    assert far.error > 0.9  # the first is too far from what was asked for


def test_the_closest_encode_is_made_again_where_it_is_not_the_last() -> None:
    """Encodes are not kept: two of them take twice the memory."""
    errors, tried = [1.2, 0.5, 2.0], list[float]()

    def attempt(step: float) -> StepTrial:
        tried.append(step)
        return StepTrial(EMPTY, step, errors[len(tried) - 1] if len(tried) <= 3 else 1.2)

    found = find_step(attempt, 1.0, Goal(1.0))
    assert (found.step, found.error) == (1.0, 1.2) and tried[3:] == [1.0]


def test_steps_between_anchors() -> None:
    anchors = [Anchor(2.0, 1.0), Anchor(0.1, 0.1)]
    assert step_between(anchors, 10**-0.5) == pytest.approx(0.2**0.5)
    assert step_between(anchors, 1.5) == pytest.approx(3.0)
    assert step_between(anchors, 0.06) == pytest.approx(0.06)
    assert step_between(anchors, 3.0) is None
    assert step_between([], 1.0) is None


def _leveling(step: float) -> StepTrial:
    """Errors as they are near the step from which on all is rounded to 0, which leaves 0.8."""
    return StepTrial(EMPTY, step, 0.8 if step > 50 else min(0.9 * step, 0.85))


@pytest.mark.parametrize("target", [1.0, 1.5, 4.0, 100.0])
def test_where_zero_is_good_enough_all_targets_have_one_step(target: float) -> None:
    assert find_step(_leveling, target, Goal(target, coarsest=1e6)).step == 1e6


def test_zero_is_not_taken_where_it_leaves_too_much() -> None:
    assert find_step(_leveling, 0.5, Goal(0.5, coarsest=1e6)).error == pytest.approx(0.45)
    assert find_step(lambda step: StepTrial(EMPTY, step, 0.3 if step < 9 else 2.0), 1.0, Goal(1.0, coarsest=1e6)).error == 0.3


def test_an_error_of_no_use_is_not_the_nearest() -> None:
    """Of 0.7 and 1.05, the second is nearer to 0.95; where it is refused, the first is found."""

    def attempt(step: float) -> StepTrial:
        return StepTrial(EMPTY, step, 0.7 if step < 1.5 else 1.05)

    goal = Goal(1.0, (0.94, 0.96))
    assert find_step(attempt, 1.0, goal).error == 1.05
    assert find_step(attempt, 1.0, dataclasses.replace(goal, most=1.0)).error == 0.7
