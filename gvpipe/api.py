"""The functions of the package, from ``gvpipe.encode`` to ``gvpipe.render``, which the command line calls too."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gvpipe.asset_coding.moving_textures import MovingCoding
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.asset_coding.sound_track import KIND as SOUND_KIND
from gvpipe.asset_coding.sound_track import pack_sound
from gvpipe.asset_coding.sound_track import read_sound as read_sound_track
from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import check_mapped, segment_parts
from gvpipe.coding.segment_memory import fit_segments
from gvpipe.container.bitstream import BARE, LIVE, PLAIN, SHOTS, STREAM, Bitstream
from gvpipe.container.mp4 import bytes_by_part, load, read_file, write_file
from gvpipe.container.shots import copy_shots
from gvpipe.container.sources import check_target, check_video_target
from gvpipe.encoding.capture import CaptureRequest, encode_capture
from gvpipe.encoding.inputs import is_among, may_share, open_with_inside, segments_coded_by
from gvpipe.encoding.report import Report, StageClock
from gvpipe.encoding.request import LAYOUTS, TARGETS, Request, check_wanted, chosen_codecs, one_target
from gvpipe.encoding.sequence import code_sequence, coding_notes, refusal_notes, write_coded
from gvpipe.foundation.arguments import StrPath, check_number, check_path, show
from gvpipe.foundation.cores import count_cores
from gvpipe.foundation.errors import InputError, SeveralShots, TopologyChange, in_file
from gvpipe.foundation.progress import Progress
from gvpipe.media.sound import Sound
from gvpipe.model.capture import Capture, some_frames
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin
from gvpipe.playback.capture_player import CapturePlayer
from gvpipe.playback.files import Source, add_texture, add_texture_to_shots, frame_range, read, read_capture
from gvpipe.playback.player import Player
from gvpipe.playback.sounds import AudioOptions, sound_beside, with_sound
from gvpipe.rate_control.targets import parse_bound, read_bound
from gvpipe.rendering.poster import poster_of
from gvpipe.runtime import first_kernels
from gvpipe.tasks.choice import AUTO_WORKERS, open_executor

if TYPE_CHECKING:
    from gvpipe.metrics.comparison import Comparison
    from gvpipe.rasterizer.camera import Camera


@dataclass(frozen=True)
class Restreamed:
    """What `restream` did.

    Args:
        layout: of the file that it wrote: ``plain``, ``stream``, or ``shots`` of a capture.
        bytes_before, bytes: of the source and of the file.
        notes: what a user should know, a line each.
    """

    layout: str
    bytes_before: int
    bytes: int
    notes: list[str] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return dataclasses.asdict(self)


def encode(
    source: MeshSequence | Capture | Source,
    path: StrPath,
    codec: str | Codec | Sequence[Codec] | None = None,
    progress: Progress | None = None,
    fps: float | None = None,
    *,
    target_rmse: float | None = None,
    target_kg: float | None = None,
    target_bpvf: float | None = None,
    max_error: float | str | None = None,
    purpose: str | None = None,
    attributes: Mapping[str, float | str] | None = None,
    fields: Mapping[str, float | str] | None = None,
    textures: int | str | None = None,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    stream: bool = False,
    bare: bool = False,
    unlimited: bool = False,
    memory: int | None = None,
    workers: int | str | None = None,
    scheduler: str | None = None,
    real_time: bool = False,
    warp: str | None = None,
    volume: bool | None = None,
    texture: StrPath | None = None,
    texture_quality: float | None = None,
    texture_codec: str | None = None,
    track: bool | None = None,
    vertices: int | None = None,
    audio: StrPath | Sound | bool | None = None,
    audio_codec: str | None = None,
    audio_bitrate: int | None = None,
    audio_trim: bool = False,
    **settings: Any,
) -> Report:
    """Encode a sequence into a geometry video.

    At most one target may be given. Then the quality is searched; see `gvpipe.rate_control.search`.

    Where vertices or triangles change, the file is a capture: each run of frames that keeps them is a shot, coded as a sequence
    is (`gvpipe.open_capture` reads it). Targets then hold in each shot; parts of the diagonal are of the capture's first frame.

    Args:
        source: a sequence, a capture, or what `read` takes.
        path: the ``.mp4`` to write; an older file is replaced once the new one is complete.
        codec: its id, with ``settings`` by name, or its settings object. Several, or ``"auto"`` for all that serve the purpose
            with settings that all have: the one with the smallest file that meets the target, by default the KG error of their
            quality (`gvpipe.coding.quality_scale`). None: ``"auto"`` if a purpose is given, else ``"mcgv"``, and ``"pca"``
            for captures, whose shots are short.
        progress: called with a stage's name and the part of it that is done.
        fps: overrides the source's frames per second.
        target_rmse: largest root mean square error, as a part of frame 0's diagonal.
        target_kg: largest Karni-Gotsman error, percent.
        target_bpvf: most bits per vertex and frame, of the whole file.
        max_error: a bound that every vertex of every frame keeps: model units, or a part of the diagonal such as ``"0.05%"``.
        purpose: what the file is for: ``"web"`` (browsers play it as it is), ``"stream"`` (starts at once, jumps fast, in
            bounded memory) or ``"archive"`` (the smallest); see `gvpipe.rate_control.purposes`.
        attributes: by name, the largest error of a static attribute: a number (degrees for normals), a part of its range
            such as ``"0.1%"``, ``"exact"``, or ``"none"`` to leave it out. Defaults: `gvpipe.asset_coding.bounds`.
        fields: the same for animated fields; ``"0.1%,nan=keep"`` keeps NaN as holes, ``"1%,by=length"`` bounds the length
            of a vector's error (a part of the longest) instead of each component's.
        textures: largest side of images, pixels, a format that they are changed to (``"webp"``, ``"jpeg"``, ``"png"``), or
            both: ``"1024,webp"``. None: bytes as they came.
        clip, mesh, frames, unlimited, real_time, warp, texture: as for `read`.
        volume: whether what lies inside of a simulation's surface is coded, too. None: of a sequence or a geometry video, yes;
            of other files, if it takes less than a third of the other bytes. A note says what was chosen.
        texture_quality: of textures with a picture for each frame, 0..100, higher is better; None: 75.
        texture_codec: of these: ``"h264"``, which all browsers play, ``"hevc"``, ``"av1"``, or ``"copy"`` for the pictures of a
            video as they are coded. None: ``"copy"`` for a video of H.264 where no quality is given, else ``"h264"``.
        track: of a capture whose frames have meshes of their own: let key meshes follow the surface, so that long shots take
            their place (`gvpipe.captures.tracking`); ``max_error`` then bounds the distance between the surfaces, both ways.
            None: where most frames have a mesh of their own, and nothing but colours would be lost. Without a target, vertices
            are then coded to an rmse of 0.0005 of the diagonal.
        vertices: of each key mesh; None: as few as its distance from the surface allows.
        stream: write the stream layout, which plays over HTTP while it loads (`restream`).
        bare: write the bare layout, for data sets: without poster and what else only players need.
        memory: bytes that encoding may take, about, in each process: segments are as short as it needs. Codec ``mcgv`` cannot.
        workers: code segments in so many processes of this machine, with the same bytes. Codec ``mcgv`` cannot. ``"auto"``: in
            one for each core, once a minute of work is left and no ``memory`` is given; None: here.
        scheduler: code them on the Dask cluster of this address, such as ``"tcp://host:8786"``, whose workers read ``source``
            at the same path (extra ``cluster``).
        audio: the file of a sound, or a `Sound`; second 0 is the source's first frame, and ``frames`` cut it too. None: the
            source's own, of a geometry video; False: none.
        audio_codec, audio_bitrate: of a file, as for `read_sound`.
        audio_trim: let the sound end with the film, if not before.

    Raises:
        InputError: the source, a setting or the path cannot be used, no quality meets the target, or a worker cannot work.
        OutputError: the file cannot be written; no part of it is left.
        TypeError: an argument of a type that is none of these.
    """
    from gvpipe.asset_coding.encoder import AssetCoder

    check_video_target(path, "gvpipe.encode's path")
    check_wanted((target_rmse, target_kg, target_bpvf, max_error), stream, bare)
    sounds = AudioOptions(audio, audio_codec, audio_bitrate, audio_trim)
    request = Request(codec, settings, purpose, (target_rmse, target_kg, target_bpvf, max_error), KEYWORDS)
    given = request.candidates()
    is_shared = workers == AUTO_WORKERS and scheduler is None
    if workers == AUTO_WORKERS:
        workers = count_cores() if is_shared and memory is None and may_share(given, source) else None
    if scheduler is not None or not (workers is None or is_shared):
        check_mapped(given)
    moving = MovingCoding(texture_codec, texture_quality)
    first_kernels.expect(given.id if isinstance(given, Codec) else given[0].id)
    clock = StageClock(progress)
    layout = STREAM if stream else BARE if bare else PLAIN
    beside = AssetOptions.of(attributes, fields, textures, moving)

    def encode_shots(capture: Capture) -> Report:
        capture = capture if texture is None else add_texture_to_shots(capture, texture, frames)
        wanted = CaptureRequest(request, beside, sounds, frames, memory, layout, track, vertices)
        return encode_capture(capture, wanted, path, clock)

    with open_executor(scheduler, workers) as executor:
        options: dict[str, Any] = {"clip": clip, "mesh": mesh, "frames": frames, "unlimited": unlimited}
        options |= {"real_time": real_time, "warp": warp}
        if isinstance(source, Capture):
            return encode_shots(some_frames(source, frames, fps))
        try:
            sequence, spares_volume, chosen = open_with_inside(source, path, fps, options, volume)
            sequence = with_sound(sequence, sounds, frames)
            sequence = sequence if texture is None else add_texture(sequence, texture, frames)
            options["volume"] = sequence.volume is not None
            if memory is not None:
                given = fit_segments(given, sequence.n_vertices, memory)
            target = one_target(sequence, *request.targets)
            asset = AssetCoder(sequence, dataclasses.replace(beside, spares_volume=spares_volume))
            with segments_coded_by(executor, sequence, source, {"fps": fps, **options}, is_shared):
                coded = code_sequence(sequence, given, target, asset, bare, clock)
        except TopologyChange:
            if isinstance(source, MeshSequence):
                raise
            return encode_shots(read_capture(source, fps, **{**options, "volume": bool(volume)}))
    size, bitstream = write_coded(sequence, coded, path, clock, layout)
    clock("", 1.0)
    chosen += () if asset.volume_choice is None else (asset.volume_choice.note,)
    return Report(
        codec=coded.codec.id,
        settings=dataclasses.asdict(coded.codec),
        vertices=bitstream.n_vertices,
        triangles=bitstream.n_triangles,
        frames=bitstream.n_frames,
        fps=bitstream.fps,
        bytes=size,
        bpvf=8 * size / (bitstream.n_vertices * bitstream.n_frames),
        seconds={"encode": time.perf_counter() - clock.started, **clock.seconds},
        not_carried=[*sorted(asset.plan.left_out), *asset.carried.not_carried],
        sections=bytes_by_part(bitstream, size),
        tried=[trial.to_json() for trial in coded.tried],
        reason=coded.reason,
        notes=[*coding_notes(sequence, target, asset.plan), *asset.sound_notes, *chosen, *refusal_notes(path, bitstream, size)],
        audio=None if asset.sound is None else asset.sound.to_json(),
        errors={} if coded.errors is None else dataclasses.asdict(coded.errors),
    )


KEYWORDS = tuple(name for name in signature(encode).parameters if name != "settings")
"""All of `encode` that is no setting of a codec."""


def decode(path: StrPath, start: int = 0, stop: int | None = None, lod: int = 0, *, unlimited: bool = False) -> MeshSequence:
    """Decode frames ``start`` to ``stop`` of a geometry video into memory; ``lod`` above 0 asks for a coarser mesh.

    With ``unlimited`` the file may take whatever memory and work it asks for (`Player`).

    Raises:
        InputError: no such file, or the frames or the level are not in it.
        SeveralShots: the frames are of several shots of a capture, which `open_capture` reads.
        FormatError: not a geometry video, or a damaged one.
    """
    player, shift = _player_of(path, start, stop, unlimited)
    first_kernels.expect(player.bitstream.codec)
    start, stop = frame_range(player, start - shift, None if stop is None else stop - shift)
    if lod:
        whole = player.level(lod)
        positions = whole.read(start, stop)
    else:  # positions before faces: the video decodes on other threads while the mesh does on this one
        positions, whole = player[start:stop], player.sequence()
    fields = {name: each.part(start, stop) for name, each in whole.fields.items()}
    images = tuple(image.part(start, stop) for image in whole.images)
    return dataclasses.replace(whole, positions=positions, fields=fields, images=images, sound=whole.sound_of(start, stop))


def _player_of(path: StrPath, start: int, stop: int | None, unlimited: bool) -> tuple[Player, int]:
    """What has some frames, and the first one's number: a geometry video, or a shot of a capture."""
    try:
        return Player(path, unlimited=unlimited), 0
    except SeveralShots:
        video = CapturePlayer(path, unlimited=unlimited)
        (number, _, _), *others = video.capture().spans(start, stop)
        if others:
            raise
        return video.shot(number), video.starts[number]


