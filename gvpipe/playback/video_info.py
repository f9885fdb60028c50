"""What a geometry video is and where its bytes go.

The file says most of it itself (`gvpipe.container.outline`). What decodes meshes is loaded for files that do not: those of the
bare layout, and those made before files had it.
"""

from __future__ import annotations

import dataclasses
import os
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from gvpipe.asset.metadata import losses_of
from gvpipe.asset_coding.directory import read_directory
from gvpipe.asset_coding.listing import list_asset
from gvpipe.container.bitstream import SHOTS, Bitstream
from gvpipe.container.mp4 import bytes_by_part, read_file
from gvpipe.container.outline import Outline
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.errors import SeveralShots, in_file


@dataclass(frozen=True)
class Info:
    """What a geometry video is.

    Args:
        bounding_box: frame 0's corners, model units, relative to ``origin``.
        bpvf: bits per vertex and frame of the whole file.
        sections: bytes of every part of the file, which add up to ``bytes``.
        levels: vertex counts of the levels of detail, the mesh itself first.
        settings: the bitstream's header.
        layout: ``plain``, ``stream`` (`restream`), ``bare``, ``live``: still written, or left unfinished
            (`gvpipe.playback.live`), or ``shots``: a capture.
        origin: to add to positions, model units.
        parts: name, ranges of vertices and triangles, name of the material, parent.
        attributes: name, kind, domain, components, type, unit, bound (degrees for normals) and bytes of each.
        fields: the same, with range.
        polygons: how many faces have each number of corners.
        materials: names.
        images: name, media type, width, height and bytes.
        metadata: up axis, unit, start time, source, texts.
        volume: of what lies inside of the surface: cells, inner points, the bound on these, names of numbers, bytes; or None.
        audio: codec, channels, rate, seconds, start (seconds after frame 0) and bytes of the sound; or None.
        not_carried: what the source had beside what the file carries.
        notes: what a user should know, a line each.
        shots: of a capture: ``start``, ``frames``, ``vertices``, ``triangles``, ``codec`` and ``bytes`` of each. Then
            ``vertices`` and ``triangles`` are those of the largest, ``sections`` the sums, and the rest is that of the first.
    """

    codec: str
    version: int
    vertices: int
    triangles: int
    frames: int
    fps: float
    bounding_box: dict[str, list[float]]
    bytes: int
    bpvf: float
    sections: dict[str, int]
    levels: list[int]
    settings: dict[str, Any]
    layout: str
    origin: list[float]
    parts: list[dict[str, Any]]
    attributes: list[dict[str, Any]]
    fields: list[dict[str, Any]]
    polygons: dict[str, int]
    materials: list[str]
    images: list[dict[str, Any]]
    metadata: dict[str, Any]
    volume: dict[str, Any] | None
    audio: dict[str, Any] | None
    not_carried: list[str]
    notes: list[str]
    shots: list[dict[str, Any]] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """The information as JSON values."""
        return dataclasses.asdict(self)


def info(path: StrPath, *, unlimited: bool = False) -> Info:
    """Return what a geometry video is and where its bytes go; ``unlimited`` as for `gvpipe.open`.

    Raises:
        InputError: no such file.
        FormatError: not a geometry video, or a damaged one.
    """
    try:
        bitstream = read_file(check_path(path, "the geometry video"), unlimited)
    except SeveralShots:
        return _capture_info(path, unlimited)
    return _info(bitstream, bitstream.outline or _decode(path, unlimited), os.fspath(path))


def _capture_info(path: StrPath, unlimited: bool) -> Info:
    from gvpipe.playback.capture_player import CapturePlayer

    with CapturePlayer(path, unlimited=unlimited) as video:
        first = _info(video.shot(0).bitstream, video.shot(0).outline(), video.shot(0).path)
        rows, sections, said, left_out = list[dict[str, Any]](), Counter[str](), list[str](), list[str]()
        for shot, start, n_bytes in zip(video.shots, video.starts, video.shot_bytes, strict=True):
            bitstream = shot.bitstream
            counts = {"frames": bitstream.n_frames, "vertices": bitstream.n_vertices, "triangles": bitstream.n_triangles}
            rows.append({"start": start, **counts, "codec": bitstream.codec, "bytes": n_bytes})
            sections.update({**bytes_by_part(bitstream, bitstream.n_bytes), "container": 0})
            said += shot.notes
            left_out += losses_of(shot.directory.metadata)
        size, sound = video.n_bytes, video.sound
        for companion in () if video.index is None else video.index.companions:
            sections[companion.kind] += companion.n_bytes
    n_samples = sum(row["vertices"] * row["frames"] for row in rows)
    return dataclasses.replace(
        first,
        layout=SHOTS,
        audio=None if sound is None else sound.to_json(),
        vertices=max(row["vertices"] for row in rows),
        triangles=max(row["triangles"] for row in rows),
        frames=sum(row["frames"] for row in rows),
        bytes=size,
        bpvf=8 * size / n_samples,
        sections={**+sections, "container": size - sections.total()},
        notes=list(dict.fromkeys(said)),
        not_carried=list(dict.fromkeys(left_out)),
        shots=rows,
    )


def _info(bitstream: Bitstream, outline: Outline, name: str) -> Info:
    size = bitstream.n_bytes
    with in_file(name):
        return Info(
            codec=bitstream.codec,
            version=bitstream.version,
            layout=bitstream.layout,
            vertices=bitstream.n_vertices,
            triangles=bitstream.n_triangles,
            frames=bitstream.n_frames,
            fps=bitstream.fps,
            bounding_box={"min": list(outline.box[:3]), "max": list(outline.box[3:])},
            bytes=size,
            bpvf=8 * size / (bitstream.n_vertices * bitstream.n_frames),
            sections=bytes_by_part(bitstream, size),
            levels=[bitstream.n_vertices, *outline.levels],
            settings=dict(bitstream.header),
            origin=list(bitstream.origin),
            **list_asset(read_directory(bitstream), outline, bitstream),
        )


def _decode(path: StrPath, unlimited: bool) -> Outline:
    from gvpipe.playback.player import Player

    with Player(path, unlimited=unlimited) as player:
        return player.outline()
