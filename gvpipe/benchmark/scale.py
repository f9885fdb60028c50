"""How time and memory grow with vertices and with frames, from commands in processes of their own.

A torus of waves (`gvpipe.benchmark.torus`) is written as .npz, encoded, and decoded to .npz: for each number of vertices in a
few frames, and for each number of frames of a small mesh. A command before all others, on a small torus, compiles.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import gvpipe
from gvpipe.benchmark.own_process import measure_command
from gvpipe.benchmark.scale_report import ScalePoint, ScaleReport
from gvpipe.benchmark.sweep import describe_machine, settings_of
from gvpipe.benchmark.torus import make_torus
from gvpipe.container.segments import count_longest
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.progress import Progress
from gvpipe.playback import files
from gvpipe.playback.video_info import info

CODECS = ("mcgv", "mcgv:prediction=affine", "pca", "laplacian", "pdct")
VERTICES = (1_000, 10_000, 100_000, 1_000_000)  # each in FEW_FRAMES
FRAMES = (10, 100, 1_000, 10_000)  # each of FEW_VERTICES
FEW_VERTICES, FEW_FRAMES = 1_000, 16
WARM = (400, 4)  # vertices, frames

Size = tuple[int, int]


def run(
    codecs: Sequence[str] = CODECS,
    vertices: Sequence[int] = VERTICES,
    frames: Sequence[int] = FRAMES,
    limit: float | None = None,
    progress: Progress | None = None,
) -> ScaleReport:
    """Measure every codec on every size.

    Args:
        codecs: ids; one with settings of its own is ``id:key=value:key=value``.
        vertices: numbers of vertices.
        frames: numbers of frames.
        limit: seconds; what takes longer is ended, and larger sizes of that row are left out. None: no limit.
        progress: called before each command with its name and the part of the commands that is done.

    Raises:
        InputError: a codec, a setting or a size cannot be used, or a command failed.
    """
    for codec in codecs:  # before hours of work, not after
        settings_of(codec, [75], {})
    rows = [[(each, FEW_FRAMES) for each in sorted(vertices)], [(FEW_VERTICES, each) for each in sorted(frames)]]
    points = []
    n_all, n_done = len(codecs) * sum(map(len, rows)), 0
    with temporary_folder() as place:
        folder = Path(place)
        sources = {size: _write(folder, size) for size in (WARM, *rows[0], *rows[1])}
        for codec in codecs:
            _measure(codec, WARM, sources[WARM], None)
            for row in rows:
                for size in row:
                    if progress:
                        progress(f"{codec} {size[0]} x {size[1]}", n_done / n_all)
                    points.append(_measure(codec, size, sources[size], limit))
                    n_done += 1
                    if points[-1].decode_s is None:
                        break
    return ScaleReport(gvpipe.__version__, describe_machine(), ["gvpipe", *sys.argv[1:]], points)


def _write(folder: Path, size: Size) -> Path:
    path = folder / f"torus-{size[0]}x{size[1]}.npz"
    if not path.exists():
        files.write(make_torus(*size), path)
    return path


def _measure(codec: str, size: Size, source: Path, limit: float | None) -> ScalePoint:
    """Encode and decode by commands; what takes longer than ``limit`` leaves the rest of the point unknown."""
    video, decoded = source.with_suffix(".mp4"), source.with_name("decoded.npz")
    name, *pairs = codec.split(":")
    settings = [word for pair in pairs for word in ("--set", pair)]
    point = ScalePoint(codec, files.read(source).n_vertices, size[1])
    encoded = measure_command(["encode", str(source), str(video), "--codec", name, *settings, "--quiet"], limit)
    if encoded is None:
        return point
    header = info(video).settings
    point = replace(
        point,
        bytes=video.stat().st_size,
        segment_frames=count_longest(size[1], header.get("segments") or header.get("clips") or 1),
        encode_s=encoded.seconds,
        encode_cpu_s=encoded.cpu_seconds,
        encode_peak_mb=encoded.peak_mb,
    )
    cost = measure_command(["decode", str(video), str(decoded), "--quiet", "--unlimited"], limit)
    decoded.unlink(missing_ok=True)
    if cost is None:
        return point
    return replace(point, decode_s=cost.seconds, decode_cpu_s=cost.cpu_seconds, decode_peak_mb=cost.peak_mb)
