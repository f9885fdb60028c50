"""Skeletons for .glb files: of a geometry video, which has one, or of any sequence, for which one is found."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gvpipe.foundation.errors import InputError
from gvpipe.io.writing import takes_skin

if TYPE_CHECKING:
    from gvpipe.foundation.progress import Progress
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin
    from gvpipe.playback.player import Player

EXACT = 1e-5  # of the diagonal: a skeleton that is farther off is written on request alone

Found = tuple["Skin | None", list[str]]  # a skeleton, and what to say of it


def skin_of_video(player: Player, path: str, frames: tuple[int, int], wanted: bool | None, is_whole: bool) -> Found:
    """The skeleton of some frames, if it is to be written.

    Args:
        player: the video.
        path: of the file to write.
        frames: first, and the one after the last.
        wanted: None: if it is exact.
        is_whole: whether all vertices of the mesh itself are written.

    Raises:
        InputError: it is wanted, and there is none.
    """
    if wanted is False or (wanted is None and not (takes_skin(path) and is_whole and frames[1] - frames[0] > 1)):
        return None, []
    if not is_whole:
        raise InputError("--skin is for the whole mesh; leave out --part and --lod")
    skin = player.skin()
    if skin is None:
        if wanted:
            raise InputError(
                f"{player.path}: files of codec {player.bitstream.codec!r} with these settings have no skeleton; use "
                "gvpipe convert --skin, which finds one"
            )
        return None, ["written with morph targets, since the file has no skeleton; gvpipe convert --skin finds one"]
    off = f"{100 * skin.error:.2g} % of the diagonal"
    if wanted is None and not skin.error <= EXACT:
        return None, [f"written with morph targets, since the file's skeleton is up to {off} off (--skin takes it)"]
    how = "exact" if skin.error <= EXACT else f"up to {off} off"
    return skin.part(*frames), [f"written with a skeleton of {_joints(skin)}, {how}; --no-skin writes morph targets"]


def check_skin_options(target: str, is_wanted: bool, is_split: bool = False, others: bool = False) -> None:
    """Raise `click.UsageError` for options of skeletons where none is written."""
    if others and not is_wanted:
        raise click.UsageError("--joints, --target-kg and --max-error are of --skin")
    if is_wanted and (is_split or not takes_skin(target)):
        raise click.UsageError(f"--skin writes one .glb, without --split; OUTPUT is {target!r}")


def find_skin(
    sequence: MeshSequence, joints: int, target_kg: float | None, max_error: str | None, progress: Progress | None
) -> Found:
    """A skeleton for a sequence, and what to say of it; raises as `fit_skin` does."""
    from gvpipe.rate_control.targets import parse_bound
    from gvpipe.skinning.fit import fit_skin

    bound = None if max_error is None else parse_bound(max_error, sequence)
    skin, errors, is_met = fit_skin(sequence, joints, target_kg, bound, progress)
    kg = "" if errors.kg is None else f"KG {errors.kg:.3g} %, "
    off = f"{100 * skin.error:.2g} % of the diagonal" if skin.error >= 0 else f"{errors.max:.2g} units"
    said = [f"a skeleton of {_joints(skin)} moves it: {kg}vertices are up to {off} off"]
    if not is_met:
        said.append("no skeleton that was tried holds the error asked for; allow more, or give more --joints")
    return skin, said


def _joints(skin: Skin) -> str:
    return "one joint" if skin.joints == 1 else f"{skin.joints} joints"
