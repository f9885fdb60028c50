"""Rate and distortion over a sweep of qualities, with times, memory, and every round trip verified.

Each sequence and codec has a process of its own, so that its peak memory is its own. A few frames are encoded first, so that no
time holds imports or compilation. A point is a whole file. It is encoded, decoded, and compared with its source; some frames
are read at random and compared with the whole.
"""

from __future__ import annotations

import dataclasses
import os
import platform
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from gvpipe import api
from gvpipe.benchmark.memory import peak_mb
from gvpipe.benchmark.report import BenchReport, Curve
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.foundation.atomic import output_error, temporary_folder
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.comparison import compare
from gvpipe.playback import files
from gvpipe.rate_control.purposes import VARIANTS
from gvpipe.tasks.executor import Work, WorkerDied
from gvpipe.tasks.processes import Processes

QUALITIES = (0.0, 20.0, 40.0, 60.0, 75.0, 90.0, 100.0)
MEASURED = {
    "mcgv": ({"prediction": "affine"},)
}  # as published: not the default, and too large for `gvpipe.rate_control.codec_choice`
WARM_FRAMES = 3
FRAMES_AT_RANDOM = 16
MEASURES = ("rmse", "rmse_diag", "max", "max_diag", "kg", "da", "sted", "hausdorff")


def default_codecs() -> list[str]:
    """What is measured unless codecs are named: all, with the settings that compete, and as published."""
    found = []
    for name in codec_ids():
        for own in (*VARIANTS.get(name, ({},)), *MEASURED.get(name, ())):
            found.append(":".join([name, *(f"{key}={value}" for key, value in own.items())]))
    return found


def run(
    sources: Sequence[str],
    codecs: Sequence[str],
    qualities: Sequence[float] = QUALITIES,
    texts: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> BenchReport:
    """Measure every codec on every sequence.

    Args:
        sources: what `gvpipe.read` takes.
        codecs: ids; one with settings of its own is ``id:key=value:key=value``, and is told apart by that text.
        qualities: of every curve.
        texts: settings for all codecs, as on the command line.
        progress: called before each curve with its name and the part of all that is done.

    Raises:
        InputError: a sequence or a setting cannot be used; a round trip does not give back what went in.
    """
    texts = dict(texts or {})
    for codec in codecs:  # before hours of work, not after
        settings_of(codec, qualities, texts)
    curves: list[Curve] = []
    for source in sources:
        for codec in codecs:
            if progress:
                progress(f"{name_of(source)} {codec}", len(curves) / (len(sources) * len(codecs)))
            curves.append(_in_own_process(source, codec, list(qualities), texts))
    return report_of(curves)


def report_of(curves: list[Curve]) -> BenchReport:
    """Curves that this process measured, with its version, machine and command line."""
    return BenchReport(gvpipe.__version__, describe_machine(), ["gvpipe", *sys.argv[1:]], curves)


def measure_curve(source: str, codec: str, qualities: list[float], texts: dict[str, str]) -> Curve:
    """Measure one codec on one sequence, in this process."""
    sequence = files.read(source)
    settings = settings_of(codec, sorted(qualities), texts)
    points = []
    with temporary_folder() as folder:
        warm = Path(folder) / "warm.mp4"
        api.encode(sequence.part(0, min(WARM_FRAMES, sequence.n_frames)), warm, settings[0])
        api.decode(warm, unlimited=True)
        paths = [Path(folder) / f"{i}.mp4" for i in range(len(settings))]
        for chosen, path in zip(settings, paths, strict=True):
            points.append(_time(sequence, chosen, path))
        peak = peak_mb()  # before the comparison, which has memory of its own
        for point, path in zip(points, paths, strict=True):
            point.update(_verify(sequence, path))
    rest = {key: value for key, value in dataclasses.asdict(settings[0]).items() if key != "quality"}
    shape = (sequence.n_vertices, len(sequence.faces), sequence.n_frames)
    return Curve(name_of(source), *shape, codec, rest, peak, points)


def describe_machine() -> dict[str, Any]:
    """What times depend on."""
    model = ""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:  # not Linux
        model = platform.processor()
    return {"cpu": model, "cpus": os.cpu_count(), "system": platform.system(), "python": platform.python_version()}


def name_of(source: str) -> str:
    """A sequence's name in tables: its file's, without folder and extension."""
    return Path(source).stem or source


def settings_of(codec: str, qualities: Sequence[float], texts: Mapping[str, str]) -> list[Any]:
    """A codec's settings at each quality; raises `InputError` for what it does not have."""
    name, *pairs = codec.split(":")
    if any("=" not in pair for pair in pairs):
        raise InputError(f"codec {codec!r}: ID or ID:KEY=VALUE is needed, such as mcgv:prediction=affine")
    own = dict(pair.split("=", 1) for pair in pairs)
    return [codec_class(name).from_texts({**texts, **own, "quality": str(quality)}) for quality in qualities]


def _in_own_process(source: str, codec: str, qualities: list[float], texts: dict[str, str]) -> Curve:
    with Processes(1, attempts=1) as processes:
        (outcome,) = processes.run(_measuring, b"", [(source, codec, qualities, texts)])
    if isinstance(outcome.error, WorkerDied):
        raise InputError(
            f"measuring {codec} on {source} ended early, as when memory runs out ({outcome.error}); measure fewer frames"
        ) from outcome.error
    if isinstance(outcome.error, OSError):
        raise output_error(tempfile.gettempdir(), outcome.error) from outcome.error
    if outcome.error is not None:
        raise outcome.error
    curve: Curve = outcome.value
    return curve


def _measuring(data: bytes) -> Work:
    """What a process does with a task."""
    return lambda task: measure_curve(*task)


def _time(sequence: gvpipe.MeshSequence, codec: Any, path: Path) -> dict[str, Any]:
    made = api.encode(sequence, path, codec)
    started = time.perf_counter()
    api.decode(path, unlimited=True)  # it was just written here
    seconds = time.perf_counter() - started
    return {
        "quality": codec.quality,
        "bytes": made.bytes,
        "bpvf": made.bpvf,
        "encode_s": made.seconds["encode"],
        "decode_s": seconds,
        "decode_fps": sequence.n_frames / seconds,
        "sections": made.sections,
    }


def _verify(sequence: gvpipe.MeshSequence, path: Path) -> dict[str, Any]:
    """Measures of the decoded file, and the milliseconds of a frame at random; raises `GvpipeError` if reading disagrees."""
    decoded = api.decode(path, unlimited=True)
    video = api.open(path, unlimited=True)
    picked = np.random.default_rng(0).integers(0, sequence.n_frames, FRAMES_AT_RANDOM).tolist()
    seconds = []
    for frame in picked:
        started = time.perf_counter()
        positions = video[frame]
        seconds.append(time.perf_counter() - started)
        if not np.array_equal(positions, decoded.read(frame, frame + 1)[0]):
            raise GvpipeError(f"{sequence.name}: frame {frame} alone is not what decoding the whole gives; please report it")
    values = compare(sequence, decoded, surface=False).to_json()  # raises unless vertices and triangles are the same
    return {**{key: values[key] for key in MEASURES}, "frame_ms": 1000 * float(np.median(seconds))}
