"""What a codec is: the protocols of codecs and of their readers, and the base class of their settings.

A codec is a frozen dataclass of its settings with an ``id``, a ``summary``, ``encode`` and ``reader``. `gvpipe.coding.registry`
finds the codecs that are installed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from inspect import get_annotations
from types import FunctionType
from typing import Any, ClassVar, Protocol, Self, TypeVar, cast, runtime_checkable

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.outline import Outline
from gvpipe.container.segments import SegmentParts
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Float32, Int32, Integers
from gvpipe.foundation.errors import SettingError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin
from gvpipe.runtime.blas import one_blas_thread

Result = TypeVar("Result")
OWN = ("id", "version", "summary", "reader")  # what each codec gives


class Memo:
    """Results that do not depend on quality, kept by name between encodes of one sequence with otherwise equal settings.

    An encoder wraps each such stage. Results should be small beside the sequence; frames are read again instead.

    Args:
        is_shared: whether other encodes follow, as in a search for a quality.

    Examples:
        >>> memo = Memo()
        >>> memo("mesh", lambda: "made"), memo("mesh", lambda: "made again")
        ('made', 'made')
    """

    def __init__(self, is_shared: bool = True) -> None:
        self.is_shared = is_shared
        self._results: dict[str, Any] = {}

    def __call__(self, stage: str, work: Callable[[], Result]) -> Result:
        """Return the stage's result: that of its first call, or of ``work`` if this is the first."""
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
    """A frame reader whose codec has levels of detail: coarser meshes of the same motion."""

    @property
    def levels(self) -> list[int]:
        """Number of vertices of each level, level 0 (the mesh itself) first."""
        ...

    def level_faces(self, lod: int) -> Int32:
        """Return the triangles of a level: ``(n, 3) int32``, indices of the vertices that `read` returns for it."""
        ...

    def level_points(self, lod: int) -> tuple[Int32, Int32]:
        """Return the point of each vertex of level 0, ``(V,) int32``, and that of each vertex of a level above, ascending."""
        ...

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames of a level: ``(stop - start, levels[lod], 3) float32``, model units; decodes only what it needs."""
        ...


class LiveCoder(Protocol):
    """Codes frames whose number is not known, a clip at a time (`gvpipe.playback.live`).

    A codec that can do so has a method ``start_live(frame (V, 3), faces (T, 3), fps) -> LiveCoder``, given frame 0.
    """

    name: ClassVar[str]  # of a clip's section, before a dot and its number
    most_clips: ClassVar[int]
    bitstream: Bitstream  # of what all clips share

    @property
    def clip_frames(self) -> int:
        """Frames of each clip but the last."""
        ...

    def encode(self, frames: Float32) -> bytes:
        """Return the section of a clip, ``frames (n, V, 3)``, model units."""
        ...


@runtime_checkable
class GroupReader(Protocol):
    """A frame reader whose codec decodes a group of frames at the price of one."""

    def group(self, frame: int) -> tuple[int, int]:
        """Return ``(start, stop)`` of the group that a frame is in."""
        ...


@runtime_checkable
class ClosableReader(Protocol):
    """A frame reader that keeps pictures."""

    def close(self) -> None:
        """Let go of decoded pictures; they come back when they are needed."""
        ...


class FrameReader(Protocol):
    """Frames of one bitstream; keeps no more than the last group of them."""

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        ...

    @property
    def faces(self) -> Int32:
        """Triangles ``(T, 3) int32``, indices of the vertices that `read` returns."""
        ...

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units; decodes no more than it must.

        Raises:
            CorruptFile: a section is not what the codec writes.
        """
        ...