def restream(
    source: StrPath,
    path: StrPath,
    layout: str | None = None,
    *,
    unlimited: bool = False,
    audio: StrPath | Sound | bool | None = None,
    audio_codec: str | None = None,
    audio_bitrate: int | None = None,
    audio_trim: bool = False,
) -> Restreamed:
    """Change the layout of a geometry video, without loss: sections, pictures and sound stay as they are, to the bit.

    The *stream* layout has an index first, then each segment's sections beside its pictures. It plays over HTTP while it
    loads, and a jump costs one segment. The *plain* layout is a little smaller. A file of the *bare* layout gets the poster
    that it lacks. Of a file that was left unfinished (layout ``live``) the new file has the clips that are there.

    Args:
        source: a geometry video, or its address.
        path: of the file to write.
        layout: ``"stream"`` or ``"plain"``; None: ``"stream"`` for plain and unfinished files, ``"plain"`` for others.
        unlimited: as for `open`.
        audio, audio_codec, audio_bitrate, audio_trim: as for `encode`: another sound, or none; the layout then stays, unless
            another is asked for.

    Raises:
        InputError: no such file, no such layout, or a sound that cannot be read.
        FormatError: not a geometry video, or a damaged one.
        OutputError: the file cannot be written; no part of it is left.
    """
    if layout not in (None, PLAIN, STREAM):
        raise InputError(f"layout is {layout!r}; {PLAIN} or {STREAM} is needed")
    check_video_target(path, "gvpipe.restream's path")
    sounds = AudioOptions(audio, audio_codec, audio_bitrate, audio_trim)
    try:
        bitstream = read_file(check_path(source, "the geometry video"), unlimited)
    except SeveralShots:
        return _restream_capture(source, path, layout, unlimited, sounds)
    kept = bitstream.layout if not sounds.is_empty and bitstream.layout in (PLAIN, STREAM) else None
    chosen = layout or kept or (STREAM if bitstream.layout in (PLAIN, LIVE) else PLAIN)
    bitstream, said = _with_audio(bitstream, os.fspath(source), sounds)
    if bitstream.layout in (BARE, LIVE):  # which have no poster, or none that is read
        bitstream = dataclasses.replace(bitstream, is_bare=False)
        if not bitstream.video:
            with Player(source, unlimited=unlimited) as player:
                bitstream = dataclasses.replace(bitstream, video=poster_of(player.sequence()), outline=player.outline())
    with in_file(os.fspath(source)):
        bitstream = load(bitstream)
        size = write_file(bitstream, path, parts=segment_parts(bitstream) if chosen == STREAM else None)
    return Restreamed(chosen, bitstream.n_bytes, size, [*bitstream.lost, *said])


