"""Random access to the frames of a geometry video of one shot or several."""

from __future__ import annotations

import os
import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from functools import partial
from types import TracebackType
from typing import Any

from gvpipe.asset_coding.sound_track import read_sound
from gvpipe.container.mp4 import read_index
from gvpipe.container.shot_layout import ShotIndex
from gvpipe.container.sources import is_remote
from gvpipe.foundation.arguments import check_path
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import corrupt, in_file
from gvpipe.io.simulation.vtk_frames import to_pyvista
from gvpipe.media.sound import Sound
from gvpipe.model.capture import Capture, LazyShots
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.shown import ShownInNotebooks
from gvpipe.playback.player import Player

MOST_OPEN = 4  # shots whose decoded frames are kept


class CapturePlayer(ShownInNotebooks):
    """An open capture: a row of shots, each a `Player`, on one clock. A file of one shot is a row of one.

    A context manager; thread-safe; pickled, it is opened again by its path. A shot is opened when it is asked for, and the last
    few stay open: over HTTP a jump costs the shot that it lands in, or of a long one what is asked for.

    ``video[k]`` are the positions of frame k, ``(V, 3) float32``, model units, relative to the ``origin`` of its shot; V is
    that of its shot. `frame` also gives the triangles and all else.

    Args:
        path: of the file, or its address.
        unlimited: as of `Player`.

    Raises:
        InputError: there is no such file.
        OverBudget: here or later: it asks for more than a file of its size may take.
        FormatError: it is not a geometry video, or it is damaged.
    """

    def __init__(self, path: str | os.PathLike[str], *, unlimited: bool = False) -> None:
        self.path = os.fspath(check_path(path, "the geometry video"))
        self._absolute = self.path if is_remote(self.path) else os.path.abspath(self.path)
        self._unlimited = unlimited
        self._lock = threading.Lock()
        self._open: OrderedDict[int, Player] = OrderedDict()
        self.index: ShotIndex | None = read_index(path, unlimited)
        if self.index is None:
            self._open[0] = Player(path, unlimited=unlimited)
            bitstream = self._open[0].bitstream
            self.lengths: tuple[int, ...] = (bitstream.n_frames,)
            self.fps, self.n_bytes = bitstream.fps, bitstream.n_bytes
        else:
            self.lengths, self.fps, self.n_bytes = self.index.frames, self.index.fps, self.index.size
        shots = LazyShots(len(self.lengths), lambda number: self.shot(number).sequence())
        self._row = Capture(shots, self.path, self.lengths, self.fps, self.sound)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), unlimited=self._unlimited), (self._absolute,)

    @property
    def shots(self) -> Sequence[Player]:
        """The shots, each opened when it is asked for."""
        return _OpenedShots(self)

    def shot(self, number: int) -> Player:
        """A shot, opened.

        Raises:
            FormatError: it is damaged, or not the one that the index describes.
        """
        with self._lock:
            player = self._open.get(number) or self._opened(number)
            self._open[number] = player
            self._open.move_to_end(number)
            while len(self._open) > MOST_OPEN:
                self._open.popitem(last=False)[1].close()
        return player

    def _opened(self, number: int) -> Player:
        index = self.index
        assert index is not None  # the only shot of other files stays open
        name = f"{self.path}: shot {number}"
        player = Player(name, unlimited=self._unlimited, data=index.shot(number), shared=index.find)
        found, fps = player.bitstream, index.fps
        expected = index.frames[number], index.vertices[number], index.triangles[number], fps
        if (found.n_frames, found.n_vertices, found.n_triangles, found.fps) != expected:
            with in_file(name):
                raise corrupt("its frames, vertices, triangles or rate are not those that the index gives")
        return player

    def capture(self) -> Capture:
        """The shots as sequences, whose frames are decoded when they are read."""
        return self._row

    @property
    def sound(self) -> Sound | None:
        """What is heard with the frames, None if the file has none; its samples are read when they are asked for."""
        return self.shot(0).sound if self.index is None else read_sound(self.index.companions)[0]

    @property
    def starts(self) -> tuple[int, ...]:
        """The first frame of each shot."""
        return self.capture().starts

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the shots, a line each; opens all of them."""
        lost = () if self.index is None else (*self.index.lost, *read_sound(self.index.companions)[1])
        return tuple(dict.fromkeys([*lost, *(note for shot in self.shots for note in shot.notes)]))

    def frame(self, frame: int) -> MeshSequence:
        """A frame with all that belongs to it, as a sequence of one; raises IndexError."""
        return self.capture().frame(frame)

    def to_pyvista(self, frame: int = 0) -> Any:
        """A frame as a data set of PyVista, which must be installed; raises as `gvpipe.to_pyvista` does."""
        return to_pyvista(self, frame)

    def __len__(self) -> int:
        return len(self._row)

    def __getitem__(self, frame: int, /) -> Float32:
        number, own = self.capture().locate(frame)
        return self.shot(number)[own]

    def __iter__(self) -> Iterator[Float32]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"<CapturePlayer {self.path}: {repr(self.capture()).removeprefix(f'<Capture {self.path}: ').removesuffix('>')}>"

    def _repr_html_(self) -> str:
        return self.capture()._repr_html_()

    def __enter__(self) -> CapturePlayer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of decoded frames and of all threads. The video stays usable."""
        with self._lock:
            for player in self._open.values():
                player.close()

    @property
    def shot_bytes(self) -> tuple[int, ...]:
        """Bytes of each shot's file; what they share counts once for all, beside them."""
        return (self.n_bytes,) if self.index is None else self.index.n_bytes


class _OpenedShots(Sequence[Player]):
    def __init__(self, video: CapturePlayer) -> None:
        self._video = video

    def __len__(self) -> int:
        return len(self._video.lengths)

    def __getitem__(self, number: int) -> Player:  # type: ignore[override]
        if not -len(self) <= number < len(self):
            raise IndexError(f"shot {number} of {self._video.path}: there are {len(self)}")
        return self._video.shot(number % len(self))
