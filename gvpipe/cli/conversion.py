"""``gvpipe convert``: read and write, without the codec between."""

from __future__ import annotations

import os
from pathlib import Path

import click

from gvpipe.cli.console import Output, output_options, unlimited_option
from gvpipe.cli.pipes import PIPE, STDIN, STDOUT, VIDEO_SUFFIXES, shown, source_path, target_path
from gvpipe.errors import InputError


@click.command()
@click.argument("source", metavar="INPUT")
@click.argument("target", metavar="OUTPUT")
@click.option("--fps", type=float, help="Frames per second, instead of the input's; animated glTF is sampled at it.")
@click.option("--clip", metavar="NAME", help="The animation to read, of a glTF file that has several. [default: the first]")
@click.option("--mesh", metavar="FILE", help="The triangles of a point cache (.pc2, .mdd, .npy).")
@click.option("--start", type=int, default=0, show_default=True, help="First frame.")
@click.option("--stop", type=int, help="Frame after the last. [default: the end]")
@click.option("--part", "parts", multiple=True, metavar="NAME", help="Write this part only; repeat for more.")
@unlimited_option
@output_options
def convert(
    source: str,
    target: str,
    fps: float | None,
    clip: str | None,
    mesh: str | None,
    start: int,
    stop: int | None,
    parts: tuple[str, ...],
    unlimited: bool,
    out: Output,
) -> None:
    """Write a mesh sequence in another format.

    INPUT is what `gvpipe encode` takes; OUTPUT is what `gvpipe decode` takes. No codec is between, so that nothing changes but
    what a format cannot hold, which is said.
    """
    from gvpipe import api
    from gvpipe.cli.choices import chosen

    out = out.carrying(target)
    _check_target(source, target)
    with source_path(source) as given, target_path(target, ".npz") as path, out.progress() as progress:
        whole = api.read(given, fps, clip, mesh, unlimited=unlimited)
        start, stop = api.frame_range(whole, start, stop)
        sequence = chosen(whole.part(start, stop), parts, None, "convert", progress)
        noticed = [*whole.notes, *api.write(sequence, path, start)]
    for note in noticed:
        out.note(note)
    values = {"output": shown(target, STDOUT), "frames": stop - start, "start": start, "stop": stop, "fps": sequence.fps}
    values |= {"vertices": sequence.n_vertices, "triangles": len(sequence.faces)}
    out.json({**values, "origin": sequence.origin.tolist(), "notes": noticed})
    shape = f"{stop - start} frames, {sequence.n_vertices} vertices"
    out.text(f"{shown(source, STDIN)} -> {shown(target, STDOUT)} ({shape})")


def _check_target(source: str, target: str) -> None:
    """Refuse an output that is a geometry video, or that would replace the input while it is read."""
    from gvpipe.io.pattern import match_pattern

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
