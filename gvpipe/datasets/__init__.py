"""Data sets of many short sequences: packed into tar files (*shards*) in WebDataset's layout, read there without unpacking."""

from __future__ import annotations

from gvpipe.datasets.collating import collate
from gvpipe.datasets.dataset import Dataset, Samples
from gvpipe.datasets.frameworks import TorchSamples, WebDatasetDecoder, collate_tensors, torch, webdataset_decoder
from gvpipe.datasets.opening import open, shared_sections
from gvpipe.datasets.packing import Packed, pack
from gvpipe.datasets.shared import SharedSections
from gvpipe.datasets.summary import Summary, summarise
from gvpipe.datasets.unpacking import Unpacked, unpack

__all__ = [
    "Dataset",
    "Packed",
    "Samples",
    "SharedSections",
    "Summary",
    "TorchSamples",
    "Unpacked",
    "WebDatasetDecoder",
    "collate",
    "collate_tensors",
    "open",
    "pack",
    "shared_sections",
    "summarise",
    "torch",
    "unpack",
    "webdataset_decoder",
]