@runtime_checkable
class Codec(Protocol):
    """A codec's settings, and what it does with them; see `BaseCodec`, which has defaults for most of it."""

    id: ClassVar[str]
    version: ClassVar[int]
    summary: ClassVar[str]
    holds: ClassVar[bool]
    same_bits: ClassVar[bool]
    maps_segments: ClassVar[bool]
    memory_factor: ClassVar[float | None]
    seconds_per_vertex: ClassVar[float]
    has_levels: ClassVar[bool]
    codes_live: ClassVar[bool]
    competes: ClassVar[bool]
    effort: ClassVar[float]
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]

    @property
    def quality(self) -> float:
        """0..100: names the target error (`gvpipe.coding.quality_scale`); bytes rise with it, the error falls."""
        ...

    @property
    def is_cheap_again(self) -> bool:
        """Whether an encode at another quality, with the memo of the first, takes a tenth of its time or so."""
        ...

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Encoded:
        """Code a sequence.

        Args:
            sequence: to code.
            progress: called with each stage and the part of it that is done.
            memo: shared with encodes of the same sequence at other qualities.

        Raises:
            InputError: a frame cannot be read, or what else the codec refuses.
        """
        ...

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a bitstream that this codec wrote, by its contents alone; raises `CorruptFile`."""
        ...

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """Return what keeps browsers from playing a bitstream of this codec, in a few words; ``""`` if they play it."""
        ...

    @classmethod
    def skin(cls, bitstream: Bitstream) -> Skin | None:
        """Return the skeleton that moves a bitstream's vertices, as far as it goes; None: it has none; raises `CorruptFile`."""
        ...

    def find_skin(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Skin | None:
        """Return joints and weights that would leave about the error of its quality; nothing is coded. None: it has none.

        Arguments are those of `encode`. Joints rest: their transforms are for others to fit, from the first frame as bind pose.
        """
        ...

    def estimate_bytes(
        self, sequence: MeshSequence, most: float, progress: Progress | None = None, memo: Memo | None = None
    ) -> float | None:
        """Return about the bytes of a file that leaves the error of its quality, by a part of the work; nothing is written.

        Args:
            sequence, progress: as of `encode`.
            most: where it is clear that the file takes more, any number above will do.
            memo: shared with estimates of the same sequence by this codec at other settings: names should tell them apart.

        Returns:
            The bytes, or None: no such estimate. ``--codec auto`` then encodes the first frames.

        Raises:
            InputError: as `encode` does.
        """
        ...

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """Return what each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        ...

    def start_live(self, frame: Float32, faces: Int32, fps: float) -> LiveCoder:
        """Begin to code frames ``(V, 3)`` that come one by one, where ``codes_live``; ``frame`` is the first."""
        ...


class BaseCodec:
    """Base of codecs: frozen dataclasses of settings.

    A codec gives ``id``, ``version`` and ``summary`` as class attributes, and the methods `_encode` and `reader`. All else has
    a default here. A class attribute or class method whose name is nearly one of these is refused: misspelt, it would change
    nothing.

    Attributes:
        holds: it never sees repeated frames: run lengths around it code them (`gvpipe.coding.repeated_frames`).
        same_bits: all machines decode the same positions, to the bit.
        maps_segments: its segments are coded by `gvpipe.runtime.segment_map.map_segments`, which may do it elsewhere.
        memory_factor: memory that encoding a segment takes, for each byte of its positions as float32
            (`gvpipe.coding.segment_memory`); None: it takes all frames at a time.
        seconds_per_vertex: that its reader asks for (`gvpipe.foundation.budget`), at least.
        has_levels: its files have levels of detail.
        codes_live: it codes frames as they come (`start_live`).
        competes: ``--codec auto`` takes it into account, where it is installed.
        effort: time that it takes to encode, in encodes of ``mcgv``, about; ``--codec auto`` begins with the least.
    """

    id: ClassVar[str]
    version: ClassVar[int]
    summary: ClassVar[str]
    holds: ClassVar[bool] = False
    same_bits: ClassVar[bool] = True
    maps_segments: ClassVar[bool] = False
    memory_factor: ClassVar[float | None] = None
    seconds_per_vertex: ClassVar[float] = 12e-6
    has_levels: ClassVar[bool] = False
    codes_live: ClassVar[bool] = False
    competes: ClassVar[bool] = True
    effort: ClassVar[float] = 1.0

    @property
    def is_cheap_again(self) -> bool:
        """Whether another encode takes little; see `Codec.is_cheap_again`. Here: no."""
        return False

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        settings = {name for name, kind in get_annotations(cls).items() if "ClassVar" not in str(kind)}
        known = [*OWN, *(name for name in vars(BaseCodec) if not name.startswith("_"))]
        for name, value in vars(cls).items():
            is_own = name.startswith("_") or name in settings or isinstance(value, FunctionType | property)
            hint = "" if is_own or name in known else did_you_mean(name, known)
            if hint:
                raise TypeError(f"{cls.__qualname__}.{name} means nothing to gvpipe{hint}")

    @one_blas_thread  # quicker, and the same bytes whatever the number of cores
    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Encoded:
        """Code a sequence; see `Codec.encode`."""
        return self._encode(sequence, progress or silent, memo or Memo(is_shared=False))

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing its files; see `Codec.browser_obstacle`. Here: their player lacks the codec."""
        return bitstream.codec

    @classmethod
    def skin(cls, bitstream: Bitstream) -> Skin | None:
        """The skeleton of its files; see `Codec.skin`. Here: none."""
        return None

    def find_skin(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Skin | None:
        """Joints and weights for a sequence; see `Codec.find_skin`. Here: none."""
        return None

    @one_blas_thread
    def estimate_bytes(
        self, sequence: MeshSequence, most: float, progress: Progress | None = None, memo: Memo | None = None
    ) -> float | None:
        """About the bytes of a file; see `Codec.estimate_bytes`. Here: what `_estimate` gives, by default None."""
        return self._estimate(sequence, most, progress or silent, memo or Memo())

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each segment has; see `Codec.segment_parts`. Here: nothing of its own."""
        return SegmentParts()

    def start_live(self, frame: Float32, faces: Int32, fps: float) -> LiveCoder:
        """Begin to code frames as they come; see `Codec.start_live`."""
        raise NotImplementedError

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

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        raise NotImplementedError

    def _estimate(self, sequence: MeshSequence, most: float, report: Progress, memo: Memo) -> float | None:
        return None

    def _bitstream(
        self,
        sequence: MeshSequence,
        header: Mapping[str, Any],
        sections: Mapping[str, bytes],
        video: bytes = b"",
        levels: tuple[int, ...] = (),
    ) -> Bitstream:
        """The bitstream of a sequence.

        Args:
            sequence: that is coded.
            header, sections, video: as of `Bitstream`.
            levels: vertex counts of the levels of detail from level 1 on.
        """
        codec = cast("type[Codec]", type(self))
        return Bitstream(
            codec=codec.id,
            version=codec.version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(sequence.faces),
            fps=float(sequence.fps),
            header=dict(header),
            sections=dict(sections),
            outline=Outline.around(sequence.read(0, 1)[0], levels),
            video=video,
        )


Settings = BaseCodec
"""The name that the base class had when it was of settings alone."""


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
