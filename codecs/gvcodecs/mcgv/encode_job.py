"""One call of an encoder: what all its steps are given."""

from __future__ import annotations

from dataclasses import dataclass

from gvcodecs.mcgv.settings import Settings
from gvpipe.codec import Memo, Progress
from gvpipe.sequence import MeshSequence


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
