"""Which sequences an input of many names, and which file each becomes.

A scene, an archive, a point cache or a simulation is a sequence. Frame files (OBJ, PLY, ...) are one with the others of their
folder and format; those that a list of time steps (.pvd, .series) names are its own. Outputs keep the folders below the part of
a glob that has no wildcard, or below a folder that is given.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from gvpipe.batch.manifest import NAME
from gvpipe.container.sources import check_source, check_target
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.errors import InputError
from gvpipe.io import READERS
from gvpipe.io.formats import FRAME_FORMATS

VIDEO_SUFFIXES = (".mp4", ".m4v")
LISTS = (".pvd", ".series")
LISTED = 3  # files that a message names


@dataclass(frozen=True, order=True)
class Job:
    """A sequence to encode.

    Args:
        output: below the folder of all outputs, with ``/`` between folders.
        source: as `gvpipe.playback.files.read` takes it.
    """

    output: str
    source: str


@dataclass(frozen=True)
class Found:
    """What inputs name.

    Args:
        jobs: sequences, sorted by output.
        left_out: files of no format that is read.
    """

    jobs: list[Job]
    left_out: list[str]


def find_jobs(sources: Sequence[StrPath], folder: StrPath) -> Found:
    """Find the sequences of globs, folders and files.

    Args:
        sources: globs such as ``captures/**/*.glb``, folders, with all below them, or files. Geometry videos count where a
            glob or a name asks for them, those below ``folder`` never.
        folder: of the outputs.

    Raises:
        InputError: nothing is found, or two sequences would become one file.
    """
    check_target(folder)
    own = os.path.realpath(folder)
    jobs: dict[str, Job] = {}
    left_out: list[str] = []
    for given in sources:
        source = os.fspath(check_path(given, "an input"))
        check_source(source)
        n_before = len(jobs) + len(left_out)
        root, files = _list(source)
        covered = _in_lists(files)
        for file in files:
            if os.path.realpath(file) in covered:
                continue
            if file.lower().endswith((*VIDEO_SUFFIXES, NAME)) and os.path.realpath(file).startswith(own + os.sep):
                continue  # an output of another run, or its manifest
            job = _job(root, file)
            if job is None:
                left_out.append(file)
            else:
                _add(jobs, job, own)
        if len(jobs) + len(left_out) == n_before and not files:
            remedy = "give a folder with sequences" if os.path.isdir(source) else "check the path and put it in quotes"
            raise InputError(f"{source}: no file {'is in it' if os.path.isdir(source) else 'matches'}; {remedy}")
    if not jobs:
        raise InputError(f"{', '.join(map(str, sources))}: no sequence among {len(left_out)} files{_names(left_out)}")
    return Found(sorted(jobs.values()), left_out)


def _list(source: str) -> tuple[str, list[str]]:
    """The folder that outputs' names are relative to, and the files."""
    if os.path.isdir(source):
        return _root_of_folder(source), [file for file in _below(source) if not file.lower().endswith(VIDEO_SUFFIXES)]
    if os.path.exists(source):
        return os.path.dirname(source), [source]
    if not glob.has_magic(source):
        raise InputError(f"{source}: no such file or folder; check the path")
    files: set[str] = set()
    for match in glob.iglob(source, recursive=True):
        if os.path.isdir(match):
            if not source.rstrip(os.sep).endswith("**"):
                files.update(file for file in _below(match) if not file.lower().endswith(VIDEO_SUFFIXES))
        else:
            files.add(match)
    return _fixed_part(source), sorted(files)


def _in_lists(files: Sequence[str]) -> set[str]:
    """Files that lists of time steps among them name, which are no sequences of their own; real paths."""
    from gvpipe.io.simulation.step_lists import listed_files

    found: set[str] = set()
    for file in files:
        if file.lower().endswith(LISTS):
            with suppress(InputError):  # which is told when the list is encoded
                found.update(os.path.realpath(each) for each in listed_files(Path(file)))
    return found


def _fixed_part(pattern: str) -> str:
    """The folders of a glob before its first wildcard."""
    parts = Path(pattern).parts
    first = next(number for number, part in enumerate(parts) if glob.has_magic(part))
    return os.path.join("", *parts[:first])


def _root_of_folder(folder: str) -> str:
    """The folder itself; of one that has frame files, which become a file beside the others, the folder above."""
    with os.scandir(folder) as entries:
        has_frames = any(_is_frame(entry.name) and entry.is_file() for entry in entries)
    return os.path.dirname(os.path.normpath(folder)) if has_frames else folder


def _below(folder: str) -> list[str]:
    """Files in a folder and below, hidden ones left out."""
    found = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [os.path.join(place, name) for name in sorted(names) if not name.startswith(".")]
    return found


def _job(root: str, file: str) -> Job | None:
    """The sequence that a file belongs to, None if it is no mesh."""
    suffix = Path(file).suffix.lower()
    relative = os.path.relpath(file, root or ".")
    if _is_frame(file):
        place = os.path.dirname(file) or "."
        name = os.path.dirname(relative) or Path(place).resolve().name
        return Job(f"{Path(name).as_posix()}.mp4", os.path.join(glob.escape(place), f"*{Path(file).suffix}"))
    if suffix in READERS or suffix in VIDEO_SUFFIXES:
        return Job(f"{Path(relative).with_suffix('').as_posix()}.mp4", file)
    return None


def _is_frame(file: str) -> bool:
    """Whether a file is one frame of several, by its name; a glTF file is a sequence of its own."""
    suffix = Path(file).suffix.lower()
    return suffix in FRAME_FORMATS and suffix not in READERS


def _add(jobs: dict[str, Job], job: Job, folder: str) -> None:
    key = os.path.normcase(job.output)
    other = jobs.setdefault(key, job)
    if other.source != job.source and not _is_same(other.source, job.source):
        raise InputError(
            f"{other.source} and {job.source} would both become {os.path.join(folder, job.output)}; "
            "encode them into different folders"
        )


def _is_same(one: str, other: str) -> bool:
    return os.path.abspath(one) == os.path.abspath(other)


def _names(files: Iterable[str]) -> str:
    first = list(files)[:LISTED]
    return f", such as {', '.join(first)}" if first else ""
