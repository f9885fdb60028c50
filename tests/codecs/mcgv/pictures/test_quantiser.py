"""The step of pictures follows the quality, and the range of residuals."""

from __future__ import annotations

import numpy as np
import pytest

from gvcodecs.mcgv.pictures.quantiser import LEVELS, OUTLIERS, QP_STEP, Magnitudes, choose_quantiser
from gvpipe.media.video import PROFILES


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("largest", [1e-9, 1e-3, 0.05, 0.5, 20.0])
def test_quality_is_monotone(name: str, largest: float) -> None:
    """The step that a coefficient sees is the one asked for; levels are finer; nearly all residuals fit."""
    profile = PROFILES[name]
    usual = 2.7 if name == "h264-10" else 2.1  # decades to 100 by the slope up to 75
    magnitudes = Magnitudes()
    magnitudes.add(largest * np.linspace(-1, 1, 30_001) ** 9)
    effective = []
    for quality in np.linspace(0, 100, 201):
        wanted = 2.0 * 0.08 * 10 ** -np.interp(quality, [0, 75, 100], [0, 0.75 * usual, 2.7])
        chosen = choose_quantiser(wanted, profile, magnitudes)
        reach = chosen.step * profile.amplitude * (1 + 1e-9)
        assert isinstance(chosen.level, int)
        levels = wanted / chosen.step
        if name == "jpeg":
            assert 1 <= chosen.level <= 255 and levels >= LEVELS[0] * (1 - 1e-9)
            step = float(chosen.level)
        else:
            assert 1 <= chosen.level <= (63 if profile.depth == 10 else 51)
            step = QP_STEP * 2 ** (chosen.level / 6)
            assert levels >= LEVELS[0] * 2 ** (-1 / 6)  # quantisers come in sixths of an octave
        if largest > reach:
            assert levels <= LEVELS[1] * (1 + 1e-9)
            assert levels <= LEVELS[0] * (1 + 1e-9) or magnitudes.common <= reach
        effective.append(chosen.step * step)
        assert effective[-1] == pytest.approx(wanted, rel=1e-9)
    assert np.all(np.diff(effective) <= np.array(effective[1:]) * 1e-9)


def test_magnitudes_are_those_of_the_sorted_coordinates() -> None:
    """Within a bin, an eighth of an octave; however they come, zeros and subnormal numbers too."""
    rng = np.random.default_rng(2)
    for scale in (1e-310, 1.0, 1e300):
        values = scale * rng.standard_t(2, (40, 50, 3))
        magnitudes = Magnitudes()
        for part in np.split(values, [1, 17]):
            magnitudes.add(part)
        wanted = np.quantile(np.abs(values), 1 - OUTLIERS)
        assert magnitudes.largest == np.abs(values).max()
        assert wanted * 0.999 <= magnitudes.common <= wanted * 1.2 or scale < 1e-307
    still = Magnitudes()
    still.add(np.zeros((2, 3, 3)))
    assert still.largest == still.common == 0.0 == Magnitudes().common
