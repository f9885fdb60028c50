"""``gvpipe convert``: read and write, without the codec between."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gvpipe.cli.console import (
    Output,
    compress_option,
    output_options,
    real_time_option,
    texture_options,
    unlimited_option,
    volume_option,
    warp_option,
)
from gvpipe.cli.pipes import PIPE, STDIN, STDOUT, VIDEO_SUFFIXES, is_video, shown, source_path, target_path
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.foundation.notes import shape as shape_of

if TYPE_CHECKING:
    from gvpipe.cli.skeletons import SkinOptions
    from gvpipe.io.runs import Run
    from gvpipe.model.clips import Clip
    from gvpipe.model.sequence import MeshSequence


@click.command()
@click.argument("source", metavar="INPUT")
@click.argument("target", metavar="OUTPUT")
@click.option("--fps", type=float, help="Frames per second, instead of the input's; animated glTF is sampled at it.")
@click.option(
    "--clip",
    metavar="NAME|all",
    help="The animation to read, of a file that has several; all: with --skin. [default: the first]",
)
@click.option("--mesh", metavar="FILE", help="The triangles of a point cache (.pc2, .mdd, .npy).")
@click.option("--start", type=int, help="First frame. [default: 0]")
@click.option("--stop", type=int, help="Frame after the last. [default: the end]")
@click.option("--frames", metavar="A:B", help="Only frames A to B - 1; the others are not read. Either may be left out.")
@click.option("--part", "parts", multiple=True, metavar="NAME", help="Write this part only; repeat for more.")
@click.option("--lod", type=int, default=0, show_default=True, help="Level of detail of a geometry video; higher is coarser.")
@click.option(
    "--split",
    is_flag=True,
    help="Write a file for each run of frames with the same triangles: NAME-000.glb, ...",
)
@click.option("--skin", is_flag=True, help="Find a skeleton, and write a .glb or USD file that it moves.")
@click.option(
    "--joints",
    metavar="N|rigid|rigid:N",
    help="About how many, of the skeleton; rigid: bones without shear, in a tree. [default: as many as the error takes]",
)
@click.option(
    "--correctives",
    type=int,
    metavar="N",
    help="Most corrective shapes (morph targets) where joints do not hold the error; 0: none. [default: 64]",
)
@click.option("--target-kg", type=float, help="Largest KG error of the skeleton, percent. [default: 0.14]")
@click.option("--max-error", metavar="LENGTH|PERCENT%", help="Largest distance of any vertex that the skeleton moves.")
@real_time_option
@warp_option
@volume_option
@compress_option
@texture_options
@unlimited_option
@output_options
def convert(
    source: str,
    target: str,
    fps: float | None,
    clip: str | None,
    mesh: str | None,
    start: int | None,
    stop: int | None,
    frames: str | None,
    parts: tuple[str, ...],
    lod: int,
    split: bool,
    skin: bool,
    joints: str | None,
    correctives: int | None,
    target_kg: float | None,
    max_error: str | None,
    real_time: bool,
    warp: str | None,
    volume: bool | None,
    compress: str,
    texture: str | None,
    texture_video: str | None,
    unlimited: bool,
    out: Output,
) -> None:
    """Write a mesh sequence in another format.

    INPUT is what `gvpipe encode` takes; OUTPUT is what `gvpipe decode` takes. No codec is between, so that nothing changes but
    what a format cannot hold, which is said.
    """
    from gvpipe.cli.captures import write_shots
    from gvpipe.cli.choices import chosen, chosen_frames, parse_frames, parse_texture
    from gvpipe.cli.skeletons import (
        ALL,
        SkinOptions,
        check_glb_options,
        clip_names,
        find_skin,
        parse_joints,
        read_clips,
        smaller_with,
        smaller_without,
    )
    from gvpipe.io.writing import HOLD_VOLUMES, is_glb, takes_skin
    from gvpipe.playback import files

    out = out.carrying(target)
    shown_by = parse_texture(texture, texture_video)
    if shown_by is not None and (split or lod or clip == ALL):
        raise click.UsageError("--texture goes with one film: not with --split, --lod and --clip all")
    first, last = chosen_frames(start, stop, frames)
    _check_target(source, target)
    number, is_rigid = parse_joints(joints)
    wanted = SkinOptions(number, target_kg, max_error, is_rigid, correctives)
    check_glb_options(target, skin, compress, wanted)
    if volume is None and Path(target).suffix.lower() not in HOLD_VOLUMES:
        volume = False
    how: dict[str, Any] = {"unlimited": unlimited, "real_time": real_time, "warp": warp, "volume": volume}
    if split:
        if clip == ALL or lod or start is not None or stop is not None or target == PIPE:
            raise click.UsageError(
                "--split goes with --frames, and not with --clip all, --start, --stop, --lod or an OUTPUT of -"
            )
        options = {"fps": fps, "clip": clip, "mesh": mesh, "frames": parse_frames(frames), **how}
        _convert_split(source, target, options, parts, wanted if skin else None, compress, out)
        return
    try:
        with source_path(source) as given, target_path(target, ".npz") as path, out.progress() as progress:
            read = (
                _level_reader(given, lod, unlimited)
                if lod
                else partial(files.read, given, clip=clip, mesh=mesh, texture=shown_by, **how)
            )
            clips: tuple[Clip, ...] = ()
            if clip == ALL and (names := clip_names(given)):
                if not (skin and is_glb(target)) or (first, last) != (0, None) or mesh is not None:
                    raise click.UsageError(
                        "--clip all is for --skin, a .glb and whole clips: without --start, --stop, --frames, --mesh"
                    )
                some, clips = read_clips(names, lambda name, rate: files.read(given, rate, name), fps)
                start, stop = 0, len(some)
            elif frames is not None:
                some = read(fps=fps, frames=(first, last))
                start, stop = first, first + len(some)
            else:
                whole = read(fps=fps)
                start, stop = files.frame_range(whole, first, last)
                some = whole.part(start, stop)
            sequence = chosen(some, parts, None, "convert", progress)
            found, said = find_skin(sequence, path, wanted, progress) if skin else (None, [])
            found = found and replace(found, clips=clips)
            noticed = [*some.notes, *said, *files.write(sequence, path, start, found, compress)]
            noticed += smaller_without(path, sequence, compress) if found and not found.clips else []
            noticed += [] if found else smaller_with(path, sequence, compress)
    except TopologyChange:
        if skin or lod or clip == ALL:
            raise
        from gvpipe.cli.audio_options import NO_SOUND

        with source_path(source) as given, target_path(target, ".npz") as path, out.progress() as progress:
            capture = files.read_capture(given, clip=clip, mesh=mesh, **how).part(first, last)
            asked = {"parts": parts, "compress": compress, "fps": fps}
            write_shots(capture, source, target, path, first, asked, progress, out, (None, NO_SOUND))
        return
    for note in noticed:
        out.note(note)
    values = {"output": shown(target, STDOUT), "frames": stop - start, "start": start, "stop": stop, "fps": sequence.fps}
    values |= {"vertices": sequence.n_vertices, "triangles": len(sequence.faces)}
    if takes_skin(target):
        values |= {"joints": found.joints if found else 0, "correctives": len(found.shapes) if found else 0}
    values |= {"clips": [each.name for each in clips]} if clips else {}
    out.json({**values, "origin": sequence.origin.tolist(), "notes": noticed})
    shape = shape_of(stop - start, sequence.n_vertices)
    out.text(f"{shown(source, STDIN)} -> {shown(target, STDOUT)} ({shape})")


def _convert_split(
    source: str,
    target: str,
    options: dict[str, Any],
    parts: tuple[str, ...],
    wanted: SkinOptions | None,
    compress: str,
    out: Output,
) -> None:
    """Convert each run of frames of one topology, with a skeleton of its own if one is wanted."""
    from gvpipe.captures.splitting import is_list, on_one_clock, write_runs
    from gvpipe.cli.choices import chosen
    from gvpipe.cli.skeletons import find_skin
    from gvpipe.playback import files

    def write(run: Run, path: Path) -> tuple[dict[str, int], list[str]]:
        skin, said = (
            find_skin(run.sequence, str(path), wanted, progress) if wanted and run.sequence.n_frames > 1 else (None, [])
        )
        notes = files.write(run.sequence, path, run.start, skin, compress)
        counts = {"joints": skin.joints if skin else 0, "correctives": len(skin.shapes) if skin else 0}
        return counts if wanted else {}, [*(f"{path.name}: {each}" for each in said), *notes]

    with source_path(source) as given, out.progress() as progress:
        runs = files.read_runs(given, **options)
        ready = [replace(run, sequence=chosen(run.sequence, parts, None, "convert", progress)) for run in runs]
        if is_list(target):
            ready = on_one_clock(ready)
        written = write_runs(ready, target, write)
    every = (note for run, (_, (_, said)) in zip(runs, written, strict=True) for note in (*run.sequence.notes, *said))
    noticed = list(dict.fromkeys(every))
    for note in noticed:
        out.note(note)
    listed = [
        {
            "output": name,
            "start": run.start,
            "stop": run.stop,
            "frames": run.stop - run.start,
            "fps": run.sequence.fps,
            "vertices": run.sequence.n_vertices,
            "triangles": len(run.sequence.faces),
            "origin": run.sequence.origin.tolist(),
        }
        | counts
        for (name, (counts, _)), run in zip(written, ready, strict=True)
    ]
    one = {"list": target} if is_list(target) and len(listed) > 1 else {}
    out.json({"files": listed, **one, "notes": noticed})
    for each in listed:
        shape = shape_of(each["frames"], each["vertices"])
        out.text(f"{shown(source, STDIN)}, frames {each['start']}:{each['stop']} -> {each['output']} ({shape})")
    if one:
        out.text(f"{target} lists the frames of all files")


def _level_reader(source: str, lod: int, unlimited: bool) -> Callable[..., MeshSequence]:
    """What reads frames of a level of detail of a geometry video, at a frame rate."""
    from gvpipe import api
    from gvpipe.playback import files

    if not is_video(source):
        raise InputError(f"{source} has no levels of detail; encode it with --codec pca, whose files have them")
    level = api.open(source, unlimited=unlimited).level(lod)

    def read(fps: float | None, frames: tuple[int, int | None] | None = None) -> MeshSequence:
        own = level if fps is None else level.with_fps(fps)
        return own if frames is None else own.part(*files.frame_range(own, *frames))

    return read


def _check_target(source: str, target: str) -> None:
    """Refuse an output that is a geometry video, or that would replace the input while it is read."""
    from gvpipe.io.frames.pattern import match_pattern

    if Path(target).suffix.lower() in VIDEO_SUFFIXES:
        raise InputError(f"{target} is a geometry video, which convert does not write; use gvpipe encode")
    if os.path.isfile(source):
        if os.path.exists(target) and os.path.samefile(source, target):
            raise InputError(f"{target} is the input too; choose another name")
        return
    is_folder = os.path.isdir(target) or target.endswith(("/", os.sep))
    if source == PIPE or not (is_folder or match_pattern(target)):
        return
    read_from = source if os.path.isdir(source) else os.path.dirname(source) or "."
    written_to = target if is_folder else os.path.dirname(target) or "."
    if os.path.isdir(read_from) and os.path.isdir(written_to) and os.path.samefile(read_from, written_to):
        raise InputError(f"{target} is in the folder of the input, whose frames it may replace; choose another folder")
