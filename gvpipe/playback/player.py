"""Random access to the frames of a geometry video."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterator, Mapping
from functools import partial
from types import TracebackType
from typing import Any, overload

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.listing import count_polygons
from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.asset_coding.directory import Directory, file_notes
from gvpipe.asset_coding.reader import AssetReader
from gvpipe.asset_coding.sound_track import read_sound
from gvpipe.coding.codec import GroupReader, LevelReader
from gvpipe.coding.registry import codec_class, codec_ids, open_reader, read_skin
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import read_file, read_source
from gvpipe.container.outline import Outline
from gvpipe.container.shared_sections import FindSection
from gvpipe.container.sources import BytesSource, Source, is_remote
from gvpipe.foundation.arguments import check_path
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError, in_file
from gvpipe.grids.volume import Volume
from gvpipe.io.simulation.vtk_frames import to_pyvista
from gvpipe.media.sound import Sound
from gvpipe.model.coarse_asset import add_asset
from gvpipe.model.sequence import MeshSequence, describe, numbers_of
from gvpipe.model.shown import ShownInNotebooks
from gvpipe.model.skin import Skin
from gvpipe.playback.frame_cache import FrameCache
from gvpipe.playback.shared_reader import SharedReader


class Player(ShownInNotebooks):
    """An open geometry video: a sequence of frames, each ``(V, 3) float32``, model units, relative to ``origin``.

    A context manager; thread-safe. A forked process goes on with it. Pickled, it is opened again by its path, so the file must
    still be there.

    ``video[k]`` decodes no more than the group of frames that frame k lies in, and keeps the last groups; frames asked for
    in a row, forwards or backwards, are decoded ahead on another thread. ``video[a:b]`` gives ``(b - a, V, 3)``.

    Args:
        path: of the file, or its address (``https://...``): of a file in the stream layout, what is asked for is fetched.
        unlimited: let it take whatever memory and work it asks for; by default its size limits both
            (`gvpipe.foundation.budget`).
        data: the file's bytes, or what gives them (`gvpipe.container.sources.Source`), of a file that is no file on disk;
            ``path`` is its name in messages then.
        shared: of a sample that was taken out of a shard: what has the sections that the shard's files share, such as
            `gvpipe.datasets.SharedSections`.

    Raises:
        InputError: there is no such file.
        OverBudget: here or later: it asks for more than a file of its size may take.
        FormatError: it is not a geometry video, or it is damaged; the kinds are in `gvpipe.foundation.errors`.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        unlimited: bool = False,
        data: bytes | Source | None = None,
        shared: FindSection | None = None,
    ) -> None:
        check_path(path, "the geometry video")
        self.path = os.fspath(path)
        # another process may have another working directory
        self._absolute = self.path if data is not None or is_remote(self.path) else os.path.abspath(self.path)
        self._unlimited, self._data, self._find = unlimited, data, shared
        given = BytesSource(data) if isinstance(data, bytes) else data
        read = partial(read_file, path) if given is None else partial(read_source, given, self.path)
        self.bitstream: Bitstream = read(unlimited, shared)
        with in_file(self.path):
            self._reader = open_reader(self.bitstream)
            self._shared = SharedReader(self.bitstream, self._reader, self.path)
            self._asset = AssetReader(self.bitstream, self._reader, self.path, self._shared.read)
        group = self._reader.group if isinstance(self._reader, GroupReader) else _alone
        self._cache = FrameCache(self._shared.read, group, len(self), 12 * self.bitstream.n_vertices)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), unlimited=self._unlimited, data=self._data, shared=self._find), (self._absolute,)

    @property
    def on_disk(self) -> str | None:
        """Absolute path of the file; None for one in memory, or at an address."""
        return None if self._data is not None or is_remote(self.path) else self._absolute

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        with in_file(self.path):
            return self._asset.faces

    @property
    def attributes(self) -> Mapping[str, Attribute]:
        """Static numbers by name, decoded when they are asked for."""
        return self._asset.attributes

    @property
    def fields(self) -> Mapping[str, Field]:
        """Animated numbers by name: ``video.fields["stress"][10:20]`` decodes no more than it must, and no positions."""
        return self._asset.fields

    @property
    def parts(self) -> tuple[Part, ...]:
        """The named meshes that it consists of."""
        with in_file(self.path):
            return self._asset.parts

    @property
    def polygons(self) -> Int32 | None:
        """``(P,)`` corners of each polygon, whose fans are the triangles, in order; None: all are triangles."""
        with in_file(self.path):
            return self._asset.polygons

    @property
    def materials(self) -> tuple[Material, ...]:
        """What the parts look like."""
        return self._asset.materials

    @property
    def images(self) -> tuple[Image, ...]:
        """What the materials' textures show."""
        with in_file(self.path):
            return self._asset.images

    @property
    def metadata(self) -> Metadata:
        """What the scene says of itself."""
        return self._asset.metadata

    @property
    def volume(self) -> Volume | None:
        """What lies inside of the surface, of a simulation; None where the file has nothing of it."""
        with in_file(self.path):
            return self._asset.volume

    @property
    def sound(self) -> Sound | None:
        """What is heard with the frames, None if the file has none; its samples are read when they are asked for."""
        return read_sound(self.bitstream.companions)[0]

    @property
    def times(self) -> Float64:
        """``(F,) float64`` seconds of the frames, as `MeshSequence.times`."""
        return self.metadata.frame_times(len(self), self.fps)

    @property
    def directory(self) -> Directory:
        """Section ``asset`` of the file."""
        return self._asset.directory

    def skin(self, start: int = 0, stop: int | None = None) -> Skin | None:
        """The skeleton that moves the vertices, and how far it is from the frames; None: the file has none.

        Files of codec `mcgv` have one, as a rule; where pictures say more, its error is that of the motion alone.

        Args:
            start, stop: first frame, and the one after the last, as of a slice.

        Raises:
            InputError: there is no such frame.
            OverBudget: it takes more memory than a file of this size may.
        """
        from gvpipe.skinning.fit import measured

        with in_file(self.path):
            skin = read_skin(self.bitstream)
        first, last, _ = slice(start, stop).indices(len(self))
        if first >= last:
            raise InputError(f"{self.path} has {len(self)} frames; there are none from {start} to {stop}")
        return None if skin is None else measured(skin.part(first, last), self.sequence().part(first, last))[0]

    def outline(self) -> Outline:
        """What `gvpipe.info` tells of the mesh, from what is decoded."""
        triangles = tuple(part.triangles[1] - part.triangles[0] for part in self.parts)
        return Outline(Outline.around(self[0]).box, tuple(self.levels[1:]), triangles, count_polygons(self.polygons))

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the file, a line each."""
        return file_notes(self.directory, self.bitstream)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.bitstream.fps

    @property
    def origin(self) -> Float64:
        """``(3,) float64`` to add to positions, model units: 0 unless the mesh is far from there for its size."""
        return np.array(self.bitstream.origin)

    @property
    def levels(self) -> list[int]:
        """Vertex counts of the levels of detail, the mesh itself first; one entry for codecs that have none."""
        return self._reader.levels if isinstance(self._reader, LevelReader) else [self.bitstream.n_vertices]

    def level(self, lod: int) -> MeshSequence:
        """The video as a sequence of a coarser mesh with the same motion; level 0 is the mesh itself.

        It has what of attributes, fields, parts and materials survives; its notes say what does not
        (`gvpipe.model.coarse_asset`).

        Raises:
            InputError: there is no such level.
        """
        if lod == 0:
            return self.sequence()
        if not isinstance(self._reader, LevelReader):
            others = " or ".join(name for name in codec_ids() if codec_class(name).has_levels)
            raise InputError(f"{self.path}: no level of detail {lod}, only 0; files of codec {others} have coarser ones")
        if not 0 < lod < len(self.levels):
            raise InputError(f"{self.path}: no level of detail {lod}; there are levels 0..{len(self.levels) - 1}")
        with in_file(self.path):
            faces, (points, kept) = self._reader.level_faces(lod), self._reader.level_points(lod)
        level = MeshSequence(_Level(self, lod), faces, self.fps, name=self.path, origin=self.origin)
        return add_asset(level, self.sequence(), points, kept, lod)

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (self.bitstream.n_frames, self.bitstream.n_vertices, 3)

    def sequence(self) -> MeshSequence:
        """The video as a sequence whose frames, and frames of fields, are decoded when they are read."""
        return MeshSequence(
            positions=self,
            faces=self.faces,
            fps=self.fps,
            attributes=self.attributes,
            name=self.path,
            origin=self.origin,
            notes=self.notes,
            fields=self.fields,
            parts=self.parts,
            polygons=self.polygons,
            materials=self.materials,
            images=self.images,
            metadata=self.metadata,
            volume=self.volume,
            sound=self.sound,
        )

    def to_pyvista(self, frame: int = 0) -> Any:
        """A frame as a data set of PyVista, which must be installed; raises as `gvpipe.to_pyvista` does."""
        return to_pyvista(self, frame)

    def __len__(self) -> int:
        return self.bitstream.n_frames

    @overload
    def __getitem__(self, key: int, /) -> Float32: ...
    @overload
    def __getitem__(self, key: slice, /) -> Float32: ...
    def __getitem__(self, key: int | slice, /) -> Float32:
        if isinstance(key, slice):
            start, stop, step = key.indices(len(self))
            if step != 1:
                frames = [self[i] for i in range(start, stop, step)]
                return np.stack(frames) if frames else self._shared.read(0, 0)
            if stop == start + 1:  # sequences that show frame after frame ask like this
                return self._cache.frame(start)[None]
            return self._shared.read(start, max(start, stop))
        index = operator.index(key)
        if not -len(self) <= index < len(self):
            raise IndexError(f"frame {index} of {self.path}: there are {len(self)}")
        index %= len(self)
        return self._cache.frame(index)

    def __iter__(self) -> Iterator[Float32]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"<Player {self.path}: codec {self.bitstream.codec}, {describe(self.sequence())}>"

    def _repr_html_(self) -> str:
        from gvpipe.model.notebook import card

        sequence = self.sequence()
        numbers = numbers_of(sequence)
        if len(self.levels) > 1:
            numbers["levels of detail"] = ", ".join(map(str, self.levels))
        size, n_samples = self.bitstream.n_bytes, self.bitstream.n_vertices * len(self)
        numbers["size"] = f"{size} bytes, {8 * size / n_samples:.3f} bits per vertex and frame"
        numbers["codec"] = f"{self.bitstream.codec} version {self.bitstream.version}"
        return card(self.path, numbers, sequence)

    def __enter__(self) -> Player:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of decoded frames, attributes and fields, and of all threads. The video stays usable."""
        self._cache.close()
        self._shared.close()
        self._asset.close()


def _alone(frame: int) -> tuple[int, int]:
    return frame, frame + 1


class _Level:
    """Frames of one level of detail."""

    def __init__(self, player: Player, lod: int) -> None:
        self._player, self._lod = player, lod
        self.shape = (len(player), player.levels[lod], 3)

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        return self._player._shared.read(start, max(start, stop), lod=self._lod)
