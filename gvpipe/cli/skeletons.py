"""Skeletons for .glb files: of a geometry video, which has one, or of any sequence, for which one is found."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import click

from gvpipe.foundation.errors import InputError, OverBudget
from gvpipe.io.clips import list_clips
from gvpipe.io.writing import is_glb, takes_skin
from gvpipe.model.clips import Clip, join_clips
from gvpipe.skinning.fit import ONE_FRAME

if TYPE_CHECKING:
    from gvpipe.foundation.progress import Progress
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin
    from gvpipe.playback.player import Player

MAY_BE_SMALLER = 0.25  # of the largest size that targets may have: many vertices may stand still
HEAVY = 1 << 20  # bytes of morph targets
RIGID = "rigid"  # of --joints
ALL = "all"  # clips, of --clip
EXACT = 1e-5  # of the diagonal: a skeleton that is farther off is written on request alone

Found = tuple["Skin | None", list[str]]  # a skeleton, and what to say of it


class SkinOptions(NamedTuple):
    """What a skeleton should be like: ``--joints``, ``--target-kg``, ``--max-error`` and ``--correctives``."""

    joints: int = 0
    target_kg: float | None = None
    max_error: str | None = None
    is_rigid: bool = False
    correctives: int | None = None  # None: as many as usual


def parse_joints(text: str | None) -> tuple[int, bool]:
    """How many joints, 0 for any number, and whether they are rigid, of ``N``, ``rigid`` or ``rigid:N``.

    Raises `click.UsageError`.

    Examples:
        >>> parse_joints("64"), parse_joints("rigid"), parse_joints("rigid:24"), parse_joints(None)
        ((64, False), (0, True), (24, True), (0, False))
    """
    if text is None or text == RIGID:
        return 0, text == RIGID
    number = text.removeprefix(f"{RIGID}:")
    if number.isascii() and number.removeprefix("-").isdigit():
        return int(number), number != text
    raise click.UsageError(f"--joints is {text!r}; a number, rigid or rigid:NUMBER is needed")


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
    if wanted is False or (wanted is None and not (is_glb(path) and is_whole and frames[1] - frames[0] > 1)):
        return None, []
    if not is_whole:
        raise InputError("--skin is for the whole mesh; leave out --part and --lod")
    if frames[1] - frames[0] < 2:
        raise InputError(f"{player.path}: {ONE_FRAME}")
    try:
        skin = player.skin(*frames)
    except OverBudget as exc:
        if wanted:
            raise
        return None, [f"written with morph targets, since the skeleton is too large: {exc}"]
    if skin is None:
        if wanted:
            raise InputError(
                f"{player.path}: files of codec {player.bitstream.codec!r} with these settings have no skeleton; use "
                "gvpipe convert --skin, which finds one"
            )
        return None, ["written with morph targets, since the file has no skeleton; gvpipe convert --skin finds one"]
    off = f"{100 * skin.error:.2g} % of the diagonal" if skin.error >= 0 else "an unknown part of the diagonal"
    if wanted is None and not skin.error <= EXACT:
        return None, [f"written with morph targets, since the file's skeleton is up to {off} off (--skin takes it)"]
    how = "exact" if skin.error <= EXACT else f"up to {off} off"
    if not is_glb(path):
        return skin, [
            f"written with a skeleton of {_joints(skin)}, {how} but for USD's half-float scales; --no-skin writes points"
        ]
    return skin, [f"written with a skeleton of {_joints(skin)}, {how}; --no-skin writes morph targets"]


def check_glb_options(target: str, is_wanted: bool, compress: str, wanted: SkinOptions | None = None) -> None:
    """Raise `click.UsageError` for options of skeletons and of compression where there is none."""
    if compress != "none" and not is_glb(target):
        raise click.UsageError(f"--compress is for a .glb; OUTPUT is {target!r}")
    if wanted and wanted != SkinOptions() and not is_wanted:
        raise click.UsageError("--joints, --target-kg, --max-error and --correctives are of --skin")
    if is_wanted and not takes_skin(target):
        raise click.UsageError(f"--skin writes a .glb or USD file; OUTPUT is {target!r}")


def find_skin(sequence: MeshSequence, path: str, wanted: SkinOptions, progress: Progress | None) -> Found:
    """A skeleton for a sequence to be written to a path, and what to say of it; raises as `fit_skin` does."""
    from gvpipe.rate_control.targets import parse_bound
    from gvpipe.skinning.fit import SHAPES, fit_skin

    bound = None if wanted.max_error is None else parse_bound(wanted.max_error, sequence)
    most = SHAPES if wanted.correctives is None else wanted.correctives
    skin, errors, is_met = fit_skin(sequence, wanted.joints, wanted.target_kg, bound, progress, wanted.is_rigid, most)
    kg = "" if errors.kg is None else f"KG {errors.kg:.3g} %, "
    off = f"{100 * skin.error:.2g} % of the diagonal" if skin.error >= 0 else f"{errors.max:.2g} units"
    kind = "rigid " if wanted.is_rigid else ""
    said = [f"a {kind}skeleton of {_joints(skin)}{_shapes(skin)} moves it: {kg}vertices are up to {off} off"]
    if not is_glb(path):
        said.append("USD has scales as half floats, so that vertices may be up to 0.02 % of the diagonal farther off")
    if not is_met:
        said.append("no skeleton that was tried holds the error asked for; allow more, or give more --joints or --correctives")
    return skin, said


def clip_names(path: str) -> list[str]:
    """The clips of a file, each once; none where ``all`` is the name of one, or the file has none."""
    names = list(dict.fromkeys(each.name for each in list_clips(path)))
    return [] if ALL in names else names


def read_clips(
    names: list[str], read: Callable[[str, float | None], MeshSequence], fps: float | None
) -> tuple[MeshSequence, tuple[Clip, ...]]:
    """The clips of some names as one sequence, at a frame rate, or at the highest of theirs; raises as `join_clips` does."""
    found = [read(name, fps) for name in names]
    rate = max(each.fps for each in found)
    if any(each.fps != rate for each in found):
        found = [read(name, rate) for name in names]
    sequence, clips = join_clips(list(zip(names, found, strict=True)))
    notes = tuple(note for note in sequence.notes if not note.startswith("clip "))  # that others were not read
    return replace(sequence, notes=notes), clips


def smaller_with(path: str, sequence: MeshSequence, compress: str) -> list[str]:
    """A note where a file of morph targets is large: which options make a lighter one; nothing is tried."""
    size = os.path.getsize(path) if is_glb(path) and sequence.n_frames > 1 else 0
    if size < HEAVY:
        return []
    more = "--compress meshopt" if compress == "none" else ""
    named = " and ".join(each for each in ("--skin (within --target-kg)", more) if each)
    return [f"a morph target for each frame makes {size} bytes; lighter with {named}"]


def smaller_without(path: str, sequence: MeshSequence, compress: str) -> list[str]:
    """A note where a file with a skeleton takes more bytes than one with morph targets; it is written where it may."""
    from gvpipe.foundation.atomic import temporary_folder
    from gvpipe.playback.files import write

    size = os.path.getsize(path)
    if not is_glb(path) or MAY_BE_SMALLER * 12 * sequence.n_vertices * (sequence.n_frames - 1) > size:
        return []
    with temporary_folder() as folder:
        write(sequence, os.path.join(folder, "morph.glb"), compress=compress)
        other = os.path.getsize(os.path.join(folder, "morph.glb"))
    return [f"with morph targets it would have {other} bytes, not {size}; leave out --skin for these"] if other < size else []


def _joints(skin: Skin) -> str:
    return "one joint" if skin.joints == 1 else f"{skin.joints} joints"


def _shapes(skin: Skin) -> str:
    count = len(skin.shapes)
    return f" and {'one corrective shape' if count == 1 else f'{count} corrective shapes'}" if count else ""
