"""The mesh animation that every part of gvpipe works on.

A `MeshSequence` has constant connectivity and moving vertices. Its positions may be an array in memory, a memory
map or frames that load when they are read, so nothing here touches more frames than it is asked for.

Positions are float32 relative to an origin in float64 (`gvpipe.model.origin`). Where an array in memory holds more digits than
that, it is kept beside, so that errors are measured against what was given and not against its rounding.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.asset.attribute import as_attribute, check_text
from gvpipe.asset.field import as_field
from gvpipe.asset.material import Image, Material, check_materials
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.asset.part import Part, check_parts
from gvpipe.asset.polygons import as_polygons
from gvpipe.asset.texts import Cleaner
from gvpipe.foundation.arguments import check_number, show
from gvpipe.foundation.arrays import Array, Float32, Float64, Floats, Frames, Int32, Integers
from gvpipe.foundation.errors import InputError, printable
from gvpipe.foundation.notes import ASSUMED_FPS, count, show_origin
from gvpipe.grids.volume import Volume
from gvpipe.media.sound import Sound
from gvpipe.model.frame_views import Guarded, Narrowed, Permuted, Shifted, Span, Watched
from gvpipe.model.origin import as_origin, choose_origin, narrow, rounding
from gvpipe.model.shown import ShownInNotebooks

BARE: dict[str, Any] = {
    "attributes": {},
    "fields": {},
    "parts": (),
    "polygons": None,
    "materials": (),
    "images": (),
    "volume": None,
    "sound": None,
}
CHUNK_BYTES = 4 << 20  # positions handed out at a time by `chunks`: large enough to vectorise, small beside any budget


@dataclass(frozen=True, eq=False, repr=False)
class MeshSequence(ShownInNotebooks):
    """A triangle-mesh animation with constant connectivity.

    It slices by frame as `gvpipe.Player` does: ``sequence[3]`` is ``(V, 3) float32``, ``sequence[2:5]`` is ``(3, V, 3)``, both
    relative to the origin; `part` makes a sequence of some frames.

    Args:
        positions: ``(F, V, 3) float32``, model units, relative to the origin; an array, or anything of that shape that slices
            by frame. An array or dataset of float64 is rounded, relative to an origin where float32 would lose its shape;
            it is kept to measure errors against, so it must not change afterwards.
        faces: ``(T, 3) int32``, counter-clockwise seen from outside.
        fps: frames per second.
        attributes: static numbers by name, as arrays or `gvpipe.Attribute`; here they are `gvpipe.Attribute`. An array has
            one row per vertex, per corner (``3 T``) or per triangle: ``uv (V, 2)``, ``normal (V, 3)``, ``color (V, 4) uint8``.
        name: where the sequence came from, for messages.
        origin: ``(3,) float64``, model units: what to add to positions; 0 unless the mesh is far from there for its size.
        notes: what a reader did that its user should know, a line each.
        fields: animated numbers by name, as arrays ``(F, V)``, ``(F, V, C)`` or the same per triangle, or `gvpipe.Field`.
        parts: the named meshes that it consists of, whose triangles follow each other; none: one mesh without a name.
        polygons: ``(P,)`` corners of each polygon, whose fans are the triangles, in order; None: all are triangles.
        materials: what the parts look like.
        images: what the materials' textures show.
        metadata: up axis, unit, start time, source, texts.
        not_carried: what the source has and the sequence has not, by name.
        volume: what lies inside of the surface, of a simulation.
        sound: what is heard with it (`gvpipe.read_sound`); second 0 is frame 0.

    Raises:
        InputError: a wrong shape, no frame, no vertex, an index out of range, an fps that is not a positive number, a
            position in memory that is not finite (frames that load later are checked when they load), an image that is none.
        TypeError: positions, faces, fps, attributes or fields are of no such type.

    Examples:
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> sequence = MeshSequence(np.array([corners, np.add(corners, [0, 0, 0.5])]), np.array([[0, 1, 2]]), fps=25)
        >>> sequence
        <MeshSequence sequence: 2 frames of 3 vertices, 1 triangle, 25 fps>
        >>> sequence[1][:, 2].tolist()  # z of the second frame's vertices
        [0.5, 0.5, 0.5]
        >>> sequence.part(1, 2).shape
        (1, 3, 3)
    """

    positions: Frames
    faces: Int32
    fps: float = 30.0
    attributes: Mapping[str, Any] = field(default_factory=dict)
    name: str = "sequence"
    origin: Float64 = field(default_factory=lambda: np.zeros(3))
    notes: tuple[str, ...] = ()
    fields: Mapping[str, Any] = field(default_factory=dict)
    parts: tuple[Part, ...] = ()
    polygons: Int32 | None = None
    materials: tuple[Material, ...] = ()
    images: tuple[Image, ...] = ()
    metadata: Metadata = NO_METADATA
    not_carried: tuple[str, ...] = ()
    volume: Volume | None = None
    sound: Sound | None = None
    _exact: Frames | None = field(default=None, init=False)  # absolute; what float32 rounded
    _rounding: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", as_origin(self.origin, self.name))
        given: Any = self.positions
        if isinstance(given, list | tuple):
            given = np.asarray(given)
        if isinstance(given, np.ndarray):
            self._narrow(given)
        elif not hasattr(given, "shape") or not hasattr(given, "__getitem__"):
            raise TypeError(f"positions are {show(given)}; an array of shape (frames, vertices, 3) is needed")
        elif getattr(given, "dtype", None) == np.float64 and len(given.shape) == 3 and min(given.shape) > 0:
            self._narrow_lazily(given)
        check_number(self.fps, "fps")
        object.__setattr__(self, "fps", float(self.fps))
        object.__setattr__(self, "notes", tuple(map(printable, self.notes)))
        shape = tuple(self.positions.shape)
        if len(shape) != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] < 1:
            raise InputError(f"{self.name}: positions have shape {shape}; (frames >= 1, vertices >= 1, 3) is needed")
        object.__setattr__(self, "faces", _as_faces(self.faces, shape[1], self.name))
        if not (np.isfinite(self.fps) and 0 < self.fps <= 100_000):
            raise InputError(f"{self.name}: fps is {self.fps}; a number above 0 and up to 100000 is needed")
        self._check_asset()

    def _check_asset(self) -> None:
        """Check what lies beside the positions; attributes and fields become `Attribute` and `Field`."""
        for what, example in (("attributes", "{'uv': uv}"), ("fields", "{'stress': stress}")):
            if not isinstance(getattr(self, what), Mapping):
                raise TypeError(f"{what} are {show(getattr(self, what))}; arrays by name are needed, such as {example}")
            for name in getattr(self, what):
                check_text(name, f"a name of {what}")
        if not isinstance(self.metadata, Metadata):
            raise TypeError(f"metadata is {show(self.metadata)}; a gvpipe.Metadata is needed")
        if self.sound is not None and not isinstance(self.sound, Sound):
            raise TypeError(f"sound is {show(self.sound)}; a gvpipe.Sound is needed, as of gvpipe.read_sound")
        for image in self.images:
            if not isinstance(image, Image):
                raise TypeError(f"an image is {show(image)}; a gvpipe.Image is needed")
            if image.pictures is not None and len(image.pictures) != self.n_frames:
                raise InputError(
                    f"{self.name}: moving image {image.name!r} has {len(image.pictures)} pictures, the sequence has "
                    f"{self.n_frames} frames; give one picture for each frame"
                )
        if self.volume is not None:
            self.volume.check_surface(self.n_frames, self.n_vertices, self.name)
        cleaner = Cleaner(self.name)
        images = tuple(map(cleaner.image, self.images))
        materials = check_materials(tuple(map(cleaner.material, self.materials)), len(images), self.name)
        given_parts = tuple(map(cleaner.part, self.parts))
        parts = check_parts(given_parts, self.faces, self.n_vertices, len(materials), self.name)
        checked = {
            "metadata": cleaner.metadata(self.metadata),
            "materials": materials,
            "images": images,
            "parts": parts,
            "polygons": None if self.polygons is None else as_polygons(self.polygons, self.faces, parts, self.name),
        }
        for key, value in checked.items():
            object.__setattr__(self, key, value)
        named = cleaner.by_name(self.attributes, "attributes").items()
        attributes = {key: cleaner.unit(as_attribute(key, given, self.rows, self.name)) for key, given in named}
        object.__setattr__(self, "attributes", attributes)
        moving = cleaner.by_name(self.fields, "fields").items()
        fields = {key: cleaner.unit(as_field(key, given, self.n_frames, self.rows, self.name)) for key, given in moving}
        object.__setattr__(self, "fields", fields)
        object.__setattr__(self, "notes", (*self.notes, *cleaner.notes))

    def _narrow(self, positions: Array) -> None:
        """Round an array in memory, keep it if that lost anything, and find its origin."""
        narrowed, origin = _as_positions(positions, self.name)
        given = self.origin
        object.__setattr__(self, "positions", narrowed)
        object.__setattr__(self, "origin", given + origin)
        lost = rounding(positions, narrowed, origin) if narrowed.ndim == 3 else 0.0
        if lost:
            object.__setattr__(self, "_exact", Shifted(positions, given) if given.any() else positions)
            object.__setattr__(self, "_rounding", lost)

    def _narrow_lazily(self, positions: Frames) -> None:
        """The same for a dataset that slices, as of HDF5 or Zarr; its origin is that of its first frame."""
        given, origin = self.origin, choose_origin(np.asarray(positions[0:1]))
        object.__setattr__(self, "positions", Narrowed(positions, origin))
        object.__setattr__(self, "origin", given + origin)
        object.__setattr__(self, "_exact", Shifted(positions, given) if given.any() else positions)

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return int(self.positions.shape[0])

    @property
    def n_vertices(self) -> int:
        """V, the number of vertices."""
        return int(self.positions.shape[1])

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (self.n_frames, self.n_vertices, 3)

    @property
    def rows(self) -> dict[str, int]:
        """How many rows an attribute has on each domain (`gvpipe.asset.attribute.DOMAINS`)."""
        n_triangles = len(self.faces)
        return {"vertex": self.n_vertices, "corner": 3 * n_triangles, "triangle": n_triangles, "part": len(self.parts)}

    def __len__(self) -> int:
        return self.n_frames

    def __getitem__(self, key: int | slice, /) -> Float32:
        if not isinstance(key, slice):
            index = operator.index(key)
            if not -len(self) <= index < len(self):
                raise IndexError(f"frame {index} of {self.name}: there are {len(self)}")
            frame: Float32 = self.read(index % len(self), index % len(self) + 1)[0]
            return frame
        start, stop, step = key.indices(len(self))
        if step == 1:
            return self.read(start, max(start, stop))
        frames = [self[i] for i in range(start, stop, step)]
        return np.stack(frames) if frames else self.read(0, 0)

    def __iter__(self) -> Iterator[Float32]:
        for _, block in self.chunks():
            yield from block

    def __repr__(self) -> str:
        return f"<MeshSequence {self.name}: {describe(self)}>"

    def _repr_html_(self) -> str:
        from gvpipe.model.notebook import card

        return card(self.name, numbers_of(self), self)

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units, relative to the origin.

        Raises:
            InputError: a position is NaN or infinite; the message names frame and vertex.
        """
        block = np.asarray(self.positions[start:stop], dtype=np.float32)
        if type(self.positions) is not np.ndarray:
            check_finite(block, self.name, start)
        return block

    def read_exact(self, start: int, stop: int) -> Float64:
        """Return the same in float64, ``(stop - start, V, 3)``, with all digits that were given; raises `InputError`."""
        if self._exact is None:
            return self.read(start, stop).astype(np.float64)
        return self.read_absolute(start, stop) - self.origin

    def read_absolute(self, start: int, stop: int) -> Float64:
        """Return frames with the origin added: ``(stop - start, V, 3) float64``, model units; raises `InputError`."""
        if self._exact is None:
            return self.read(start, stop) + self.origin
        block = np.asarray(self._exact[start:stop], dtype=np.float64)
        if type(self._exact) is not np.ndarray:
            check_finite(block, self.name, start)
        return block

    @property
    def rounding(self) -> float:
        """The largest rounding of a coordinate to float32, model units; of frames that load later, those that have loaded."""
        return max(self._rounding, float(getattr(self.positions, "rounding", 0.0)))

    @property
    def times(self) -> Float64:
        """``(F,) float64`` seconds of the frames: those that `metadata` tells, else by the rate."""
        return self.metadata.frame_times(self.n_frames, self.fps)

    def reordered(self, permutation: Integers, faces: Int32) -> MeshSequence:
        """Return the sequence whose vertex i is this one's vertex ``permutation[i]``; frames still load when read.

        Args:
            permutation: ``(V,)`` vertex indices.
            faces: ``(T, 3) int32`` triangles, in the new order.
        """
        exact = None if self._exact is None else Permuted(self.read_absolute, len(self), permutation)
        return self._derived(Permuted(self.read, len(self), permutation), exact, **BARE, faces=faces)

    def bare(self) -> MeshSequence:
        """Return the positions, triangles and fps alone, without anything that lies beside them."""
        return self._derived(self.positions, self._exact, **BARE)

    def part(self, start: int, stop: int) -> MeshSequence:
        """Return frames ``start`` to ``stop`` as a sequence with all that lies beside them; they still load when read."""
        size = stop - start, self.n_vertices
        exact = None if self._exact is None else Span(self.read_absolute, start, *size)
        fields = {name: each.part(start, stop) for name, each in self.fields.items()}
        metadata = self.metadata.of_frames(start, stop, self.n_frames, self.fps)
        volume = None if self.volume is None else self.volume.part(start, stop)
        images = tuple(image.part(start, stop) for image in self.images)
        beside: dict[str, Any] = {"fields": fields, "images": images, "metadata": metadata, "volume": volume}
        beside["sound"] = self.sound_of(start, stop)
        return self._derived(Span(self.read, start, *size), exact, **beside)

    def sound_of(self, start: int, stop: int) -> Sound | None:
        """What is heard with frames ``start`` to ``stop``; with the last one, all that follows."""
        end = None if stop >= self.n_frames else stop / self.fps
        return None if self.sound is None else self.sound.part(start / self.fps, end)

    def local(self) -> MeshSequence:
        """Return the sequence with its origin left out: the same float32 positions, relative to nothing."""
        return replace(self, origin=np.zeros(3))

    def with_fps(self, fps: float) -> MeshSequence:
        """Return the sequence at another frame rate."""
        kept = tuple(note for note in self.notes if note != ASSUMED_FPS)
        return self._derived(self.positions, self._exact, fps=fps, notes=kept)

    def with_looks(
        self, materials: tuple[Material, ...], images: tuple[Image, ...], parts: tuple[Part, ...] | None = None
    ) -> MeshSequence:
        """Return the sequence with other materials and images, and with other parts if they are given."""
        shown = self.parts if parts is None else parts
        return self._derived(self.positions, self._exact, materials=materials, images=images, parts=shown)

    def with_sound(self, sound: Sound | None, notes: tuple[str, ...] = ()) -> MeshSequence:
        """Return the sequence with another sound or none, and more notes."""
        return self._derived(self.positions, self._exact, sound=sound, notes=(*self.notes, *notes))

    def watched(self, told: Callable[[int], None]) -> MeshSequence:
        """Return the same sequence, which calls ``told`` with the frame after the last of those that are read, for progress."""
        size = self.n_frames, self.n_vertices
        exact = None if self._exact is None else Watched(self.read_absolute, *size, told)
        return self._derived(Watched(self.read, *size, told), exact)

    def guarded(self, guard: Callable[[], AbstractContextManager[None]], **changes: Any) -> MeshSequence:
        """Return the same sequence with other notes, say; frames that are not in memory are read inside ``guard()``."""
        if type(self.positions) is np.ndarray:
            return self._derived(self.positions, self._exact, **changes)
        given = self.n_frames, self.n_vertices, guard, lambda: self.rounding
        exact = None if self._exact is None else Guarded(self.read_absolute, *given)
        return self._derived(Guarded(self.read, *given), exact, **changes)

    def reading_from(self, positions: Frames, exact: Frames | None, **changes: Any) -> MeshSequence:
        """Return the same sequence, whose frames come from elsewhere.

        Args:
            positions: ``(F, V, 3) float32``, relative to the origin.
            exact: the same in float64, with the origin added, if `is_rounded`.
            changes: of what lies beside.
        """
        return self._derived(positions, exact, **changes)

    @property
    def is_rounded(self) -> bool:
        """Whether `read_absolute` has more digits than `read`."""
        return self._exact is not None

    def _derived(self, positions: Frames, exact: Frames | None, **changes: Any) -> MeshSequence:
        result = replace(self, positions=positions, **changes)
        object.__setattr__(result, "_exact", exact)
        object.__setattr__(result, "_rounding", self._rounding)
        return result

    def chunks(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, Float32]]:
        """Yield ``(first frame, (n, V, 3) float32)`` over all frames, a bounded number of bytes at a time."""
        return ((first, self.read(first, last)) for first, last in self.spans(start, stop))

    def exact_chunks(self) -> Iterator[tuple[int, Float64]]:
        """The same, by `read_exact`."""
        return ((first, self.read_exact(first, last)) for first, last in self.spans())

    def spans(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, int]]:
        """Yield ``(start, stop)`` of all frames, a bounded number of bytes at a time."""
        stop = self.n_frames if stop is None else stop
        step = max(1, CHUNK_BYTES // (12 * self.n_vertices))
        return ((first, min(first + step, stop)) for first in range(start, stop, step))

    def sample(self, most: int, vertices: Integers | slice = slice(None)) -> Float64:
        """Return vertices of at most ``most`` frames, evenly spaced from first to last: ``(n, vertices, 3)``, model units."""
        return np.stack([frame[vertices] for frame in self.sampled_frames(most)]).astype(np.float64)

    def sampled_frames(self, most: int) -> Iterator[Float32]:
        """Yield the same frames one by one: ``(V, 3) float32``."""
        for i in np.unique(np.linspace(0, self.n_frames - 1, most).astype(int)):
            yield self.read(i, i + 1)[0]


def describe(sequence: MeshSequence) -> str:
    """``24 frames of 300 vertices, 596 triangles, 30 fps``."""
    vertices = count(sequence.n_vertices, "vertex", "vertices")
    parts = [f"{count(sequence.n_frames, 'frame')} of {vertices}", count(len(sequence.faces), "triangle")]
    parts.append(f"{sequence.fps:g} fps")
    if sequence.origin.any():
        parts.append(f"origin ({show_origin(sequence.origin)})")
    return ", ".join(parts)


def numbers_of(sequence: MeshSequence) -> dict[str, str]:
    """The numbers that every sequence has, by name, as text."""
    numbers = {
        "frames": f"{sequence.n_frames} at {sequence.fps:g} per second, {sequence.n_frames / sequence.fps:.4g} s",
        "vertices": str(sequence.n_vertices),
        "triangles": str(len(sequence.faces)),
    }
    if len(sequence.parts) > 1:
        numbers["parts"] = str(len(sequence.parts))
    if sequence.attributes:
        numbers["attributes"] = ", ".join(sequence.attributes)
    if sequence.fields:
        numbers["fields"] = ", ".join(f"{name} ({each.unit})" if each.unit else name for name, each in sequence.fields.items())
    if sequence.origin.any():
        numbers["origin"] = show_origin(sequence.origin)
    return numbers


def are_finite(positions: Floats) -> bool:
    """Whether no number of an array is a NaN or an infinity."""
    with np.errstate(invalid="ignore"):
        extremes = (positions.min(initial=0), positions.max(initial=0))  # a NaN shows in both, an infinity in one
    return bool(np.isfinite(extremes).all())


def check_finite(block: Floats, name: str, first_frame: int = 0) -> None:
    """Raise `InputError` naming frame and vertex if ``block (n, V, 3)`` holds a NaN or an infinity."""
    if not are_finite(block):
        frame, vertex = np.argwhere(~np.isfinite(block).all(axis=2))[0]
        raise InputError(
            f"{name}: frame {first_frame + frame}, vertex {vertex} is {block[frame, vertex].tolist()}; every coordinate "
            "must be a finite number that float32 can hold"
        )


def _as_positions(positions: NDArray[np.generic], name: str) -> tuple[Float32, Float64]:
    """An array in memory as float32, and the origin that it is relative to."""
    if positions.dtype.kind not in "fiu":
        raise InputError(f"{name}: positions have type {positions.dtype}; numbers are needed")
    if positions.ndim != 3 or positions.shape[2] != 3:
        return np.asarray(positions, np.float32), np.zeros(3)  # refused with its shape
    if isinstance(positions, np.memmap) and positions.dtype == np.float32:
        return positions, np.zeros(3)  # checked as it is read, so that it need not fit in memory
    origin = choose_origin(positions) if positions.size else np.zeros(3)
    result = narrow(positions, origin)
    check_finite(result, name)
    return result, origin


def _as_faces(given: Any, n_vertices: int, name: str) -> Int32:
    if isinstance(given, str | bytes) or given is None:
        raise TypeError(f"faces are {show(given)}; an array of shape (triangles, 3) is needed")
    faces = np.asarray(given)
    if faces.size == 0:
        faces = np.zeros((0, 3), np.int32)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(f"{name}: faces have shape {faces.shape} and type {faces.dtype}; (triangles, 3) integers are needed")
    if faces.min(initial=0) < 0 or faces.max(initial=0) >= n_vertices:
        out = np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))[0]
        raise InputError(f"{name}: triangle {out} is {faces[out].tolist()}; vertex indices must lie in 0..{n_vertices - 1}")
    return np.ascontiguousarray(faces, dtype=np.int32)
