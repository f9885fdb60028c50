"""Files of pdct are read without trust, one clip at a time."""

from __future__ import annotations

import numpy as np
import pytest
from clips import decode
from sequences import waving

from gvcodecs.pdct import Pdct
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import CorruptFile, GvpipeError


def test_hostile_clips_raise_package_errors() -> None:
    sequence = waving(8, 12)
    bitstream = Pdct().encode(sequence).bitstream
    clip = bitstream.sections["clip.0"]
    rng = np.random.default_rng(2)
    for _ in range(200):
        changed = bytearray(clip)
        changed[int(rng.integers(len(clip)) ** rng.choice([1.0, 0.7]))] = rng.integers(256)
        sections = {**bitstream.sections, "clip.0": bytes(changed)}
        try:
            decoded = decode(Bitstream("pdct", 2, 12, 64, 98, 24.0, bitstream.header, sections))
        except GvpipeError as caught:
            assert isinstance(caught, CorruptFile)
            continue
        assert np.isfinite(decoded).all()


def test_a_frame_costs_one_clip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sections of other clips are not looked at."""
    bitstream = Pdct(clip=8).encode(waving(6, 20)).bitstream
    wanted: list[str] = []
    plain = Bitstream.section

    def noted(self: Bitstream, name: str) -> bytes:
        wanted.append(name)
        return plain(self, name)

    monkeypatch.setattr(Bitstream, "section", noted)
    assert Pdct.reader(bitstream).read(9, 12).shape == (3, 36, 3)
    assert [name for name in wanted if name.startswith("clip.")] == ["clip.1"]
