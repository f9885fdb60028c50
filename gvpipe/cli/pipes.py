"""``-`` as a file name: standard input and standard output, by way of a temporary file.

Readers need to seek, and writers must finish before anything is passed on: so a failed command puts nothing into the pipe.
What comes in is told apart by its first bytes.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Iterator

from gvpipe.container.sources import is_remote
from gvpipe.foundation.atomic import output_error, temporary_folder
from gvpipe.foundation.errors import GvpipeError, InputError, OutputError

PIPE = "-"
VIDEO_SUFFIXES = (".mp4", ".m4v")
STDIN, STDOUT = "standard input", "standard output"


@contextlib.contextmanager
def source_path(source: str) -> Iterator[str]:
    """The path of an input; that of a temporary copy of standard input if it is ``-``.

    Raises:
        InputError: standard input is a terminal, or holds no file that can be told by its first bytes.
    """
    if source != PIPE:
        yield source
        return
    if sys.stdin.isatty():
        raise InputError(f"{STDIN} is a terminal; pipe an .npz or a geometry video into it, or give a file's name")
    with temporary_folder() as folder, _renamed(folder, STDIN):
        stream = sys.stdin.buffer
        head = stream.read(8)
        path = os.path.join(folder, STDIN + _suffix(head))
        with _wrapped(path), open(path, "wb") as file:
            file.write(head)
            shutil.copyfileobj(stream, file)
        yield path


@contextlib.contextmanager
def target_path(target: str, suffix: str) -> Iterator[str]:
    """The path of an output; that of a temporary file, passed to standard output in the end, if it is ``-``.

    Raises:
        OutputError: standard output is a terminal.
    """
    if target != PIPE:
        yield target
        return
    if sys.stdout.isatty():
        raise OutputError(f"{STDOUT} is a terminal, which shows no {suffix} file; pipe it on, or give a file's name")
    with temporary_folder() as folder, _renamed(folder, STDOUT):
        path = os.path.join(folder, STDOUT + suffix)
        yield path
        with _wrapped(STDOUT), open(path, "rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.buffer.flush()


def shown(name: str, pipe: str) -> str:
    """A file's name as results print it."""
    return pipe if name == PIPE else name


def is_video(path: str) -> bool:
    """Whether a path is that of an MP4 file, by its name or its first bytes, or an address; it need not be there."""
    if is_remote(path):
        return True
    if path.lower().endswith(VIDEO_SUFFIXES) or not os.path.isfile(path):
        return path.lower().endswith(VIDEO_SUFFIXES)
    try:
        with open(path, "rb") as file:
            return file.read(8)[4:8] == b"ftyp"
    except OSError:
        return False  # whoever reads it says why it cannot be read


def _suffix(head: bytes) -> str:
    """By the first bytes: an archive, a video."""
    if head.startswith(b"PK"):
        return ".npz"
    if head[4:8] == b"ftyp":
        return ".mp4"
    raise InputError(f"{STDIN} is {'no .npz and no geometry video' if head else 'empty'}; pipe one of those into it")


@contextlib.contextmanager
def _wrapped(path: str) -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:  # the reader of standard output left
        raise
    except OSError as exc:
        raise output_error(path, exc) from exc


@contextlib.contextmanager
def _renamed(folder: str, name: str) -> Iterator[None]:
    """Let messages name the stream in place of the temporary file."""
    try:
        yield
    except GvpipeError as exc:
        text = str(exc)
        for suffix in (".npz", ".mp4"):
            text = text.replace(os.path.join(folder, name + suffix), name)
        raise type(exc)(text) from exc
