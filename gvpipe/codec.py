"""What a codec is, and how gvpipe finds them.

A codec is a frozen dataclass of its settings with an ``id``, a ``summary``, ``encode`` and ``reader``. Packages register
theirs as an entry point in the group ``gvpipe.codecs``; nothing is imported before it is asked for by id.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar, Protocol, Self, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gvpipe.arguments import did_you_mean
from gvpipe.bitstream import Bitstream
from gvpipe.corrections import correct
from gvpipe.errors import NewerVersion, SettingError
from gvpipe.holds import HeldReader, add_holds, find_holds, read_holds
from gvpipe.sequence import Float32, Int32, MeshSequence

GROUP = "gvpipe.codecs"

Progress = Callable[[str, float], None]
"""Called with a stage's name and the part of it that is done, 0..1; stages come one after the other."""

Result = TypeVar("Result")


class Memo:
    """What encodes of one sequence share if their settings differ in quality alone.

    An encoder wraps the stages that do not look at quality: ``mesh = memo("mesh", lambda: ...)`` works it out once. What is
    kept should be small beside the sequence; frames are read again instead.

    `permutation` ``(V,)`` is the encoder's to set: the sequence's vertex for each vertex that the reader will return, so that
    the result can be measured against its source.
    """

    def __init__(self) -> None:
        self._results: dict[str, Any] = {}
        self.permutation: NDArray[np.integer] | None = None

    def __call__(self, stage: str, work: Callable[[], Result]) -> Result:
        """Return the stage's result, from before if there is one."""
        if stage not in self._results:
            self._results[stage] = work()
        result: Result = self._results[stage]
        return result


@runtime_checkable
class LevelReader(Protocol):
    """What a frame reader offers beside if its codec has levels of detail: coarser meshes of the same motion."""

    @property
    def levels(self) -> list[int]:
        """Vertex counts of the levels, level 0 (the mesh itself) first."""
        ...

    def level_faces(self, lod: int) -> Int32:
        """``(n, 3) int32`` triangles of a level, in the order of the vertices that `read` returns for it."""
        ...

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames of a level: ``(stop - start, its vertices, 3) float32``; decodes only what the level needs."""
        ...


@runtime_checkable
class GroupReader(Protocol):
    """What a frame reader offers beside if its codec decodes several frames at the price of one."""

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the frames that are best read together with a frame, itself among them."""
        ...


class FrameReader(Protocol):
    """Frames of one bitstream; keeps no more than the last group of them."""

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        ...

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles, in the order of the vertices that `read` returns."""
        ...

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units; decodes no more than it must."""
        ...


@runtime_checkable
class Codec(Protocol):
    """A codec's settings, and what it does with them.

    A class attribute ``holds = True`` keeps repeated frames away from it (`gvpipe.holds`); its ``version`` then knows of them.
    """

    id: ClassVar[str]
    version: ClassVar[int]
    summary: ClassVar[str]

    @property
    def quality(self) -> float:
        """0..100, higher is better; bytes and error follow it monotonically."""
        ...

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Bitstream:
        """Code a sequence; ``memo`` is shared with encodes of the same sequence at another quality."""
        ...

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a bitstream that this codec wrote, by what it holds alone."""
        ...


class Settings:
    """Base of codecs' dataclasses: turns texts into settings, and checks ranges."""

    @classmethod
    def from_texts(cls, texts: Mapping[str, str]) -> Self:
        """Build the settings from ``KEY=VALUE`` texts; raises `SettingError` naming key, value and what is allowed."""
        fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]  # subclasses are dataclasses
        values: dict[str, Any] = {}
        for key, text in texts.items():
            check_name(key, fields)
            values[key] = _parse(key, text, type(fields[key].default))
        return cls(**values)

    def check_range(self, low: float, high: float, *names: str) -> None:
        """Raise `SettingError` unless the named settings lie in ``low..high``; integers must be integers."""
        for name in names:
            value = getattr(self, name)
            default = getattr(type(self), name)
            wrong = isinstance(value, bool) or not isinstance(value, int if isinstance(default, int) else int | float)
            if wrong or not low <= value <= high:
                kind = "an integer" if isinstance(default, int) else "a number"
                raise SettingError(f"{name} is {value!r}; {kind} in {low}..{high} is needed")

    def check_choice(self, name: str, choices: tuple[str, ...]) -> None:
        """Raise `SettingError` unless the named setting is one of ``choices``."""
        if getattr(self, name) not in choices:
            value = getattr(self, name)
            raise SettingError(f"{name} is {value!r}; one of {', '.join(choices)} is needed{did_you_mean(value, choices)}")


