"""What a codec is: the protocols of codecs and of their readers, and the base class of their settings.

A codec is a frozen dataclass of its settings with an ``id``, a ``summary``, ``encode`` and ``reader``. `gvpipe.registry` finds
the codecs that are installed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self, TypeVar, cast, runtime_checkable

from gvpipe.arguments import did_you_mean
from gvpipe.arrays import Float32, Int32, Integers
from gvpipe.container.bitstream import Bitstream
from gvpipe.errors import SettingError
from gvpipe.sequence import MeshSequence

Progress = Callable[[str, float], None]
"""Called with a stage's name and the part of it that is done, 0..1; stages come one after the other."""

Result = TypeVar("Result")


class Memo:
    """What encodes of one sequence share if their settings differ in quality alone.

    An encoder wraps the stages that do not look at quality: ``mesh = memo("mesh", lambda: ...)`` works it out once. What is
    kept should be small beside the sequence; frames are read again instead.

    Args:
        is_shared: whether other encodes follow, as in a search for a quality.
    """

    def __init__(self, is_shared: bool = True) -> None:
        self.is_shared = is_shared
        self._results: dict[str, Any] = {}

    def __call__(self, stage: str, work: Callable[[], Result]) -> Result:
        """Return the stage's result, from before if there is one."""
        if stage not in self._results:
            self._results[stage] = work()
        result: Result = self._results[stage]
        return result


@dataclass(frozen=True)
class Encoded:
    """What an encoder makes.

    Args:
        bitstream: for the container.
        permutation: ``(V,)`` the sequence's vertex of each vertex that decoding returns, to measure one against the other.
    """

    bitstream: Bitstream
    permutation: Integers


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

    A class attribute ``holds = True`` keeps repeated frames away from it (`gvpipe.repeated_frames`); its ``version`` then knows
    of them.
    """

    id: ClassVar[str]
    version: ClassVar[int]
    summary: ClassVar[str]

    @property
    def quality(self) -> float:
        """0..100, higher is better; bytes and error follow it monotonically."""
        ...

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Encoded:
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


class BaseCodec(Settings):
    """Base of codecs' dataclasses: what every encode begins and ends with."""

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Encoded:
        """Code a sequence.

        Raises:
            InputError: a frame cannot be read, or what else the codec refuses.
        """
        return self._encode(sequence, progress or _silent, memo or Memo(is_shared=False))

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        raise NotImplementedError

    def _bitstream(
        self,
        sequence: MeshSequence,
        header: Mapping[str, Any],
        sections: Mapping[str, bytes],
        video: bytes = b"",
        version: int | None = None,
    ) -> Bitstream:
        """The bitstream of a sequence; ``version`` is the oldest that reads it, None for the codec's own."""
        codec = cast("type[Codec]", type(self))
        return Bitstream(
            codec=codec.id,
            version=codec.version if version is None else version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(sequence.faces),
            fps=float(sequence.fps),
            header=dict(header),
            sections=dict(sections),
            video=video,
        )


def _silent(stage: str, done: float) -> None:
    """Progress that nobody follows."""


def check_name(key: str, names: Iterable[str], also: Iterable[str] = ()) -> None:
    """Raise `SettingError` unless ``key`` is one of the settings' names; it may have been meant for one of ``also``."""
    if key not in names:
        raise SettingError(f"no setting {key!r}; there are {', '.join(names)}{did_you_mean(key, [*names, *also])}")


def _parse(key: str, text: str, kind: type) -> Any:
    if kind is bool:
        if text.lower() not in ("true", "false", "1", "0", "yes", "no"):
            raise SettingError(f"{key} is {text!r}; true or false is needed")
        return text.lower() in ("true", "1", "yes")
    try:
        return kind(text)
    except ValueError as exc:
        raise SettingError(f"{key} is {text!r}; {'an integer' if kind is int else 'a number'} is needed") from exc
