"""A geometry video and its player as one HTML file that needs no network.

What: page = ``page.html`` with the player's bundle (deflated, in digits of base 85) and the MP4 file as base64 text, so that it
opens from a disk. Why: browsers load no modules and fetch no files for a page that is itself a file. Base 85 takes a fifteenth
less than base 64, which the element knows (``src="#id"``).

Shots of a capture and several files are one row in the page, in one file that the player plays on one clock.

A codec knows which of its files browsers play (`gvpipe.coding.registry.browser_obstacle`). Any other file, and one for which
that is asked, is decoded and encoded anew at a Karni-Gotsman error that is small beside that of files. The error that this adds
is measured and reported.
"""

from __future__ import annotations

import base64
import functools
import html
import os
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from gvpipe.coding.quality_scale import error_of, quality_of
from gvpipe.coding.registry import browser_obstacle, make_codec
from gvpipe.container.bitstream import BARE, STREAM, Bitstream
from gvpipe.container.mp4 import file_bytes
from gvpipe.container.shots import pack_row
from gvpipe.container.sources import check_target, is_remote
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.foundation.progress import Progress
from gvpipe.playback.capture_player import CapturePlayer
from gvpipe.playback.player import Player
from gvpipe.rate_control.purposes import SERVES, WEB
from gvpipe.rate_control.trials import Trial, Trials
from gvpipe.rendering.poster import poster_of
from gvpipe.web.asset_export import carry_asset
from gvpipe.web.page_view import PageView, view_of_shots

