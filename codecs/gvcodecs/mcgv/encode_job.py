"""One call of an encoder: what all its steps are given."""

from __future__ import annotations

from dataclasses import dataclass

from gvcodecs.mcgv.settings import Settings
from gvpipe.coding.codec import Memo
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence

LARGE = 1_500_000  # vertices of all frames
HEAVY = 1 << 18  # vertices
IDLE_FRAMES = 24  # from which on pictures that change nothing take more bytes than the poster in their place, about


@dataclass(frozen=True)
class Job:
    """What is to be coded, and how.

    Args:
        settings: of the codec.
        sequence: as given.
        memo: what encodes of the same sequence at other qualities share.
        report: hears of stages.
    """

    settings: Settings
    sequence: MeshSequence
    memo: Memo
    report: Progress

    @property
    def is_large(self) -> bool:
        """Whether time counts more than the last percent of bytes: fewer encodes are tried."""
        return self.sequence.n_frames * self.sequence.n_vertices > LARGE

    @property
    def is_heavy(self) -> bool:
        """Whether memory counts more than time: the encode of a frame holds so much."""
        return self.sequence.n_vertices > HEAVY

    @property
    def may_be_without_pictures(self) -> bool:
        """Whether an encode without pictures may come first, and be the only one."""
        return self.settings.may_omit_pictures and self.sequence.n_frames >= IDLE_FRAMES
