"""What every codec promises; a new codec joins by being registered, and by a line in `BOUNDS`."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, codec_ids, open_reader
from gvpipe.container import mp4, plain
from gvpipe.foundation.errors import (
    CorruptFile,
    NewerVersion,
    NotGeometryVideo,
    StrippedFile,
    TruncatedFile,
)
from gvpipe.testing import PROMISES, Promise, Subject
from gvpipe.testing.promises import (
    awkward_input,
    awkward_inputs,
    coincidence,
    hostile_input,
    quality,
    repeated_frames,
    same_bytes,
    segments,
    stillness,
)
from gvpipe.testing.sequences import awkward

# the largest rmse, as a part of frame 0's diagonal, at the default quality: each codec's own statement
BOUNDS = {"laplacian": 1e-3, "mcgv": 2e-3, "pca": 1e-3, "pdct": 1e-3}
AWKWARD = awkward()

SETTINGS: dict[str, list[dict[str, Any]]] = {
    "laplacian": [
        {},
        {"operator": "cotangent", "delta_prediction": "rigid"},
        {"operator": "tutte", "delta_prediction": "none"},
    ],
    "mcgv": [
        {},
        {"image": "jpeg"},
        {"profile": "precise"},
        {"prediction": "blended"},
        {"placement": "halves"},
        {"prediction": "blended", "placement": "tiles"},
        {"prediction": "blended", "transform": "klt"},
    ],
    "pca": [{}, {"predictor": "rbf"}, {"predictor": "lsp"}, {"predictor": "navg"}],
    "pdct": [{}, {"clusters": 3, "fineness": 2.0}],
}
CHOSEN = {
    " ".join([codec, *(f"{k}={v}" for k, v in settings.items())]): (codec, settings)
    for codec in codec_ids()
    if codec_class(codec).__module__.startswith("gvcodecs.")  # packages beside gvpipe test their own
    for settings in SETTINGS.get(codec, [{}])
}
VARIANTS = [pytest.param(*variant, id=name) for name, variant in CHOSEN.items()]
AWKWARD_CASES = [  # codecs meet every second input, in one of both orders; with settings every eighth; others in the slow run
    pytest.param(
        *variant.values,
        reorder,
        name,
        id=f"{variant.id}-{'reorder' if reorder else ''}-{name}",
        marks=[] if (i + j) % (8 if variant.values[1] else 2) == 0 and reorder == (i // 2 + j // 2) % 2 else pytest.mark.slow,
    )
    for (i, variant), reorder, (j, name) in product(enumerate(VARIANTS), (False, True), enumerate(AWKWARD))
]
LONG = (same_bytes, quality, segments, hostile_input)  # promises that codecs without settings alone are held to in a quick run
ELSEWHERE = (awkward_inputs, stillness, coincidence, repeated_frames)  # below, and in test_stillness.py
PROMISE_CASES = [
    pytest.param(name, promise, id=f"{name}-{promise.name}", marks=[pytest.mark.slow] if promise in LONG and settings else [])
    for promise in PROMISES
    for name, (_, settings) in CHOSEN.items()
    if promise not in ELSEWHERE
]


def make(codec: str, **settings: Any) -> Codec:
    chosen: Codec = codec_class(codec)(**settings)
    return chosen


@pytest.fixture(scope="session")
def subjects(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Subject]:
    """A codec variant that is tried; its file is encoded when it is first asked for."""
    folder = tmp_path_factory.mktemp("encoded")

    @functools.cache
    def subject(variant: str) -> Subject:
        codec, settings = CHOSEN[variant]
        own = folder / str(list(CHOSEN).index(variant))
        own.mkdir()
        return Subject(make(codec, **settings), own, BOUNDS[codec])

    return subject


@pytest.fixture
def path(request: pytest.FixtureRequest, subjects: Callable[[str], Subject]) -> Path:
    return subjects(str(request.param)).file


each_file = pytest.mark.parametrize("path", list(CHOSEN), indirect=True)
a_file_of_each_codec = pytest.mark.parametrize(  # with other settings in the slow run
    "path",
    [pytest.param(name, marks=[pytest.mark.slow] if settings else []) for name, (_, settings) in CHOSEN.items()],
    indirect=True,
)


@pytest.mark.parametrize(("variant", "promise"), PROMISE_CASES)
def test_promise(variant: str, promise: Promise, subjects: Callable[[str], Subject]) -> None:
    promise(subjects(variant))


@pytest.mark.parametrize(("codec", "settings", "reorder", "name"), AWKWARD_CASES)
def test_awkward_inputs(codec: str, settings: dict[str, Any], reorder: bool, name: str, tmp_path: Path) -> None:
    awkward_input(Subject(make(codec, **settings), tmp_path), AWKWARD[name], reorder)


@a_file_of_each_codec
def test_every_truncated_prefix_is_refused(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    cuts = {*range(64), *range(len(data) - 64, len(data)), *np.linspace(64, len(data) - 1, 150, dtype=int).tolist()}
    for cut in sorted(cuts):
        (tmp_path / "cut.mp4").write_bytes(data[:cut])
        with pytest.raises((TruncatedFile, StrippedFile)) as caught:
            gvpipe.open(tmp_path / "cut.mp4")
        assert "cut.mp4" in str(caught.value)
        assert caught.type is TruncatedFile or cut == payload_start(data)


@each_file
def test_one_flipped_byte_in_each_section_is_refused(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    bitstream = mp4.read_file(path)
    targets = {name: data.index(section) for name, section in bitstream.sections.items() if section}
    targets["length of the header"] = payload_start(data) + 25
    targets["version"] = payload_start(data) + 24
    targets["header"] = data.index(next(s for s in bitstream.sections.values() if s)) - 5
    targets["video"] = data.index(b"mdat") + 40
    for name, at in targets.items():
        changed = bytearray(data)
        changed[at] ^= 0x40
        (tmp_path / "flip.mp4").write_bytes(changed)
        with pytest.raises((CorruptFile, NewerVersion)) as caught:
            gvpipe.open(tmp_path / "flip.mp4")
        assert "flip.mp4" in str(caught.value), name


@each_file
def test_wrong_files_each_have_their_error(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    start = payload_start(data)
    newer = bytearray(data)
    newer[start + 24] = plain.VERSION + 1
    wrong = {
        CorruptFile: [data + b"\0", data[: start + 24] + b"GVPIPE\r\n" + data[start + 32 :]],
        StrippedFile: [data[:start]],
        NewerVersion: [bytes(newer)],
        NotGeometryVideo: [b"\xff\xd8\xff\xe0 a JPEG", b"# not a video\n" * 40],
        TruncatedFile: [b"", data[: start - 1]],
    }
    for error, contents in wrong.items():
        for content in contents:
            (tmp_path / "wrong.mp4").write_bytes(content)
            with pytest.raises(error, match="wrong.mp4"):
                gvpipe.open(tmp_path / "wrong.mp4")


@each_file
def test_a_codec_that_is_not_installed(path: Path) -> None:
    bitstream = mp4.read_file(path)
    with pytest.raises(NewerVersion, match="upgrade"):
        open_reader(dataclasses.replace(bitstream, codec="from-the-future"))


def payload_start(data: bytes) -> int:
    """Where the payload's box starts."""
    return data.index(mp4.BOX_UUID.bytes) - 8
