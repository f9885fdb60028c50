"""What `decode` and `convert` do with a capture, whose vertices and triangles change: its shots, in one file or several."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gvpipe.cli.audio_options import write_beside
from gvpipe.cli.pipes import STDIN, STDOUT, shown

if TYPE_CHECKING:
    from gvpipe.cli.console import Output
    from gvpipe.foundation.progress import Progress
    from gvpipe.model.capture import Capture


def write_shots(
    capture: Capture,
    source: str,
    target: str,
    path: str,
    start: int,
    options: dict[str, Any],
    progress: Progress | None,
    out: Output,
    sound: tuple[str | None, str | None],
) -> None:
    """Write a capture, and print what was done.

    Args:
        capture: the frames to write.
        source, target: as the user named them.
        path: to write to.
        start: the number of its first frame in the source.
        options: ``parts``, ``compress``, ``fps``, and what others ask for, by name; what is not empty cannot be done.
        progress: called with what is done.
        out: where results are printed.
        sound: where its sound goes, and what ``--audio-out`` says.

    Raises:
        click.UsageError: an option that is for sequences alone.
    """
    from gvpipe.captures.writing import write_capture_files
    from gvpipe.cli.choices import chosen
    from gvpipe.foundation.notes import count
    from gvpipe.model.capture import Capture, LazyShots

    parts, compress, fps = (options.pop(name) for name in ("parts", "compress", "fps"))
    asked = [name for name, value in options.items() if value]
    if asked:
        given_options = ", ".join(f"--{name}" for name in asked)
        what = f"{shown(source, STDIN)} is a capture of {len(capture.shots)} shots"
        raise click.UsageError(f"{given_options}: {what}; choose one by --frames")
    shots = LazyShots(len(capture.shots), lambda number: chosen(capture.shots[number], parts, fps, "write", progress))
    given = Capture(shots, capture.name, capture.lengths, capture.fps if fps is None else fps)
    names, noticed = write_capture_files(given, path, start, compress)
    heard, said = write_beside(capture.sound, *sound)
    noticed += said
    for note in noticed:
        out.note(note)
    shown_names = [shown(target, STDOUT)] if names == [path] else names
    rows = [
        {"start": start + begin, "frames": length, "vertices": shot.n_vertices, "triangles": len(shot.faces)}
        for begin, length, shot in zip(capture.starts, capture.lengths, capture.shots, strict=True)
    ]
    out.json(
        {
            "output": shown_names[0] if len(names) == 1 else shown(target, STDOUT),
            "outputs": shown_names,
            "frames": len(capture),
            "start": start,
            "stop": start + len(capture),
            "fps": given.fps,
            "vertices": max(row["vertices"] for row in rows),
            "triangles": max(row["triangles"] for row in rows),
            "shots": rows,
            "notes": noticed,
        }
        | ({"audio": {"output": sound[0], **heard.to_json()}} if heard else {})
    )
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    shape = f"{count(len(capture), 'frame')} in {count(len(capture.shots), 'shot')}"
    out.text(f"{shown(source, STDIN)} -> {shown_names[0]}{more} ({shape})")
