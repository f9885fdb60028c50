"""Sequences of shards at random, without unpacking: where each lies is read once, and each read is one of the disk.

Nothing is open between two reads, so that threads, forked processes and pickled copies read side by side.
"""

from __future__ import annotations

import json
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import file_bytes, read_bytes
from gvpipe.container.shared_parts import SharedParts
from gvpipe.datasets.decoding import ALL, check_view, decode_sample
from gvpipe.datasets.shard_index import Place, Sample, index_shard
from gvpipe.datasets.shared import SharedSections, open_source
from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.foundation.errors import FormatError, InputError, corrupt, in_file, quote
from gvpipe.playback.player import Player

MAX_JSON = 1 << 24  # bytes of a sample's description
MAX_VIDEO = 1 << 32  # bytes of a sample's video


class Dataset:
    """Sequences by number or by key; a map-style data set of PyTorch as it is.

    ``dataset[3]`` and ``dataset["cats/walk"]`` give samples (`Samples`). Thread-safe; a forked process goes on with it;
    pickled, it takes its index along, so that a spawned process reads no headers again.

    Args:
        shards: paths of tar files, absolute.
        unlimited: as for `gvpipe.open`, of every file in it.

    Raises:
        InputError: there is no such shard, no sample, or two samples have one key.
        FormatError: a shard is cut or damaged; the message names shard, sample and byte.
    """

    def __init__(self, shards: Sequence[str], *, unlimited: bool = False) -> None:
        self.shards = list(shards)
        self._unlimited = unlimited
        self._sources = [open_source(path) for path in self.shards]
        self._places: list[tuple[int, Sample]] = []
        self._sections: list[SharedSections] = []  # of each shard
        for k, path in enumerate(self.shards):
            index = index_shard(path)
            self._places += [(k, sample) for sample in index.samples]
            self._sections.append(SharedSections([(self._sources[k], index.shared)]))
        self._numbers: dict[str, int] = {}
        for number, (k, sample) in enumerate(self._places):
            first = self._numbers.setdefault(sample.key, number)
            if first != number:
                raise InputError(f"sample {sample.key!r} is in {self.shards[self._places[first][0]]} and in {self.shards[k]}")
        if not self._places:
            raise InputError(f"{', '.join(self.shards)}: no sample is in it (NAME.mp4); gvpipe pack makes shards")
        self._shared = SharedParts()

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, sample: int | str) -> Any:
        return self.samples()[sample]

    def __contains__(self, key: object) -> bool:
        return key in self._numbers

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.samples())

    def __repr__(self) -> str:
        return f"<Dataset of {len(self)} sequences in {len(self.shards)} shards>"

    @property
    def keys(self) -> list[str]:
        """The key of each sample."""
        return list(self._numbers)

    def read(self, sample: int | str, frames: slice = ALL, lod: int = 0) -> Float32:
        """Return positions of a sequence: ``(n, V, 3) float32``, model units, relative to its origin.

        Args:
            sample: its number or its key.
            frames: which, such as ``slice(0, 8)``; it may go backwards, and have steps.
            lod: level of detail: 0 is the mesh, higher ones are coarser, down to the coarsest that the sequence has.

        Raises:
            IndexError, KeyError: there is no such sample.
            InputError: there is no such level.
            TypeError: ``frames`` is no slice, or ``lod`` no integer.
            FormatError: the sample is cut or damaged.
        """
        check_view(frames, lod)
        return self._decode(self.number(sample), frames, lod, False)[0]

    def faces(self, sample: int | str, lod: int = 0) -> Int32:
        """Return the triangles of a sequence, ``(T, 3) int32``, at a level of detail as `read` takes it."""
        check_view(ALL, lod)
        return self._decode(self.number(sample), slice(0, 0), lod, True)[1]

    def description_text(self, sample: int | str) -> bytes:
        """Return the JSON of a sample as its shard has it; empty if it has none."""
        number = self.number(sample)
        place = self._places[number][1].description
        with in_file(self._name(number)):
            return self._bytes(number, place, MAX_JSON) if place.length else b""

    def description(self, sample: int | str) -> dict[str, Any]:
        """Return the JSON object of a sample; empty if it has none."""
        text = self.description_text(sample)
        with in_file(self._name(self.number(sample))):
            if not text:
                return {}
            try:
                found = json.loads(text)
            except (ValueError, RecursionError) as exc:
                raise corrupt(f"its description is not JSON ({exc})") from exc
            if not isinstance(found, dict):
                raise corrupt("its description is no JSON object")
            return found

    def open(self, sample: int | str) -> Player:
        """Open a sequence with all that it has, as `gvpipe.open` does."""
        number = self.number(sample)
        data, shared = self._video(number), self._sections[self._places[number][0]]
        return Player(self._name(number), unlimited=self._unlimited, data=data, shared=shared)

    def whole_file(self, sample: int | str) -> bytes:
        """Return a sample's geometry video as it was packed, with the sections that it shares with others of its shard."""
        number = self.number(sample)
        data, bitstream = self._video(number), self.bitstream(number)
        return data if bitstream.n_bytes == len(data) else file_bytes(bitstream)

    def bitstream(self, sample: int | str) -> Bitstream:
        """Return the coded sequence, whose checksums hold."""
        number = self.number(sample)
        shared = self._sections[self._places[number][0]]
        bitstream = read_bytes(self._video(number), self._name(number), self._unlimited, shared)
        return replace(bitstream, shared=self._shared)

    @property
    def n_bytes(self) -> int:
        """Bytes of all geometry videos in the shards, and of the sections that they share."""
        videos = sum(sample.video.length for _, sample in self._places)
        return videos + sum(sections.n_bytes for sections in self._sections)

    def samples(self, frames: slice = ALL, lod: int = 0, transform: Callable[[dict[str, Any]], Any] | None = None) -> Samples:
        """The same sequences, of which samples have some frames or a coarser mesh, or are transformed."""
        return Samples(self, frames, lod, transform)

    def batches(
        self, size: int, frames: slice = ALL, lod: int = 0, *, seed: int | None = None
    ) -> Iterator[list[dict[str, Any]]]:
        """Yield all samples, ``size`` at a time; with a seed, in the random order that follows from it.

        Raises:
            InputError: the size is below 1.
        """
        if isinstance(size, bool) or not isinstance(size, int):
            raise TypeError(f"the size of batches is {show(size)}; an integer is needed")
        if size < 1:
            raise InputError(f"a batch of {size} samples; give 1 or more")
        order = np.arange(len(self)) if seed is None else np.random.default_rng(seed).permutation(len(self))
        samples = self.samples(frames, lod)
        return ([samples[int(k)] for k in order[at : at + size]] for at in range(0, len(self), size))

    def number(self, sample: int | str) -> int:
        """The number of a sample, from 0, by its number (negative: from the end) or its key; raises IndexError, KeyError."""
        if isinstance(sample, str):
            if sample not in self._numbers:
                raise KeyError(f"no sample {quote(sample)}; there are {len(self)}, see Dataset.keys")
            return self._numbers[sample]
        number = operator.index(sample)
        if not -len(self) <= number < len(self):
            raise IndexError(f"sample {number}: there are {len(self)}")
        return number % len(self)

    def _decode(self, number: int, frames: slice, lod: int, with_faces: bool) -> tuple[Float32, Int32, Bitstream]:
        bitstream = self.bitstream(number)
        positions, faces = decode_sample(bitstream, self._name(number), frames, lod, with_faces)
        return positions, faces, bitstream

    def _video(self, number: int) -> bytes:
        with in_file(self._name(number)):
            return self._bytes(number, self._places[number][1].video, MAX_VIDEO)

    def _bytes(self, number: int, place: Place, most: int) -> bytes:
        if place.length > most:
            raise corrupt(f"the member at byte {place.offset} has {place.length} bytes, above {most}")
        try:
            return self._sources[self._places[number][0]].read(*place)
        except FormatError as exc:
            raise exc.within(f"byte {place.offset} of the shard") from exc

    def _name(self, number: int) -> str:
        """A sample in messages: its shard and its key."""
        shard, sample = self._places[number]
        return f"{self.shards[shard]}, sample {sample.key!r} at byte {sample.video.offset}"


class Samples:
    """A map-style data set: ``samples[k]`` is ``{"key", "positions", "faces", "fps"}``, or what ``transform`` makes of it.

    Positions are ``(n, V, 3) float32``, faces ``(T, 3) int32``. It goes to ``torch.utils.data.DataLoader`` as it is.

    Args:
        dataset: of the sequences.
        frames, lod: as for `Dataset.read`.
        transform: called with each sample.
    """

    def __init__(
        self, dataset: Dataset, frames: slice = ALL, lod: int = 0, transform: Callable[[dict[str, Any]], Any] | None = None
    ) -> None:
        check_view(frames, lod)
        if transform is not None and not callable(transform):
            raise TypeError(f"transform is {show(transform)}; a function of a sample is needed")
        self._dataset, self._frames, self._lod, self._transform = dataset, frames, lod, transform

    def __len__(self) -> int:
        return len(self._dataset)

    def __getitem__(self, sample: int | str) -> Any:
        number = self._dataset.number(sample)
        positions, faces, bitstream = self._dataset._decode(number, self._frames, self._lod, True)
        key = self._dataset._places[number][1].key
        found = {"key": key, "positions": positions, "faces": faces, "fps": bitstream.fps}
        return found if self._transform is None else self._transform(found)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))