def _restream_capture(source: StrPath, path: StrPath, layout: str | None, unlimited: bool, sounds: AudioOptions) -> Restreamed:
    """Copy a capture with another sound."""
    if layout is not None or sounds.is_empty:
        raise InputError(f"{source} is a capture, whose index comes first in any case; it needs no other layout")
    video = CapturePlayer(source, unlimited=unlimited)
    index = video.index
    assert index is not None
    with in_file(os.fspath(source)):
        sound, said = sound_beside(video.sound, len(video) / video.fps, sounds)
        others = tuple(each for each in index.companions if each.kind != SOUND_KIND)
        size = copy_shots(index, path, (*(() if sound is None else (pack_sound(sound),)), *others))
    return Restreamed(SHOTS, index.size, size, [*index.lost, *said])


def _with_audio(bitstream: Bitstream, name: str, sounds: AudioOptions) -> tuple[Bitstream, tuple[str, ...]]:
    """A file's bitstream with the sound that is asked for, and what is said of it; ``name`` is the file's."""
    if sounds.is_empty:
        return bitstream, ()
    others = tuple(each for each in bitstream.companions if each.kind != SOUND_KIND)
    with in_file(name):
        sound, said = sound_beside(read_sound_track(bitstream.companions)[0], bitstream.n_frames / bitstream.fps, sounds)
        own = () if sound is None else (pack_sound(sound),)
    return dataclasses.replace(bitstream, companions=(*own, *others)), said


