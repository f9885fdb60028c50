"""Another program as a row of the bench: it is given mesh files, its output is counted, decoded by it again, and compared.

A program has two commands. In both, ``{input}`` and ``{output}`` stand for paths:

1. Encoding: ``{input}`` is a folder of frames, ``frame_00000.obj`` and so on; whatever appears at ``{output}``, or beside it
   under a longer name (``{output}.drc``), is counted.
2. Decoding: ``{input}`` is the path that encoding had as ``{output}``; at ``{output}`` the program puts a folder of frames in
   the order of their names, or (``{output}.npz``) a file that `gvpipe.read` takes.

``{quality}``, if a command has it, is each quality of the sweep. Vertices and triangles must come back in order: errors are
those between vertices. No shell is between: `shlex.split` makes words of a command.
"""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.benchmark.report import Curve
from gvpipe.benchmark.sweep import MEASURES, name_of
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.foundation.isolation.python import TimeoutExpired, run_program
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback import files

FORMATS = ("obj", "ply")
PLACES = ("{input}", "{output}")
QUALITY = "{quality}"
LIMIT = 3600.0


@dataclass(frozen=True)
class External:
    """A program to measure.

    Args:
        encode, decode: its commands, with ``{input}`` and ``{output}``.
        form: of the frames it is given: ``obj`` or ``ply``.
        limit: seconds that each command may take.
        name: in tables; ``""``: its command's first word.

    Raises:
        InputError: a command lacks ``{input}`` or ``{output}``, or cannot be split into words.
    """

    encode: str
    decode: str
    form: str = "obj"
    limit: float = LIMIT
    name: str = ""

    def __post_init__(self) -> None:
        for command in (self.encode, self.decode):
            missing = [place for place in PLACES if place not in command]
            if missing:
                raise InputError(
                    f"external command {command!r} has no {missing[0]}; write it where the program takes that path"
                )
            _split(command)

    @property
    def title(self) -> str:
        """The name in tables."""
        return self.name or Path(_split(self.encode)[0]).name

    def measure(self, source: str, qualities: Sequence[float]) -> Curve:
        """Encode, decode and compare a sequence at each quality, or once if no command has ``{quality}``.

        Raises:
            InputError: a command cannot be started, takes too long, fails, or leaves nothing or no such sequence.
        """
        sequence = files.read(source)
        wanted: Sequence[float | None] = sorted(qualities) if QUALITY in self.encode + self.decode else [None]
        with temporary_folder() as folder:
            given = Path(folder, "given")
            given.mkdir()
            files.write(sequence, str(given / f"frame_%05d.{self.form}"))
            points = []
            for i, quality in enumerate(wanted):
                own = Path(folder, str(i))
                own.mkdir()
                points.append(self._measure(sequence, given, own, quality))
        shape = (sequence.n_vertices, len(sequence.faces), sequence.n_frames)
        settings = {"encode": self.encode, "decode": self.decode, "form": self.form}
        return Curve(name_of(source), *shape, self.title, settings, None, points)

    def _measure(self, sequence: MeshSequence, given: Path, folder: Path, quality: float | None) -> dict[str, Any]:
        encoded, decoded = folder / "encoded", folder / "decoded"
        encoded.mkdir()
        decoded.mkdir()
        encode_s = self._run(self.encode, given, encoded / "out", quality)
        size = sum(path.stat().st_size for path in encoded.rglob("*") if path.is_file())
        if not size:
            raise InputError(f"external command {self.encode!r} left nothing at {{output}}; check where it writes")
        decode_s = self._run(self.decode, encoded / "out", decoded / "out", quality)
        found = sorted(decoded.iterdir())
        if len(found) != 1:
            what = "nothing" if not found else f"{len(found)} files beside each other"
            raise InputError(f"external command {self.decode!r} left {what} at {{output}}; a folder of frames is needed there")
        values = _compare(sequence, found[0], self.decode)
        return {
            "quality": quality,
            "bytes": size,
            "bpvf": 8 * size / (sequence.n_vertices * sequence.n_frames),
            "encode_s": encode_s,
            "decode_s": decode_s,
            "decode_fps": sequence.n_frames / decode_s,
            "sections": {},
            **values,
        }

    def _run(self, command: str, given: Path, output: Path, quality: float | None) -> float:
        """Run a command in its output's folder; return its seconds."""
        put = {"{input}": str(given), "{output}": str(output), QUALITY: "" if quality is None else f"{quality:g}"}
        words = []
        for word in _split(command):
            for place, text in put.items():
                word = word.replace(place, text)
            words.append(word)
        started = time.perf_counter()
        try:
            done = run_program(words, output.parent.parent, self.limit)
        except TimeoutExpired as exc:
            raise InputError(
                f"external command {command!r} took more than {self.limit:g} seconds and was ended; "
                "give it longer (--external-limit) or fewer frames"
            ) from exc
        except OSError as exc:
            raise InputError(f"external command {command!r} cannot be started: {exc.strerror or exc}; check its name") from exc
        if done.status:
            raise InputError(f"external command {command!r} failed with status {done.status}: {done.last_line}")
        return time.perf_counter() - started


def _split(command: str) -> list[str]:
    try:
        words = shlex.split(command, posix=os.name != "nt")
    except ValueError as exc:
        raise InputError(f"external command {command!r} cannot be split into words: {exc}") from exc
    return words


def _compare(sequence: MeshSequence, path: Path, command: str) -> dict[str, Any]:
    """Measures of what a program decoded; raises `InputError` where it is no such sequence."""
    try:
        decoded = files.read(str(path))
    except GvpipeError as exc:
        raise InputError(f"external command {command!r} left what cannot be read: {exc}") from exc
    ours, theirs = ((one.n_frames, one.n_vertices, len(one.faces)) for one in (sequence, decoded))
    if ours != theirs:
        counts = " against ".join("{} frames, {} vertices, {} triangles".format(*counts) for counts in (theirs, ours))
        raise InputError(
            f"external command {command!r} gave back another mesh: {counts}; a lossy program keeps the mesh's order"
        )
    if not np.array_equal(decoded.faces, sequence.faces):
        raise InputError(
            f"external command {command!r} gave back other triangles; to be compared, vertices and triangles keep their order"
        )
    values = compare(sequence, decoded, surface=False).to_json()
    return {key: values[key] for key in MEASURES}
