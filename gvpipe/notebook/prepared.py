"""What a notebook can show, as a geometry video that browsers play.

A geometry video stays as it is. A sequence is encoded by a quick codec, within an error that is measured. A large file gets the
stream layout, of which players fetch no more than they need.
"""

from __future__ import annotations

import os
import time
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from gvpipe.api import encode, restream
from gvpipe.coding.registry import browser_obstacle
from gvpipe.container.bitstream import PLAIN, STREAM
from gvpipe.container.mp4 import file_bytes
from gvpipe.container.shot_layout import ShotIndex
from gvpipe.container.sources import VIDEO_SUFFIXES, BytesSource, FileSource, Source, SourceWindow, is_remote
from gvpipe.foundation.arguments import show
from gvpipe.foundation.atomic import PREFIX, new_folder, remove_abandoned_folders, remove_folder
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import count
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence, describe
from gvpipe.playback.capture_player import CapturePlayer
from gvpipe.playback.files import read_capture
from gvpipe.playback.player import Player
from gvpipe.rate_control.targets import parse_bound
from gvpipe.rendering.poster import poster_of

CODEC = "pca"  # of sequences: the quickest, and its files play everywhere
QUALITY = 90.0  # tried first; a search for the bound takes several encodes
MOST_AT_ONCE = 8 << 20  # bytes of a file that is sent as a whole; of larger ones parts are fetched


@dataclass(frozen=True)
class Prepared:
    """A geometry video to show.

    Args:
        name: of what was given.
        player: of the file that is shown; of a capture, of its first shot.
        source: the file's bytes.
        note: what was done to what was given, one line; "" if it is shown as it is.
        row: all shots of a capture.
    """

    name: str
    player: Player
    source: Source
    note: str = ""
    row: CapturePlayer | None = None

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return len(self.player if self.row is None else self.row)

    @property
    def shots(self) -> Sequence[MeshSequence]:
        """What is shown, a shot each."""
        return [self.player.sequence()] if self.row is None else self.row.capture().shots

    def at(self, frame: int) -> tuple[Player, int]:
        """The player of what a frame shows, and the frame's number there, for a frame in ``0..n_frames - 1``."""
        if self.row is None:
            return self.player, frame
        number, own = self.row.capture().locate(frame)
        return self.row.shot(number), own

    def described(self) -> str:
        """The name and the numbers of what is shown."""
        return f"{self.name}: {describe(self.player.sequence())}" if self.row is None else repr(self.row.capture())[1:-1]

    @property
    def is_large(self) -> bool:
        """Whether pages fetch parts of the file."""
        return self.source.size > MOST_AT_ONCE

    def data(self) -> bytes:
        """The whole file."""
        return self.source.read(0, self.source.size)


_encodings: weakref.WeakKeyDictionary[MeshSequence | Capture, dict[float | str, Prepared]] = weakref.WeakKeyDictionary()


def prepare(given: Any, error: float | str, progress: Progress | None = None, *, unlimited: bool = False) -> Prepared:
    """Make a geometry video for browsers of a player, a sequence, a capture, or the path of any.

    Args:
        given: `Player`, `CapturePlayer`, `MeshSequence`, `Capture` or what `gvpipe.read_capture` takes.
        error: most that a vertex may move by an encoding: model units, or a part of the diagonal such as ``"0.1%"``.
        progress: of an encoding.
        unlimited: as for `Player`, of a path.

    Raises:
        InputError, FormatError: it cannot be read or encoded.
        TypeError: it is none of these.
    """
    if isinstance(given, str | os.PathLike) and (is_remote(given) or os.fspath(given).lower().endswith(VIDEO_SUFFIXES)):
        given = CapturePlayer(given, unlimited=unlimited)
    elif isinstance(given, str | os.PathLike | list | tuple):
        given = read_capture(given, unlimited=unlimited)
    if isinstance(given, CapturePlayer):
        if given.index is not None:
            return _of_row(given, given.index)
        given = given.shot(0)
    if isinstance(given, Capture) and len(given.shots) == 1:
        given = given.shots[0]
    if isinstance(given, MeshSequence):
        given = _player_behind(given) or given
    if isinstance(given, Player) and browser_obstacle(given.bitstream):
        given = given.sequence()
    if isinstance(given, Player):
        return _of_player(given)
    if not isinstance(given, MeshSequence | Capture):
        raise TypeError(f"gvpipe.show was given {show(given)}; a path, a Player, a MeshSequence or a Capture is needed")
    known = _encodings.setdefault(given, {})
    if error not in known:
        if isinstance(given, Capture):
            known[error] = _encoded_row(given, error, progress)
        else:
            known[error] = _encoded(given, error, progress)
    return known[error]