def open(path: StrPath, *, unlimited: bool = False, shared: Callable[[str], bytes] | None = None) -> Player:
    """Open a geometry video for random access; see `Player`; raises TypeError for what is no path."""
    return Player(path, unlimited=unlimited, shared=shared)


def open_capture(path: StrPath, *, unlimited: bool = False) -> CapturePlayer:
    """Open a geometry video of one shot or several, whose vertices and triangles may change; see `CapturePlayer`."""
    return CapturePlayer(path, unlimited=unlimited)


def compare(
    reference: MeshSequence | Capture | Player | CapturePlayer | Source,
    distorted: MeshSequence | Capture | Player | CapturePlayer | Source,
    progress: Callable[[int, int], None] | None = None,
    *,
    surface: bool | None = None,
    metrics: str | Iterable[str] = (),
) -> Comparison:
    """Measure ``distorted`` against ``reference``, frame by frame: vertices, surfaces where these do not correspond.

    Args:
        reference: the original, a capture, a player, or what `read` takes; lengths are divided by its size. Where one of both
            has a volume, the other is read with what lies inside of it.
        distorted: as many frames, of the same vertices and triangles in any order, or of others; or what `read` takes, such as
            a geometry video.
        progress: called with (frames done, frames in all) after each block.
        surface: True: the distance of the surfaces too, whose triangles need not correspond; False: never; None: where vertices
            do not correspond. Of captures, surfaces are compared.
        metrics: more of them, by name: psnr, dame, fmpd, mesh, d1, d2, as a list or a text with commas. Each gives a number for
            every frame and their mean in ``Comparison.metrics``. The last three compare surfaces.

    Raises:
        InputError: one cannot be read, they differ in their number of frames, vertices do not correspond and ``surface`` is
            False, surfaces are needed and one side has no triangles, or no metric has such a name.
        TopologyChange: vertices or triangles of one change, and ``surface`` is False.
        TypeError: one of them is neither a sequence, a capture, a player nor a path.

    Examples:
        >>> import numpy as np
        >>> corners = np.array([[[0, 0, 0], [3, 0, 0], [0, 4, 0]]], float)  # one frame; its diagonal is 5
        >>> still = MeshSequence(corners, [[0, 1, 2]])
        >>> raised = MeshSequence(corners + [0, 0, 0.5], [[0, 1, 2]])
        >>> errors = compare(still, raised)
        >>> errors.rmse, errors.rmse_diag
        (0.5, 0.1)
    """
    from gvpipe.metrics.comparison import compare as measure
    from gvpipe.metrics.comparison import compare_captures
    from gvpipe.metrics.frame_metrics import check_metrics

    names = check_metrics(metrics)
    given = {"reference": reference, "distorted": distorted}
    for role, one in given.items():
        if not isinstance(one, MeshSequence | Capture | Player | CapturePlayer | str | os.PathLike | list | tuple):
            raise TypeError(f"compare's {role} is {show(one)}; a MeshSequence, a Player or a path is needed")
    if isinstance(reference, Capture | CapturePlayer) or isinstance(distorted, Capture | CapturePlayer):
        return compare_captures(_as_capture(reference), _as_capture(distorted), progress, metrics=names)
    try:
        both = [_as_sequence(one) for one in (reference, distorted)]
        if any(each.volume is not None for each in both):
            pairs = zip((reference, distorted), both, strict=True)
            both = [_as_sequence(one, volume=True) if each.volume is None else each for one, each in pairs]
        return measure(both[0], both[1], progress, surface=surface, metrics=names).of(reference, distorted)
    except TopologyChange:
        if surface is False:
            raise
        return compare_captures(_as_capture(reference), _as_capture(distorted), progress, metrics=names)


