"""Data sets of many short sequences: packed into tar files (*shards*) in WebDataset's layout, read there without unpacking."""

from __future__ import annotations

from gvpipe.datasets.dataset import Dataset, Samples
from gvpipe.datasets.opening import open
from gvpipe.datasets.packing import Packed, pack
from gvpipe.datasets.summary import Summary, summarise

__all__ = ["Dataset", "Packed", "Samples", "Summary", "open", "pack", "summarise"]
