"""``--split``: several files for an input whose topology changes, all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError, OutputError

if TYPE_CHECKING:
    from gvpipe.io.runs import Run

Result = TypeVar("Result")


def write_runs(runs: Sequence[Run], target: str, write: Callable[[Run, Path], Result]) -> list[tuple[str, Result]]:
    """Write each run to a file; return the files' names and what ``write`` returned.

    Beside several .pvd, one of the output's own name lists the frames of all of them.

    Args:
        runs: of the input.
        target: name of the output; `run_names` says what becomes of it. A pattern of frame files stays as it is, since frames
            are numbered as in the input.
        write: writes a run to a path.

    Raises:
        InputError, OutputError: a run cannot be written, or two runs need files of one name; nothing is left.
    """
    from gvpipe.io.frames.pattern import match_pattern

    folder, name = (Path(target), "%04d.obj") if target.endswith("/") else (Path(target).parent, Path(target).name)
    names = [name] * len(runs) if match_pattern(name) else run_names(name, len(runs))
    results = []
    with atomic_files(folder) as temporary:
        for number, (run, own) in enumerate(zip(runs, names, strict=True)):
            apart = temporary / f"run{number}"
            apart.mkdir()
            try:
                results.append((str(folder / own), write(run, apart / own)))
            except (InputError, OutputError) as exc:
                raise type(exc)(str(exc).replace(str(apart), str(folder))) from exc
            _join(apart, temporary, folder)
        if is_list(name) and name not in names:
            from gvpipe.io.simulation.pvd_writer import join_lists

            join_lists([temporary / own for own in names], temporary / name)
    return results


def with_sounds(runs: Sequence[Run], sound: dict[str, Any], frames: tuple[int, int | None] | None) -> list[Run]:
    """Give each run its part of a sound; ``sound`` and ``frames`` are keywords of `gvpipe.encode`."""
    from gvpipe.playback.sounds import AudioOptions, sound_beside

    options = AudioOptions(sound["audio"], sound["audio_codec"], sound["audio_bitrate"])
    whole, _ = sound_beside(None, 0.0, options)
    if options.audio is None and not sound["audio_trim"]:
        return list(runs)
    given = []
    for run in runs:
        fps = run.sequence.fps
        own = run.sequence.sound if options.audio is None else whole and whole.part(run.start / fps, run.stop / fps)
        trimmed = own and sound["audio_trim"] and own.part(0, len(run.sequence) / fps)
        given.append(replace(run, sequence=run.sequence.with_sound(trimmed or own)))
    return given


def is_list(target: str) -> bool:
    """Whether an output is a list of files with times."""
    return Path(target).suffix.lower() == ".pvd"


def on_one_clock(runs: Sequence[Run]) -> list[Run]:
    """Runs whose times follow each other: those of an input without times are numbers of frames, by the rate."""
    edges = [(float(run.sequence.times[0]), float(run.sequence.times[-1])) for run in runs]
    if all(before[1] < behind[0] for before, behind in pairwise(edges)):
        return list(runs)
    made = []
    for run in runs:
        start = run.start / run.sequence.fps
        metadata = replace(run.sequence.metadata, start_time=start, times=())
        made.append(replace(run, sequence=replace(run.sequence, metadata=metadata)))
    return made


def run_names(name: str, count: int) -> list[str]:
    """Names of files, one for each run.

    Examples:
        >>> run_names("walk.mp4", 2), run_names("walk.mp4", 1)
        (['walk-000.mp4', 'walk-001.mp4'], ['walk.mp4'])
    """
    plain = Path(name)
    digits = max(3, len(str(count - 1)))
    return [name] if count == 1 else [f"{plain.stem}-{number:0{digits}d}{plain.suffix}" for number in range(count)]


def _join(apart: Path, into: Path, shown: Path) -> None:
    """Move files; those of one name, such as the materials of OBJ frames, must be equal."""
    for path in sorted(path for path in apart.rglob("*") if path.is_file()):
        name = path.relative_to(apart)
        made = into / name
        if made.exists() and made.read_bytes() != path.read_bytes():
            raise InputError(f"{shown / name} would hold other materials in each run; convert the runs apart by --frames")
        made.parent.mkdir(parents=True, exist_ok=True)
        path.replace(made)
    for emptied in sorted((path for path in (apart, *apart.rglob("*")) if path.is_dir()), reverse=True):
        emptied.rmdir()