def _as_capture(given: MeshSequence | Capture | Player | CapturePlayer | Source) -> Capture:
    if isinstance(given, Capture):
        return given
    if isinstance(given, CapturePlayer):
        return given.capture()
    if isinstance(given, MeshSequence | Player):
        return Capture([_as_sequence(given)])
    return read_capture(given)


def _as_sequence(given: MeshSequence | Player | Source, volume: bool = False) -> MeshSequence:
    if isinstance(given, MeshSequence):
        return given
    return given.sequence() if isinstance(given, Player) else read(given, volume=volume)


def skin(
    source: MeshSequence | StrPath,
    joints: int = 0,
    *,
    target_kg: float | None = None,
    max_error: float | str | None = None,
    rigid: bool = False,
    correctives: int = 64,
    progress: Progress | None = None,
) -> Skin:
    """Find a skeleton that moves a sequence: joints, weights, and the joints' transforms in every frame.

    Args:
        source: a sequence, or what `gvpipe.read` takes.
        joints: about how many, 1..1024; 0: as many as the error takes.
        target_kg: Karni and Gotsman's error that it should not exceed, percent; 0.14 if neither errors nor joints are given.
        max_error: largest distance of a vertex, as of `encode`.
        rigid: joints turn, go and grow alike along all axes, one below the other, as bones of engines do; else they are affine.
        correctives: shapes that may be added where joints do not hold the error, at most, 0..1024: morph targets of glTF,
            blend shapes of USD. Fewer joints with some take their place where that is smaller.
        progress: called with each stage and the part of it that is done.

    Returns:
        The skeleton; its ``error`` is the largest distance of a vertex, part of the first frame's diagonal. It may exceed what
        was asked for, where no skeleton that was tried holds it.

    Raises:
        InputError: the source cannot be read.
        SettingError: an argument out of range.
        TypeError: an argument of the wrong type.
    """
    from gvpipe.skinning.fit import fit_skin

    for name, number in (("joints", joints), ("correctives", correctives)):
        if isinstance(number, bool) or not hasattr(number, "__index__"):
            raise TypeError(f"gvpipe.skin's {name} is {show(number)}; an integer is needed")
    if target_kg is not None:
        check_number(target_kg, "gvpipe.skin's target_kg")
    if not isinstance(source, MeshSequence):
        check_path(source, "gvpipe.skin's source", "a MeshSequence or ")
    sequence = source if isinstance(source, MeshSequence) else read(source)
    bound = None if max_error is None else parse_bound(max_error, sequence)
    return fit_skin(sequence, int(joints), target_kg, bound, progress, rigid, int(correctives)).skin