SUFFIXES = (".html", ".htm")
AXES = ("y", "z")
QUALITY = 90.0  # of a conversion: KG 0.044, which makes the error of a file of quality 75 (KG 0.14) 5 % larger
MOST_ENCODES = 3
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;,=>?@^_`{|}~"  # no "<", which ends scripts
INSIDE = 0.97  # of the error allowed: aimed at after an encode that missed it


@dataclass(frozen=True)
class ExportReport:
    """What an export did.

    Args:
        bytes: of the page.
        video_bytes: of the geometry video in it.
        converted: what the file was if it was converted, else "".
        rmse_diag: root mean square error that the conversion adds, a fraction of the frame-0 bounding-box diagonal; 0 without
            one, None if the diagonal is 0.
        max_diag: the same of the largest error.
        kg: the same as Karni-Gotsman error, percent; None if the file's frames are a point each.
        unfinished: whether the file is still written; the page has what is there.
    """

    bytes: int
    video_bytes: int
    converted: str = ""
    rmse_diag: float | None = 0.0
    max_diag: float | None = 0.0
    kg: float | None = 0.0
    unfinished: bool = False

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return asdict(self)


def export_html(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    up: str | None = None,
    quality: float | None = None,
    progress: Progress | None = None,
    *,
    convert: bool = False,
    field: str | None = None,
    colormap: str | None = None,
    field_range: tuple[float, float] | str | None = None,
    log: bool = False,
    speed: float = 1.0,
    warp: str | None = None,
    clip: str | None = None,
    camera: str | tuple[float, float] | None = None,
    shading: str = "smooth",
    unlimited: bool = False,
    then: Sequence[str | os.PathLike[str]] = (),
) -> ExportReport:
    """Write a page of one file that plays a geometry video or a capture, or several, one after the other.

    Args:
        source: the geometry video, of any codec, or its address (``https://...``).
        target: the ``.html`` to write; an older file is replaced once the new one is complete.
        up: the axis that stands upright in the first view, ``y`` or ``z``; None: the file's own, else ``y``.
        quality: 0..100, of the conversion where there is one: the error that it may add (`gvpipe.coding.quality_scale`);
            `QUALITY` if None.
        progress: called with a stage's name and the part of it that is done.
        convert: encode the file anew in any case, in the profile that all browsers play.
        field: name of a field; the page opens with colours of its values, or of its vectors' lengths. None: materials.
        colormap: of the field: ``"viridis"`` (default), ``"magma"``, ``"coolwarm"`` or ``"gray"``.
        field_range: the values at the ends of the colours; ``"2%,98%"``: percentiles of all frames; ``"symmetric"``: about 0.
        log: let colours follow the logarithm of the field; what is not above 0 is grey.
        speed: 0.0625 to 16; 1 is the video's own.
        warp: ``"NAME"`` or ``"NAME:SCALE"``: a field of vectors on vertices that moves them, so many times as far.
        clip: a plane that cuts the mesh: ``"x=0.3"`` (model units), ``"y=30%"`` (of the first frame's box), ``"-x=0.3"``
            (what lies below is left out). The section of a volume is filled.
        camera: a view's name, ``"azimuth,elevation"`` or ``(azimuth, elevation)``, degrees, as of `gvpipe.render`.
        shading: ``"smooth"`` or ``"flat"``.
        unlimited: let the geometry video take whatever memory and work it asks for (`gvpipe.playback.player.Player`).
        then: geometry videos that play behind the first, at the same rate. Several, and captures, are not converted.

    Raises:
        InputError: there is no such file or field, an argument cannot be used, or browsers do not play a shot of several.
        FormatError: not a geometry video, or a damaged one.
        OutputError: the page cannot be written; no part of it is left.
    """
    check_target(target)
    target = Path(target)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"{target}: the output is a web page; end its name in .html")
    if up is not None and up not in AXES:
        raise InputError(f"up is {up!r}; one of {', '.join(AXES)} is needed")
    if not os.path.isdir(target.parent):
        raise OutputError(f"cannot write {target}: no folder {target.parent}; create it first")
    videos = [CapturePlayer(each, unlimited=unlimited) for each in (source, *then)]
    shots = [shot for video in videos for shot in video.shots]
    if up is None:
        found = shots[0].metadata.up_axis
        up = found if found in AXES else "y"
    options = {"colormap": colormap, "log": log, "speed": speed, "clip": clip, "camera": camera, "shading": shading}
    view = view_of_shots([shot.sequence() for shot in shots], field, field_range, warp, **options)
    view = replace(view, muted=any(video.sound is not None for video in videos))
    if len(shots) > 1 or videos[0].index:
        report = _write_page(videos[0].path, _row(videos, shots, convert), target, up, view)
        return replace(report, unfinished=any(shot.bitstream.is_unfinished for shot in shots))
    player = shots[0]
    obstacle = browser_obstacle(player.bitstream)
    if not obstacle and not convert:
        report = _write_page(player.path, _as_it_is(player), target, up, view)
        return replace(report, unfinished=player.bitstream.is_unfinished)
    trial = _convert(player, QUALITY if quality is None else quality, progress)
    remaining = browser_obstacle(trial.bitstream)
    if remaining:
        raise InputError(f"the web player does not read {remaining} yet; use an older gvpipe to convert")
    x, y, z = player.bitstream.origin
    bitstream = carry_asset(player, trial.encoded, trial.codec)
    video = bitstream.video or poster_of(player.sequence())
    page = _write_page(player.path, file_bytes(replace(bitstream, origin=(x, y, z), video=video)), target, up, view)
    added = trial.errors
    return ExportReport(
        page.bytes, page.video_bytes, obstacle or _kind(player.bitstream), added.rmse_diag, added.max_diag, added.kg
    )


def _row(videos: Sequence[CapturePlayer], shots: Sequence[Player], convert: bool) -> bytes:
    """Several shots as the file of one capture."""
    for shot in shots:
        obstacle = browser_obstacle(shot.bitstream)
        if convert or obstacle:
            why = f" ({obstacle})" if obstacle else ""
            raise InputError(f"{shot.path} is one of several, which are not converted{why}; encode it for browsers (--for web)")
    for video in videos:
        if video.fps != videos[0].fps:
            rates = f"{videos[0].path} plays at {videos[0].fps:g} frames per second and {video.path} at {video.fps:g}"
            raise InputError(f"{rates}; a page has one rate: encode them with the same --fps")
    index = videos[0].index
    if len(videos) == 1 and index is not None:
        return index.source.read(0, index.size)
    for video in videos:
        if video.sound is not None:
            raise InputError(
                f"{video.path} has a sound, which a page of several files has no place for; take it out (--no-audio)"
            )
    bitstreams = [replace(shot.bitstream, outline=shot.bitstream.outline or shot.outline()) for shot in shots]
    return b"".join(pack_row(poster_of(shots[0].sequence()), bitstreams, videos[0].fps).data)


def _as_it_is(player: Player) -> bytes:
    """A geometry video as a file that a page can hold."""
    is_whole = player.bitstream.layout != BARE and not is_remote(player.path)
    return Path(player.path).read_bytes() if is_whole else _plain(player)


def _plain(player: Player) -> bytes:
    """A geometry video as a file of the plain layout."""
    video = player.bitstream.video or poster_of(player.sequence())
    bitstream = player.bitstream if player.bitstream.layout == STREAM else replace(player.bitstream, video=video, is_bare=False)
    return file_bytes(bitstream)


def _kind(bitstream: Bitstream) -> str:
    """A bitstream's codec and profile, in a few words."""
    header = bitstream.header
    return ", ".join([bitstream.codec, *(f"{key} {header[key]}" for key in ("transform", "profile") if key in header)])


def _convert(player: Player, quality: float, progress: Progress | None) -> Trial:
    """Encode a file's frames for browsers, with no more error than the quality's where a few encodes reach that."""
    name, settings = next(iter(SERVES[WEB].items()))
    codec = make_codec(name, {**settings, "quality": quality})
    trials, allowed = Trials(codec, player.sequence().bare(), None, progress), error_of(quality)
    tried: list[Trial] = []
    while len(tried) < MOST_ENCODES:
        trial = trials(quality)
        tried.append(trial)
        if trial.errors.kg is None or trial.errors.kg <= allowed or quality >= 100:
            break
        quality = quality_of(error_of(quality) * INSIDE * allowed / trial.errors.kg)
    return min(tried, key=lambda trial: trial.errors.kg or 0.0)


def page_text(name: str, data: bytes, up: str, view: PageView) -> str:
    """A page that plays a geometry video.

    Args:
        name: path of the file, whose stem is the page's title.
        data: of the file.
        up: the axis that stands upright in the first view.
        view: how it opens.
    """
    shipped = files("gvpipe.web")
    page = (shipped / "page.html").read_text("utf-8")
    values = {
        "TITLE": html.escape(Path(name).stem),
        "UP": up,
        "VIEW": view.attributes(),
        "NOTICE": (shipped / "LICENSES" / "NOTICE.txt").read_text("utf-8").strip(),
        "DIGITS": DIGITS,
        "PLAYER": _player(),
        "VIDEO": _base64(data),
    }
    parts = page.split("$$")  # text, name, text, name, ..., text
    return "".join(values[part] if i % 2 else part for i, part in enumerate(parts))


@functools.cache
def _player() -> str:
    """The player's bundle, as a page holds it."""
    return _base85(zlib.compress((files("gvpipe.web") / "bundle" / "player.js").read_bytes(), 9))


def _write_page(name: str, data: bytes, target: Path, up: str, view: PageView) -> ExportReport:
    text = page_text(name, data, up, view).encode()
    with unnamed_path(target) as temporary:
        temporary.write_bytes(text)
    return ExportReport(len(text), len(data))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _base85(data: bytes) -> str:
    """Five of `DIGITS` for four bytes, as ``base64.b85encode`` does with "<" in place of ","."""
    return base64.b85encode(data).decode("ascii").replace("<", ",")