def make_codec(codec: str, settings: Mapping[str, Any], also: Iterable[str] = ()) -> Codec:
    """Return a codec's settings object; raises `SettingError` for an unknown one, naming the nearest of these and ``also``."""
    chosen = codec_class(codec)
    names = [field.name for field in dataclasses.fields(chosen)]
    for key in settings:
        check_name(key, names, also)
    made: Codec = chosen(**settings)
    return made


def check_name(key: str, names: Iterable[str], also: Iterable[str] = ()) -> None:
    """Raise `SettingError` unless ``key`` is one of the settings' names; it may have been meant for one of ``also``."""
    if key not in names:
        raise SettingError(f"no setting {key!r}; there are {', '.join(names)}{did_you_mean(key, [*names, *also])}")


def codec_ids() -> list[str]:
    """Ids of the codecs that are installed, sorted."""
    return sorted(_entries())


@functools.cache
def codec_class(codec: str) -> type[Any]:
    """Return the class of the codec with that id; raises `SettingError` if there is none."""
    if codec not in _entries():
        raise SettingError(f"no codec {codec!r}; there are {', '.join(codec_ids())}{did_you_mean(codec, codec_ids())}")
    loaded: type[Any] = _entries()[codec].load()
    return loaded


def open_reader(bitstream: Bitstream) -> FrameReader:
    """Open a bitstream with the codec that wrote it: its frames corrected (`gvpipe.corrections`), then held (`gvpipe.holds`).

    Raises:
        NewerVersion: no installed codec has that id, or only an older version of it.
        CorruptFile: its sections are not what that codec writes.
    """
    if bitstream.codec not in _entries():
        raise NewerVersion(f"it was made by codec {bitstream.codec!r}, which this gvpipe does not have; upgrade gvpipe")
    codec = codec_class(bitstream.codec)
    if bitstream.version > codec.version:
        raise NewerVersion(
            f"it was made by version {bitstream.version} of codec {bitstream.codec!r}, this gvpipe has version "
            f"{codec.version}; upgrade gvpipe"
        )
    holds = read_holds(bitstream) if _is_held(codec) else None
    distinct = bitstream if holds is None else dataclasses.replace(bitstream, n_frames=holds.n_distinct)
    reader = correct(distinct, codec.reader(distinct))
    return reader if holds is None else HeldReader(reader, holds)


def encode_sequence(
    codec: Codec, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None
) -> Bitstream:
    """Code a sequence; where the codec lets it (`gvpipe.holds`), frames that repeat the one before are coded by a run length.

    Raises:
        InputError: what the codec raises.
    """
    holds = (memo or Memo())("holds", lambda: find_holds(sequence)) if _is_held(codec) else None
    if holds is None:
        return codec.encode(sequence, progress, memo)
    return add_holds(codec.encode(holds.distinct(sequence), progress, memo), holds, codec.version)


@functools.cache
def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _is_held(codec: Codec | type[Any]) -> bool:
    """Whether repeated frames are coded around the codec."""
    return bool(getattr(codec, "holds", False))


def _parse(key: str, text: str, kind: type) -> Any:
    if kind is bool:
        if text.lower() not in ("true", "false", "1", "0", "yes", "no"):
            raise SettingError(f"{key} is {text!r}; true or false is needed")
        return text.lower() in ("true", "1", "yes")
    try:
        return kind(text)
    except ValueError as exc:
        raise SettingError(f"{key} is {text!r}; {'an integer' if kind is int else 'a number'} is needed") from exc
