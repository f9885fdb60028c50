"""Quality means one error for every codec: the same scale, over all frames and vertices of a sequence."""

from __future__ import annotations

import pytest
from folders import DATA
from sequences import held, patched, waving

import gvpipe
from gvpipe.coding.quality_scale import error_of, quality_of
from gvpipe.coding.registry import codec_class, codec_ids, encode_sequence, open_reader
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.step_search import root_mean_square

QUALITIES = (50, 75, 90)
SMALL = "dembones_bone", "fox_run", "kaykit_spin", "morph_wave", "walking_cat"  # docs/rate-control.md has the others
NAMES = [name for name in SMALL if (DATA / f"{name}.npz").exists()]
MADE = {
    "waving": waving(24, 24),
    "partly still": patched(20, 16),
    "held": held(waving(20, 12), [1, 3, 1, 1, 2, 1, 1, 1, 1, 4, 1, 1]),
    "seams": patched(20, 16, still=-1.0),
}


def part_of_the_error(sequence: MeshSequence, codec: str, quality: float) -> float:
    """The Karni-Gotsman error of an encode, in that of its quality."""
    bitstream = encode_sequence(codec_class(codec)(quality=quality, reorder=False), sequence).bitstream
    return 100 * root_mean_square(sequence, open_reader(bitstream)) / measure_spread(sequence) / error_of(quality)


@pytest.mark.parametrize("quality", [pytest.param(50, marks=pytest.mark.slow), 75, pytest.param(90, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("codec", codec_ids())
def test_made_sequences_have_the_error_of_their_quality(codec: str, name: str, quality: float) -> None:
    assert 0.8 <= part_of_the_error(MADE[name], codec, quality) <= 1.2


@pytest.mark.slow
@pytest.mark.skipif(not NAMES, reason="no ../shared/data")
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("codec", codec_ids())
def test_real_sequences_have_the_error_of_their_quality(codec: str, name: str) -> None:
    sequence = gvpipe.read(DATA / f"{name}.npz")
    parts = {quality: part_of_the_error(sequence, codec, quality) for quality in QUALITIES}
    if (codec, name) == ("mcgv", "morph_wave"):  # at quality 90 each point moves with one cluster: a finer error costs little
        assert 0.65 <= parts.pop(90) < 0.8
    assert all(0.8 <= part <= 1.2 for part in parts.values()), parts


def test_the_scale() -> None:
    for quality, error in {25: 3.5, 50: 0.7, 75: 0.14, 90: 0.0436, 100: 0.02}.items():
        assert error_of(quality) == pytest.approx(error, rel=2e-3)
        assert quality_of(error_of(quality)) == pytest.approx(quality)
