"""Samples for PyTorch and for ``webdataset``; neither is imported before it is needed, and gvpipe does not need them."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from gvpipe.container.mp4 import read_bytes
from gvpipe.container.shared_parts import SharedParts
from gvpipe.container.shared_sections import FindSection
from gvpipe.datasets.collating import collate
from gvpipe.datasets.dataset import Dataset, Samples
from gvpipe.datasets.decoding import ALL, check_view, decode_sample
from gvpipe.datasets.opening import find_shards, shared_sections
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.errors import InputError


class TorchSamples:
    """A map-style data set whose samples have tensors in place of arrays; it goes to ``torch.utils.data.DataLoader``.

    Args:
        samples: with arrays.
    """

    def __init__(self, samples: Samples) -> None:
        self._samples = samples

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, sample: int | str) -> Any:
        return to_tensors(self._samples[sample])

    def __iter__(self) -> Iterator[Any]:
        return map(to_tensors, self._samples)


def torch(
    shards: StrPath | Sequence[StrPath] | Dataset,
    frames: slice = ALL,
    lod: int = 0,
    transform: Callable[[dict[str, Any]], Any] | None = None,
) -> TorchSamples:
    """Return a map-style data set of PyTorch: samples as `Dataset.samples` gives them, arrays as tensors.

    ``DataLoader(gvpipe.datasets.torch("shard-*.tar"), batch_size=8, collate_fn=gvpipe.datasets.collate_tensors)`` gives
    batches of tensors (`collate_tensors`), from any number of workers.

    Args:
        shards: as for `gvpipe.datasets.open`, or a data set that is open.
        frames, lod, transform: as for `Dataset.samples`; ``transform`` gets arrays.

    Raises:
        InputError: there is no such shard, or PyTorch is not installed.
        FormatError: a shard is cut or damaged.
    """
    _torch()
    dataset = shards if isinstance(shards, Dataset) else Dataset(find_shards(shards))
    return TorchSamples(dataset.samples(frames, lod, transform))


def to_tensors(value: Any) -> Any:
    """Return a value with tensors in place of arrays, in dictionaries and lists, too; tensors share the arrays' memory."""
    if isinstance(value, np.ndarray):
        return _torch().from_numpy(value)
    if isinstance(value, dict):
        return {name: to_tensors(each) for name, each in value.items()}
    return [to_tensors(each) for each in value] if isinstance(value, list) else value


def collate_tensors(samples: Sequence[Mapping[str, Any]], *, packed: bool = False) -> dict[str, Any]:
    """The same as `collate`, with tensors in place of arrays; for ``collate_fn`` of a ``DataLoader``."""
    found: dict[str, Any] = to_tensors(collate(samples, packed=packed))
    return found


class WebDatasetDecoder:
    """Decodes samples of the ``webdataset`` package: ``WebDataset(shards).decode(webdataset_decoder(shards))``.

    It is called with the name of a sample's member and its bytes, and returns a dictionary for ``.mp4``. For others it returns
    None: ``webdataset`` then gives them to its next decoder. Pickles, so that workers have it, too.

    Args:
        shards: what has the sections that files share, as for `gvpipe.datasets.open`; None: no file shares any.
        frames, lod: as for `Dataset.read`.
        unlimited: as for `gvpipe.open`.
    """

    def __init__(self, shards: StrPath | Sequence[StrPath] | None, frames: slice, lod: int, unlimited: bool) -> None:
        check_view(frames, lod)
        self._shards = None if shards is None else find_shards(shards)
        self._frames, self._lod, self._unlimited = frames, lod, unlimited
        self._parts = SharedParts()

    @cached_property
    def _sections(self) -> FindSection | None:
        """Headers of all shards are read for it once, when the first sample comes."""
        return None if self._shards is None else shared_sections(self._shards)

    def __call__(self, key: str, data: bytes) -> Any:
        """Return ``{"positions", "faces", "fps"}`` of a ``.mp4``, arrays as in `Samples`; raises `FormatError`."""
        if key.rpartition(".")[2].lower() != "mp4":
            return None
        bitstream = replace(read_bytes(data, key, self._unlimited, self._sections), shared=self._parts)
        positions, faces = decode_sample(bitstream, key, self._frames, self._lod)
        return {"positions": positions, "faces": faces, "fps": bitstream.fps}


def webdataset_decoder(
    shards: StrPath | Sequence[StrPath] | None = None, frames: slice = ALL, lod: int = 0, *, unlimited: bool = False
) -> WebDatasetDecoder:
    """Return a decoder for ``webdataset``'s ``decode``; see `WebDatasetDecoder`.

    ``WebDataset("shard-{00000..00009}.tar").decode(webdataset_decoder("shard-*.tar"))``

    Raises:
        InputError: there is no such shard, or no such level.
        TypeError: ``frames`` is no slice, or ``lod`` no integer.
    """
    return WebDatasetDecoder(shards, frames, lod, unlimited)


def _torch() -> Any:
    try:
        return importlib.import_module("torch")
    except ImportError as exc:
        raise InputError("PyTorch is not installed; pip install torch, or read arrays by gvpipe.datasets.open") from exc
