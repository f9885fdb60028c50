"""A data-set card: a page in Markdown, whose front matter is that of Hugging Face's cards.

What gvpipe writes lies between two lines, `BEGIN` and `FINISH`. In a card that is there already, only what is between them
changes; front matter and text around it stay as they are.
"""

from __future__ import annotations

import json
import os
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from gvpipe.datasets.recorded import ERRORS
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.atomic import output_error, unnamed_path
from gvpipe.foundation.errors import InputError

BEGIN, FINISH = "<!-- gvpipe: begin -->", "<!-- gvpipe: end -->"
UNITS = {"kg": "%", "rmse": "model units", "rmse_diag": "of the diagonal", "max": "model units", "max_diag": "of the diagonal"}
SIZES = {1_000: "n<1K", 10_000: "1K<n<10K", 100_000: "10K<n<100K", 1_000_000: "100K<n<1M", 10_000_000: "1M<n<10M"}
LARGEST = "n>10M"
MAX_BYTES = 1 << 24  # of a card that is there


def check_card(path: StrPath) -> str:
    """Return the text of a card that is there, empty if there is none.

    Raises:
        InputError: it cannot be read, or has no region for gvpipe.
    """
    if not os.path.lexists(path):
        return ""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            text = file.read(MAX_BYTES)
    except (OSError, ValueError) as exc:
        raise InputError(f"{path} cannot be read as text ({exc}); choose another name for the card") from exc
    if text.count(BEGIN) != 1 or text.count(FINISH) != 1 or text.index(BEGIN) > text.index(FINISH):
        raise InputError(
            f"{path} is there and has no region for gvpipe; add the lines {BEGIN} and {FINISH}, or choose another name"
        )
    return text


class Contents(NamedTuple):
    """What a card sums up.

    Args:
        shards: their paths.
        pattern: what opens them all, such as ``shard-*.tar``.
        samples: the JSON of each.
        settings: what ``encode-all`` was asked for; empty if that is not known.
    """

    shards: Sequence[str]
    pattern: str
    samples: Sequence[Mapping[str, Any]]
    settings: Mapping[str, Any]


def write_card(path: StrPath, before: str, contents: Contents) -> None:
    """Write a card; ``before`` is its text so far (`check_card`). Raises `OutputError` if it cannot be written."""
    region = "\n".join([BEGIN, *_region(contents), FINISH])
    if before:
        start, end = before.index(BEGIN), before.index(FINISH) + len(FINISH)
        text = before[:start] + region + before[end:]
    else:
        text = "\n".join([*_front_matter(Path(path), len(contents.samples)), region, ""])
    try:
        with unnamed_path(path) as temporary:
            Path(temporary).write_bytes(text.encode())
    except OSError as exc:
        raise output_error(path, exc) from exc


def _front_matter(path: Path, n_samples: int) -> list[str]:
    name = json.dumps(path.resolve().parent.name or "Mesh animations", ensure_ascii=False)  # a text of YAML, too
    size = next((label for limit, label in SIZES.items() if n_samples < limit), LARGEST)
    lines = ["---", f"pretty_name: {name}", "tags:", "- mesh", "- animation", "- webdataset", "- gvpipe"]
    return [*lines, "size_categories:", f"- {size}", "---", "", f"# {json.loads(name)}", ""]


def _region(contents: Contents) -> list[str]:
    shards, samples, settings = contents.shards, contents.samples, contents.settings
    size = sum(map(os.path.getsize, shards))
    codecs = Counter(sample["codec"] for sample in samples)
    rows = {
        "sequences": f"{len(samples):,}",
        "shards": f"{len(shards):,}",
        "bytes": f"{size:,}",
        "float32 positions by bytes": f"{12 * sum(s['frames'] * s['vertices'] for s in samples) / max(size, 1):.1f}",
        "frames": _range([sample["frames"] for sample in samples]),
        "vertices": _range([sample["vertices"] for sample in samples]),
        "triangles": _range([sample["triangles"] for sample in samples]),
        "topologies": f"{len({sample.get('topology') for sample in samples}):,}",
        "frames per second": ", ".join(f"{fps:g}" for fps in sorted({sample["fps"] for sample in samples})),
        "codecs": ", ".join(f"{name} ({n:,})" for name, n in sorted(codecs.items())),
        **({"settings": f"`{json.dumps(settings, ensure_ascii=False)}`"} if settings else {}),
    }
    table = ["| | |", "| --- | --- |", *(f"| {name} | {_cell(value)} |" for name, value in rows.items())]
    return [*table, "", *_errors(samples), *_loading(contents.pattern)]


def _errors(samples: Sequence[Mapping[str, Any]]) -> list[str]:
    """A table of the errors that samples state; empty if none does."""
    found = {name: [s[name] for s in samples if isinstance(s.get(name), int | float)] for name in ERRORS}
    rows = [
        f"| {name} ({UNITS[name]}) | {len(values):,} | {statistics.median(values):.3g} | {max(values):.3g} |"
        for name, values in found.items()
        if values
    ]
    return [*["| error | sequences | median | largest |", "| --- | --- | --- | --- |", *rows], ""] if rows else []


def _loading(pattern: str) -> list[str]:
    return [
        "```python",
        "import gvpipe  # pip install gvpipe",
        "",
        f"dataset = gvpipe.datasets.open({json.dumps(pattern, ensure_ascii=False)})",
        'sample = dataset[0]  # {"key", "positions" (F, V, 3), "faces" (T, 3), "fps"}',
        'dataset.description(0)  # {"box", "mean", "scale", "topology", ...}: lengths relative to the origin, as positions are',
        "```",
    ]


def _range(counts: Sequence[int]) -> str:
    return f"{min(counts, default=0):,} to {max(counts, default=0):,}, {sum(counts):,} in all"


def _cell(text: str) -> str:
    """A text that ends no cell of a table."""
    return " ".join(text.replace("|", "\\|").split())
