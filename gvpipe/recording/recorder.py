"""A geometry video, or a page of one, that is written while a loop runs.

Positions are coded as they come, by the codec of live files. Fields wait on the disk, and are coded at the end. So memory is
that of one clip of frames, and at the end that of the file. A file that grows lies beside the one that is asked for, and takes
its name once it is whole.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.asset.part import Part
from gvpipe.asset_coding.encoder import AssetCoder
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.coding.codec import Encoded
from gvpipe.coding.registry import make_codec, segment_parts
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import load, write_file
from gvpipe.container.sources import VIDEO_SUFFIXES, check_target
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError, OutputError, SettingError
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.live import LiveEncoder
from gvpipe.playback.player import Player
from gvpipe.recording.arrays import as_array
from gvpipe.recording.field_spool import FieldSpool
from gvpipe.web.export import SUFFIXES, export_html

if TYPE_CHECKING:
    from gvpipe.recording.live_view import LiveView

CODEC = "pdct"  # that codes frames as they come
KEEP_HOLES = "nan=keep"


class Recorder:
    """Writes the frames of a loop; see `record`, which makes it. A context manager, which finishes the file.

    While it grows, the file is ``growing``: it opens up to its last whole clip, and pages play it. It stays if the process is
    killed.
    """

    def __init__(
        self,
        path: StrPath,
        faces: Any,
        fps: float = 30.0,
        *,
        attributes: Mapping[str, Any] | None = None,
        fields: Mapping[str, float | str] | None = None,
        parts: Sequence[Part] = (),
        materials: Sequence[Material] = (),
        images: Sequence[Image] = (),
        metadata: Metadata = NO_METADATA,
        page: Mapping[str, Any] | None = None,
        show: bool | None = None,
        **settings: Any,
    ) -> None:
        self.path = Path(check_path(path, "gvpipe.record's path"))
        _check_target(self.path, page)
        if settings.get("reorder"):
            raise SettingError("reorder: a recording keeps the order of vertices, which its fields have")
        make_codec(CODEC, settings, ())
        self.growing = _spare_name(self.path)
        self._faces = as_array(faces, "faces")
        self._beside: dict[str, Any] = {
            "attributes": dict(attributes or {}),
            "parts": tuple(parts),
            "materials": tuple(materials),
            "images": tuple(images),
            "metadata": metadata,
        }
        self._bounds, self._page, self._settings = dict(fields or {}), dict(page or {}), settings
        self._live = LiveEncoder(self.growing, self._faces, fps, CODEC, **settings)
        self._spools: dict[str, FieldSpool] | None = None
        self._view: LiveView | None = None
        self._is_shown, self._is_closed = show, False

    @property
    def n_frames(self) -> int:
        """Frames that were added."""
        return self._live.n_frames

    def add(self, positions: Any, **fields: Any) -> None:
        """Take the next frame. Arrays may be numpy's, or of PyTorch, JAX and others.

        Args:
            positions: ``(V, 3)``, model units.
            fields: numbers that change with the frames, by name: ``(V,)``, ``(V, C)``, or the same per triangle. Every frame
                has the same ones. NaN is a hole.

        Raises:
            InputError: another shape than in frame 0, other fields, a coordinate that is not finite. The frame is not taken.
            OutputError: the disk is full.
        """
        if self._is_closed:
            raise InputError(f"{self.path} is finished; start another recording for more frames")
        points = as_array(positions, f"frame {self.n_frames}")
        given = {name: as_array(values, f"field {name!r}") for name, values in fields.items()}
        spools = self._begin(points, given) if self._spools is None else self._spools
        if given.keys() != spools.keys():
            names = [", ".join(sorted(each)) or "no fields" for each in (given, spools)]
            raise InputError(f"frame {self.n_frames} has {names[0]}; frame 0 has {names[1]}, and all must have the same")
        kept = {name: spool.checked(given[name], self.n_frames) for name, spool in spools.items()}
        n_before = self._live.n_written
        self._live.append(points)
        self._spools = spools
        for name, spool in spools.items():
            spool.append(kept[name])
        if self._live.n_written > n_before:
            self._show()

    def close(self) -> None:
        """Write what is left, and let the file take its name. Without a frame no file is written.

        Raises:
            InputError: a field cannot be coded with its bound.
            OutputError: the file cannot be written; ``growing`` stays.
        """
        if self._is_closed:
            return
        self._is_closed = True
        self._live.close()
        if not self._live.n_written:
            return
        self._make_whole()
        if self._view is not None:
            self._view.finish(self.growing)
        if self.path.suffix.lower() in SUFFIXES:
            export_html(self.growing, self.path, unlimited=True, **self._page)
            os.remove(self.growing)
        else:
            os.replace(self.growing, self.path)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _begin(self, points: Array, given: Mapping[str, Array]) -> dict[str, FieldSpool]:
        """Check all that lies beside frame 0."""
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"frame 0 has shape {points.shape}; (vertices >= 1, 3) is needed")
        first = MeshSequence(points[None], self._faces, self._live.fps, name="the frames", **self._beside)
        for name in self._bounds:
            if name not in given and name not in first.attributes:
                raise InputError(f"fields has a bound of {name!r}, which frame 0 has not; it has {', '.join(given) or 'none'}")
        return {name: FieldSpool(name, values, first.rows) for name, values in given.items()}

    def _make_whole(self) -> None:
        """Code what lies beside positions into the file, and give back the room that it had to grow."""
        with Player(self.growing, unlimited=True) as player:
            whole = self._with_asset(player, self._spools or {})
        write_file(whole, self.growing, parts=segment_parts(whole))

    def _with_asset(self, player: Player, spools: Mapping[str, FieldSpool]) -> Bitstream:
        """The bitstream of a file with what lies beside its positions."""
        given = {name: spool.field() for name, spool in spools.items()}
        sequence = MeshSequence(player, self._faces, player.fps, name=str(self.path), fields=given, **self._beside)
        bounds = dict(self._bounds)
        for name, spool in spools.items():
            if spool.has_holes:
                bounds[name] = f"{bounds.get(name, '')},{KEEP_HOLES}"
        coder = AssetCoder(sequence, AssetOptions.of(None, bounds, None))
        encoded = Encoded(load(player.bitstream), np.arange(player.shape[1]))
        return coder.add(encoded, make_codec(CODEC, self._settings, ()))

    def _show(self) -> None:
        """Show what is there in a notebook."""
        if self._view is not None:
            self._view.grow()
        elif self._is_shown is not False:
            from gvpipe.recording.live_view import open_view

            self._view = open_view(self.growing, self._is_shown)
            self._is_shown = self._view is not None


def record(path: StrPath, faces: Any, fps: float = 30.0, **options: Any) -> Recorder:
    """Start a recording: ``with gvpipe.record("run.html", faces) as film: film.add(positions, stress=stress)`` in any loop.

    Args:
        path: what to write: a geometry video (``.mp4``), or a page that plays it (``.html``). An older file is replaced at the
            end.
        faces: ``(T, 3)`` triangles.
        fps: frames per second.
        options: any of these, by name:

            - ``quality``, ``segment`` and other settings of codec ``pdct``, which codes the positions
            - ``fields``: bounds of fields by name, as for `encode`
            - ``attributes``, ``parts``, ``materials``, ``images``, ``metadata``: as of `MeshSequence`
            - ``page``: how a page opens, a dict of keywords of `export_html`: ``{"field": "stress", "up": "z"}``
            - ``show``: whether a notebook shows the recording while it grows; None: if there is one

    Raises:
        InputError, SettingError: the path, an option or a setting cannot be used.
        OutputError: there is no such folder.

    Examples:
        >>> with gvpipe.record("run.html", faces, fps=60, page={"field": "stress"}) as film:  # doctest: +SKIP
        ...     for _ in range(600):
        ...         simulation.step()
        ...         film.add(simulation.positions, stress=simulation.stress)
    """
    return Recorder(path, faces, fps, **options)


def _check_target(path: Path, page: Mapping[str, Any] | None) -> None:
    suffix = path.suffix.lower()
    if suffix not in (*VIDEO_SUFFIXES, *SUFFIXES):
        raise InputError(f"{path}: a recording is a geometry video or a page; end its name in .mp4 or .html")
    if page and suffix not in SUFFIXES:
        raise InputError(f"{path} is no page, and page says how one opens; end its name in .html, or leave page out")
    check_target(path)
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder; choose another name")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: no folder {path.parent}; create it first")


def _spare_name(path: Path) -> Path:
    """A free name beside a file, for the one that grows."""
    name, number = path.with_name(f"{path.stem}.growing.mp4"), 1
    while os.path.lexists(name):
        number += 1
        name = path.with_name(f"{path.stem}.growing-{number}.mp4")
    return name
