"""A capture to its file: its surface followed where that is wanted, and each shot coded as a sequence is."""

from __future__ import annotations

import dataclasses
import os
import time
from dataclasses import dataclass

from gvpipe.asset_coding.options import AssetOptions
from gvpipe.asset_coding.sound_track import pack_sound, whole_sound
from gvpipe.captures import tracking
from gvpipe.captures.encoding import CodedShot, write_capture
from gvpipe.coding.codec import Codec
from gvpipe.coding.segment_memory import fit_segments
from gvpipe.container.bitstream import BARE, STREAM
from gvpipe.container.mp4 import file_bytes, read_bytes
from gvpipe.encoding.report import Report, StageClock
from gvpipe.encoding.request import NO_TARGETS, TARGETS, Request, knows_settings, shot_target
from gvpipe.encoding.sequence import code_sequence, coding_notes
from gvpipe.foundation import notes
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.errors import SettingError
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.sounds import AudioOptions, sound_beside
from gvpipe.rate_control.targets import parse_bound

CAPTURE_CODEC = "pca"  # of shots, which are short: `mcgv` looks for motion that they do not have


@dataclass(frozen=True)
class CaptureRequest:
    """What was asked for of a capture: `encode`'s arguments."""

    request: Request
    beside: AssetOptions
    sounds: AudioOptions
    frames: tuple[int, int | None] | None
    memory: int | None
    layout: str
    track: bool | None
    vertices: int | None


def encode_capture(capture: Capture, wanted: CaptureRequest, path: StrPath, clock: StageClock) -> Report:
    """Encode each shot as a sequence."""
    from gvpipe.asset_coding.encoder import AssetCoder

    request, memory = wanted.request, wanted.memory
    if wanted.layout == BARE:
        raise SettingError(f"{capture.name}: vertices or triangles change; bare files keep them: leave out bare (--bare)")
    diagonal = frame_diagonal(capture.shots[0])
    n_given, change = len(capture.shots), capture.lengths[0]
    tracked = _tracked(capture, wanted, diagonal, clock)
    capture = tracked.capture
    given = request.candidates(CAPTURE_CODEC if knows_settings(CAPTURE_CODEC, request.settings) else None)
    is_free = request.codec is None and request.purpose is None and "reorder" not in request.settings

    def code(number: int, shot: MeshSequence, progress: Progress) -> CodedShot:
        fitting = given if memory is None else fit_segments(given, shot.n_vertices, memory)
        is_followed = tracked.keys[number] is not None
        if is_free and (len(shot) == 1 or is_followed) and isinstance(fitting, Codec):  # nobody knows its vertices
            fitting = dataclasses.replace(fitting, reorder=True)
        targets = tracking.coding_targets(request.targets, is_followed) if tracked.is_any else request.targets
        is_default = targets == NO_TARGETS and tracked.is_any and "quality" not in request.settings
        target = shot_target(shot, (tracking.CODED_RMSE, None, None, None) if is_default else targets, diagonal)
        if target is not None and is_default and is_followed and diagonal > 0:
            target = dataclasses.replace(target, largest=tracking.coded_largest(tracked.largest[number]) * diagonal)
        asset = AssetCoder(shot.with_sound(None), wanted.beside)
        coded = code_sequence(shot, fitting, target, asset, True, progress)
        x, y, z = shot.origin.tolist()
        bitstream = dataclasses.replace(coded.encoded.bitstream, origin=(x, y, z), is_bare=True)
        if coded.check is not None:
            coded.check(read_bytes(file_bytes(bitstream), os.fspath(path)))
        left_out = [*sorted(asset.plan.left_out), *shot.not_carried]
        return CodedShot(bitstream, coded.codec, coding_notes(shot, target, asset.plan), left_out)

    sound, heard = sound_beside(capture.sound, len(capture) / capture.fps, wanted.sounds, capture.fps, wanted.frames)
    sound, damaged = whole_sound(sound)
    companions = () if sound is None else (pack_sound(sound),)
    found = write_capture(capture, path, code, clock, wanted.layout == STREAM, companions)
    clock("", 1.0)
    first, size = found.coded[0], found.written.size
    many = [] if n_given < 2 else [notes.shots(capture.name, n_given, len(capture.shots), change), *tracked.notes]
    return Report(
        codec=first.codec.id,
        settings=dataclasses.asdict(first.codec),
        vertices=max(row["vertices"] for row in found.shots),
        triangles=max(row["triangles"] for row in found.shots),
        frames=len(capture),
        fps=capture.fps,
        bytes=size,
        bpvf=8 * size / found.n_samples,
        seconds={"encode": time.perf_counter() - clock.started, **clock.seconds},
        not_carried=found.not_carried,
        sections={**found.written.sections, "container": size - sum(found.written.sections.values())},
        tried=[],
        reason="",
        notes=[*many, *heard, *damaged, *found.notes],
        shots=[{**row, "key": key} for row, key in zip(found.shots, tracked.keys, strict=True)],
        audio=None if sound is None else sound.to_json(),
    )


def _tracked(capture: Capture, wanted: CaptureRequest, diagonal: float, clock: StageClock) -> tracking.Tracked:
    """The capture as it came, or with its surface followed."""
    if wanted.track is False or (wanted.track is None and not tracking.is_tracked_by_default(capture)):
        return tracking.Tracked(capture, (None,) * len(capture.shots), (0.0,) * len(capture.shots), ())
    bound = wanted.request.targets[TARGETS.index("max_error")]
    part = None if bound is None or not diagonal else parse_bound(bound, capture.shots[0]) / diagonal
    return tracking.track(capture, part, wanted.vertices, clock)
