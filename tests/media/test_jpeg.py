"""JPEG planes: the error bound that the quantiser sets, exact repetition, and data that are not ours."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gvpipe.foundation.errors import CorruptFile
from gvpipe.media.jpeg import END_OF_IMAGE, decode_jpeg, encode_jpeg

SIZES = [(8, 8), (16, 48), (50, 34), (1, 1), (7, 129)]
STEPS = [255, 100, 40, 16, 8, 4, 2, 1]


def planes(shape: tuple[int, int]) -> dict[str, NDArray[np.uint8]]:
    """Noise, a slope, a chequered board of extremes, and constants."""
    y, x = np.indices(shape)
    random = np.random.default_rng(5)
    made = {f"constant {level}": np.full(shape, level) for level in (0, 16, 128, 235, 255)}
    made |= {"noise": random.integers(0, 256, shape), "slope": 2 * x + 3 * y, "board": 255 * ((x + y) % 2)}
    return {name: np.clip(plane, 0, 255).astype(np.uint8) for name, plane in made.items()}


def segments(data: bytes) -> dict[int, bytes]:
    """Marker segments up to the scan."""
    found, position = {}, 2
    while 0xDA not in found:
        length = int.from_bytes(data[position + 2 : position + 4], "big")
        found[data[position + 1]] = data[position + 4 : position + 2 + length]
        position += 2 + length
    return found


@pytest.mark.parametrize("step", STEPS)
def test_round_trip_within_the_quantiser(step: int) -> None:
    """Baseline, one component, a table of equal steps; no block's error exceeds half a step per coefficient.

    The transform is orthonormal, so in each 8x8 block |error| <= |steps| / 2; one level per sample more is left for
    rounding at both ends of integer transforms.
    """
    bound = 8 * step / 2 + 8
    for shape in SIZES:
        for name, plane in planes(shape).items():
            data = encode_jpeg(plane, step)
            found = segments(data)
            assert 0xC0 in found and found[0xC0][5] == 1 and len(found[0xDB]) == 65, name
            assert set(found[0xDB][1:]) == {step}
            back = decode_jpeg(data, *shape)
            assert back.dtype == np.uint8 and back.shape == shape and encode_jpeg(plane, step) == data
            error = np.zeros([-(-side // 8) * 8 for side in shape])
            error[: shape[0], : shape[1]] = back.astype(float) - plane
            blocks = error.reshape(error.shape[0] // 8, 8, -1, 8).swapaxes(1, 2)
            assert np.sqrt((blocks**2).sum(axis=(2, 3))).max() <= bound, (name, shape)
            if name.startswith("constant"):  # the mean alone is coded, of which a step is an eighth
                assert np.abs(error).max() <= step / 16 + 1, (name, shape)


def test_monotone_in_step() -> None:
    """Bytes never fall and error never rises as the step falls, on a smooth plane with a little noise."""
    y, x = np.indices((96, 96))
    plane = (128 + 60 * np.sin(x / 9) * np.cos(y / 7) + np.random.default_rng(1).normal(0, 3, x.shape)).astype(np.uint8)
    coded = [encode_jpeg(plane, step) for step in STEPS]
    errors = [float(((decode_jpeg(data, 96, 96).astype(float) - plane) ** 2).mean()) for data in coded]
    assert np.all(np.diff([len(data) for data in coded]) > 0) and np.all(np.diff(errors) < 0) and errors[-1] < 0.2


def test_hostile_data() -> None:
    """Nothing, garbage, another size, colour, another format, and every truncation: CorruptFile and nothing else."""
    plane = planes((24, 40))["noise"]
    data = encode_jpeg(plane, 8)
    colour = cv2.imencode(".jpg", np.dstack([plane] * 3))[1].tobytes()
    png = cv2.imencode(".png", plane.astype(np.uint16) * 256)[1].tobytes()
    for bad in (b"", b"\0", bytes(500), b"\xff\xd8\xff\xd9", data[2:], colour, png, *(data[:n] for n in range(len(data)))):
        with pytest.raises(CorruptFile, match="JPEG"):
            decode_jpeg(bad, 24, 40)
    for height, width in ((40, 24), (24, 41), (23, 40), (0, 0), (24, 40 * 3)):
        with pytest.raises(CorruptFile, match="40"):
            decode_jpeg(data, height, width)
    random = np.random.default_rng(3)
    for _ in range(300):
        damaged = bytearray(data)
        damaged[int(random.integers(len(data)))] ^= int(random.integers(1, 256))
        try:
            back = decode_jpeg(bytes(damaged), 24, 40)
        except CorruptFile:
            continue
        assert back.shape == (24, 40) and back.dtype == np.uint8


def test_other_formats_and_colours_are_refused_before_they_are_decoded() -> None:
    plane = np.zeros((24, 40), np.uint8)
    for kind in (".bmp", ".png", ".tiff"):
        data = cv2.imencode(kind, plane)[1].tobytes() + END_OF_IMAGE
        with pytest.raises(CorruptFile, match="no JPEG"):
            decode_jpeg(data, 24, 40)
    progressive = cv2.imencode(".jpg", plane, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1].tobytes()
    with pytest.raises(CorruptFile, match="no JPEG"):
        decode_jpeg(progressive, 24, 40)
    with pytest.raises(CorruptFile, match="3 components"):
        decode_jpeg(cv2.imencode(".jpg", np.zeros((24, 40, 3), np.uint8))[1].tobytes(), 24, 40)