def render(
    source: MeshSequence | Capture | StrPath,
    path: StrPath,
    *,
    frame: int | None = None,
    size: int | tuple[int, int] = 512,
    view: str | tuple[float, float] = "three-quarter",
    up: str | None = None,
    turntable: bool = False,
    follow: bool = False,
    error_of: MeshSequence | StrPath | None = None,
    error_max: float | None = None,
    shading: str = "smooth",
    camera: Camera | None = None,
    field: str | None = None,
    colormap: str | None = None,
    field_range: tuple[float, float] | str | None = None,
    log: bool = False,
    parts: str | Sequence[str] = (),
    plain: bool = False,
    cut: str | None = None,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    fps: float | None = None,
    progress: Progress | None = None,
    unlimited: bool = False,
) -> list[str]:
    """Paint a sequence, or a geometry video, as ``.png``, ``.gif`` or ``.mp4``; return what should be known, a line each.

    Materials, textures and vertex colours show if the sequence has them.

    Args:
        source: a sequence, a capture, or what `gvpipe.read` takes; vertices and triangles may change.
        path: the file to write; an older one is replaced once the new one is complete.
        frame: the only frame to paint, of ``frames``, negative from the end; by default the first for a PNG, all for a film.
        size: pixels, one number for a square or ``(width, height)``; even for MP4.
        view: ``"three-quarter"``, ``"front"``, ``"back"``, ``"left"``, ``"right"``, ``"top"``, ``"bottom"`` or
            ``(azimuth, elevation)`` in degrees.
        up: the world's axis that is up: ``"x"``, ``"y"`` or ``"z"``; None: what the sequence's metadata says, else y.
        turntable: let the camera go once around.
        follow: let the camera go with the mesh, which then stays in the middle of the picture.
        error_of: a reference; colours then show each vertex' distance from it, with a legend.
        error_max: where the colours end, percent of the reference's diagonal, instead of at the largest error drawn.
        shading: ``"smooth"`` or ``"flat"``.
        camera: instead of the one that frames the whole motion from ``view``.
        field: name of a field; colours then show its values, or its vectors' lengths, with a legend. What has no value is grey.
        colormap: of the field: ``"viridis"`` (default), ``"magma"``, ``"coolwarm"``, ``"gray"`` or ``"errors"``.
        field_range: the values at the ends of the colours; ``"2%,98%"``: percentiles of the frames drawn; ``"symmetric"``:
            about 0. By default the range of the frames drawn.
        log: let colours follow the logarithm of the field; what is not above 0 is grey.
        parts: the name of the part to paint, or several; none: all.
        plain: paint the shape alone, without materials and colours.
        cut: a plane across an axis, above which all is left out: ``"x=0.3"`` (model units), ``"x=30%"`` (of the first frame's
            box), ``"-x=0.3"`` (what lies below is left out). What it shows of a volume is filled.
        clip, mesh, frames, fps: of the source, as for `read`; with a plane a simulation's volume is read, too.
        progress: called with ``"render"`` and the part that is done.
        unlimited: as for `read`.

    Raises:
        InputError: a value that cannot be, a sequence without triangles, a reference that does not fit, an unknown field or
            part, a texture without its uv attribute.
        OutputError: the file cannot be written; no part of it is left.
    """
    from gvpipe.rendering.capture_films import write_capture_pictures
    from gvpipe.rendering.films import PictureOptions, check_output, write_pictures

    check_target(path)
    target = Path(path)
    pixels = (size, size) if isinstance(size, int) else size
    options = PictureOptions(
        frame=frame,
        size=pixels,
        view=view,
        up=up,
        turntable=turntable,
        follow=follow,
        error_max=error_max,
        shading=shading,
        camera=camera,
        field=field,
        colormap=colormap,
        limits=field_range,
        log=log,
        parts=(parts,) if isinstance(parts, str) else tuple(parts),
        plain=plain,
        cut=cut,
    )
    check_output(target, options)
    for given in (source, error_of):
        if given is not None and is_among(path, given):
            raise InputError(f"{path} is an input too, which the picture would replace; choose another name")
    reference = error_of if error_of is None or isinstance(error_of, MeshSequence) else read(error_of, unlimited=unlimited)
    if isinstance(source, Capture):
        return list(write_capture_pictures(some_frames(source, frames, fps), target, options, progress))
    reading: dict[str, Any] = {"unlimited": unlimited, "volume": cut is not None}
    try:
        if isinstance(source, MeshSequence):
            sequence = source if frames is None else source.part(*frame_range(source, *frames))
            sequence = sequence if fps is None else sequence.with_fps(fps)
        else:
            sequence = read(source, fps, clip, mesh, frames, **reading)
        return list(dict.fromkeys([*sequence.notes, *write_pictures(sequence, target, options, reference, progress)]))
    except TopologyChange:
        if isinstance(source, MeshSequence) or reference is not None:
            raise
    capture = read_capture(source, fps, clip, mesh, frames, **reading)
    return list(write_capture_pictures(capture, target, options, progress))


def checked_keywords(codec: str | Codec | Sequence[Codec] | None = None, **keywords: Any) -> dict[str, Any]:
    """Keywords for `encode`, checked as far as can be without a sequence; a codec's settings become its settings object.

    Raises:
        SettingError, TypeError: as `encode`.
    """
    settings = {name: value for name, value in keywords.items() if name not in KEYWORDS}
    others = {name: value for name, value in keywords.items() if name in KEYWORDS}
    check_wanted([others.get(name) for name in TARGETS], *(others.get(name, False) for name in LAYOUTS))
    if others.get("max_error") is not None:
        read_bound(others["max_error"])
    given = chosen_codecs(codec, settings, others.get("purpose"), KEYWORDS)
    if others.get("memory") is not None:
        fit_segments(given, 1, others["memory"])
    return {**others, "codec": given}