def is_ready(given: MeshSequence | Capture, error: float | str) -> bool:
    """Whether a sequence can be shown without an encoding."""
    is_decoded = isinstance(given, MeshSequence) and _player_behind(given) is not None
    return is_decoded or error in _encodings.get(given, {})


def _player_behind(sequence: MeshSequence) -> Player | None:
    """The player whose `Player.sequence` it is, unless something else lies beside the positions by now."""
    player = sequence.positions
    if not isinstance(player, Player):
        return None
    beside = ("attributes", "fields", "parts", "materials")
    return player if all(list(getattr(sequence, what)) == list(getattr(player, what)) for what in beside) else None


def _of_player(player: Player) -> Prepared:
    """The file as it is, or in a layout that pages can play."""
    bitstream = player.bitstream
    if player.on_disk is None or bitstream.layout not in (PLAIN, STREAM):
        if bitstream.layout != STREAM:
            bitstream = replace(bitstream, video=bitstream.video or poster_of(player.sequence()), is_bare=False)
        return Prepared(player.path, player, BytesSource(file_bytes(bitstream)))
    source = FileSource(player.on_disk)
    if source.size <= MOST_AT_ONCE or bitstream.layout == STREAM:
        return Prepared(player.path, player, source)
    path = _temporary_file()
    restream(player.on_disk, path, STREAM, unlimited=True)
    return _holding(path, Prepared(player.path, player, FileSource(path)))


def _of_row(row: CapturePlayer, index: ShotIndex) -> Prepared:
    """The file of a capture as it is, whose index says where each shot lies."""
    first = row.shot(0)
    if obstacle := browser_obstacle(first.bitstream):
        raise InputError(f"{row.path} has {obstacle}, which browsers do not play; encode it for browsers (--for web)")
    return Prepared(row.path, first, SourceWindow(index.source, 0, index.size), row=row)


def _encoded_row(capture: Capture, error: float | str, progress: Progress | None) -> Prepared:
    """Encode each shot of a capture within an error."""
    path, begun = _temporary_file(), time.perf_counter()
    encode(capture, path, CODEC, progress, max_error=error, track=False)
    row = CapturePlayer(path, unlimited=True)
    source, seconds = FileSource(path), time.perf_counter() - begun
    what = f"encoded by {CODEC} in {seconds:.1f} s: {show_bytes(source.size)} in {count(len(capture.shots), 'shot')}"
    bound = error if isinstance(error, str) else f"{error:g}"
    return _holding(path, Prepared(capture.name, row.shot(0), source, f"{what}; vertices move by at most {bound}", row))


def _encoded(sequence: MeshSequence, error: float | str, progress: Progress | None) -> Prepared:
    """Encode a sequence within an error: at `QUALITY` if that is fine enough, else as a search for the bound finds."""
    bound, begun = parse_bound(error, sequence), time.perf_counter()
    path = _temporary_file()
    encode(sequence, path, CODEC, progress, quality=QUALITY, stream=True)
    player = Player(path, unlimited=True)
    errors = measure_errors(sequence, lambda start, stop: player[start:stop])
    if errors.max > bound:
        os.remove(path)
        encode(sequence, path, CODEC, progress, max_error=bound)
        player = Player(path, unlimited=True)
        errors = measure_errors(sequence, lambda start, stop: player[start:stop])
    source = FileSource(path)
    most = f"{100 * errors.max_diag:.2g} % of the diagonal" if errors.max_diag is not None else f"{errors.max:.2g}"
    seconds = time.perf_counter() - begun
    note = f"encoded by {CODEC} in {seconds:.1f} s: {show_bytes(source.size)}; vertices move by at most {most}"
    return _holding(path, Prepared(sequence.name, player, source, note))


def _temporary_file() -> str:
    """The path of a file that is to be made, in a folder of its own."""
    remove_abandoned_folders()
    return os.path.join(new_folder(PREFIX), "shown.mp4")


def _holding(path: str, prepared: Prepared) -> Prepared:
    """What is prepared, with which a temporary file's folder goes."""
    weakref.finalize(prepared, remove_folder, os.path.dirname(path))
    return prepared


def show_bytes(count: int) -> str:
    """A number of bytes for people.

    Examples:
        >>> show_bytes(812), show_bytes(131_283), show_bytes(9_400_000)
        ('812 bytes', '131 kB', '9.4 MB')
    """
    if count < 1000:
        return f"{count} bytes"
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"
