"""One sequence to its file: the codec and the quality that meet what was asked for, and what should be known of the result."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from gvpipe.asset_coding.directory import SECTION as ASSET_SECTION
from gvpipe.asset_coding.moving_textures import alpha_notes
from gvpipe.coding.codec import Codec, Encoded
from gvpipe.coding.registry import codec_class, encode_sequence, segment_parts
from gvpipe.container.bitstream import BARE, STREAM, Bitstream
from gvpipe.container.mp4 import write_file
from gvpipe.foundation import notes
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import OverBudget
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import Errors, frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.player import Player
from gvpipe.rate_control.codec_choice import choose_codec, default_target
from gvpipe.rate_control.search import meet
from gvpipe.rate_control.targets import Target
from gvpipe.rate_control.trials import Trial
from gvpipe.rendering.poster import poster_of

if TYPE_CHECKING:
    from gvpipe.asset_coding.encoder import AssetCoder, Plan

COSTLY_VERTEX = 400  # bytes of memory, with its triangles: less than any codec takes
COSTLY_ATTRIBUTES = 4000  # bytes of memory, of a vertex with attributes of 40 components in all


@dataclass(frozen=True)
class Coded:
    """The bitstream to write, its codec, how to check its file, what was tried for it and why, and its errors if measured."""

    codec: Codec
    encoded: Encoded
    check: Callable[[Bitstream], None] | None = None
    tried: Sequence[Trial] = ()
    reason: str = ""
    errors: Errors | None = None


def code_sequence(
    sequence: MeshSequence,
    given: Codec | Sequence[Codec],
    target: Target | None,
    asset: AssetCoder,
    is_bare: bool,
    progress: Progress,
) -> Coded:
    """Encode, at the quality that meets the target, with the codec that does so in the smallest file."""
    if isinstance(given, Codec):
        if target is None:
            encoded = encode_sequence(given, sequence, progress)
            progress("asset", 0.0)
            return Coded(given, dataclasses.replace(encoded, bitstream=asset.add(encoded, given)))
        choice = meet(target, given, sequence, progress, asset=asset, is_bare=is_bare)
    else:
        choice = choose_codec(given, sequence, target or default_target(given), progress, asset, is_bare)
    trial = choice.trial
    check = partial(choice.trials.check, trial.encoded.permutation)
    encoded = dataclasses.replace(trial.encoded, bitstream=asset.add(trial.encoded, trial.codec))
    return Coded(trial.codec, encoded, check, choice.tried, choice.reason, trial.errors)


def write_coded(sequence: MeshSequence, coded: Coded, path: StrPath, progress: Progress, layout: str) -> tuple[int, Bitstream]:
    """Write the file with its poster, unless it is bare, and origin; return its bytes and what it holds."""
    progress("write", 0.0)
    bitstream = coded.encoded.bitstream
    if not bitstream.video and layout != BARE:
        bitstream = dataclasses.replace(bitstream, video=poster_of(sequence))
    x, y, z = sequence.origin.tolist()
    bitstream = dataclasses.replace(bitstream, origin=(x, y, z), is_bare=layout == BARE)
    return write_file(bitstream, path, coded.check, segment_parts(bitstream) if layout == STREAM else None), bitstream


def coding_notes(sequence: MeshSequence, target: Target | None, plan: Plan) -> list[str]:
    """What a user should know, a line each."""
    diagonal = frame_diagonal(sequence)
    loose = notes.loose_bound(target.value, diagonal) if target and target.measure == "max" else ()
    rounded = notes.rounded(sequence.rounding, diagonal)
    said = [*loose, *rounded, *notes.whole_numbers(plan.whole), *notes.not_carried(sorted(plan.left_out))]
    return [*sequence.notes, *said, *alpha_notes(plan.images)]


def refusal_notes(path: StrPath, bitstream: Bitstream, size: int) -> list[str]:
    """A note if the file that was written is refused without ``unlimited``; looked at where vertices are many for its size."""
    budget, n_vertices = Budget(size), bitstream.n_vertices
    costly = COSTLY_ATTRIBUTES if ASSET_SECTION in bitstream.sections else COSTLY_VERTEX
    slow = codec_class(bitstream.codec).seconds_per_vertex
    if costly * n_vertices < budget.memory and slow * n_vertices < budget.seconds:
        return []
    try:
        with Player(path) as video:
            _ = video[0], [*video.attributes.values()], [field[0:1] for field in video.fields.values()]
    except OverBudget as exc:
        return [notes.over_budget(exc.asked)]
    return []
