"""A voice of tones: a short tune, with a click at each second, so that eyes and ears see whether sound and frames are in step.

Whole numbers alone, so that every machine makes the same bytes.
"""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np
import numpy.typing as npt

RATE = 8000  # samples per second
SECONDS = 3.5
TUNE = (392, 440, 523, 587, 523, 440, 392)  # Hz, half a second each
CLICK = 8  # samples
LOUD = 30_000  # of 32,767
TURN = 1 << 16  # steps of a whole wave
ATTACK = 200  # samples


def make_voice() -> npt.NDArray[np.int16]:
    """Return the samples."""
    samples = np.zeros(int(RATE * SECONDS), np.int64)
    length = RATE // 2
    for number, pitch in enumerate(TUNE):
        at = np.arange(length)
        loudness = np.minimum(at, ATTACK) * (length - at)  # rises fast, falls slowly
        tone = 3 * _wave(at * (pitch * TURN // RATE)) + _wave(at * (2 * pitch * TURN // RATE))
        samples[number * length : (number + 1) * length] = tone * loudness // (ATTACK * length) // 8
    for second in range(int(SECONDS) + 1):
        samples[second * RATE : second * RATE + CLICK] = LOUD
    return samples.astype(np.int16)


def write_voice(path: Path) -> None:
    """Write the samples as a WAV file."""
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(make_voice().astype("<i2").tobytes())


def _wave(phase: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """A wave like a sine, of parabolas, -32768..32767."""
    x: npt.NDArray[np.int64] = phase % TURN - TURN // 2
    result: npt.NDArray[np.int64] = x * (TURN // 2 - np.abs(x)) * 4 // (TURN // 2)
    return result
