"""Headers and sections of mcgv that lie behind right checksums."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from sequences import waving

from gvcodecs.mcgv import Mcgv
from gvpipe.coding.registry import open_reader
from gvpipe.foundation.errors import CorruptFile, FormatError, NewerVersion
from gvpipe.model.sequence import MeshSequence


def test_hostile_codec_headers(sequence: MeshSequence) -> None:
    """A header that lies, with every checksum right: CorruptFile when it opens or when a frame is read, and no NaN ever."""
    stream = Mcgv(preset="ultrafast", clusters=2, gop=4).encode(sequence).bitstream
    wanted = open_reader(stream).read(0, 11)
    assert np.isfinite(wanted).all()
    for key, value in stream.header.items():
        changes: list[Any] = [None, "x", [], 0, -1, 10**9, float("nan"), float("inf"), True, 1e-310]
        if key == "base":
            changes = [
                [*value[:i], bad, *value[i + 1 :]] for i in range(4) for bad in (float("nan"), float("inf"), None, "1")
            ] + [value[:3]]
        for change in changes:
            if change == 10**9 and key.endswith("_step"):
                continue  # a step like any other
            broken = dataclasses.replace(stream, header={**stream.header, key: change})
            with pytest.raises(CorruptFile):
                open_reader(broken).read(0, 11)
        with pytest.raises(CorruptFile):
            open_reader(dataclasses.replace(stream, header={k: v for k, v in stream.header.items() if k != key}))
    for field in ("n_frames", "n_vertices", "n_triangles"):
        for change in (-1, 1, 1000):
            with pytest.raises(CorruptFile):
                broken = dataclasses.replace(stream, **{field: getattr(stream, field) + change})
                open_reader(broken).read(0, broken.n_frames)
    for name, data in stream.sections.items():
        for bad in (None, b"", data[:-1], data + b"\0", bytes(len(data)), b"\xff" * len(data)):
            left = {k: v for k, v in stream.sections.items() if k != name or bad is not None}
            broken = dataclasses.replace(stream, sections={**left, **({name: bad} if bad is not None else {})})
            if name == "order" and bad == b"":
                continue  # the codec's own order
            with pytest.raises(CorruptFile):
                open_reader(broken).read(0, 11)


def test_predictions_must_fit() -> None:
    sequence = waving(10, 12)
    affine = Mcgv(prediction="affine", clusters=3, quality=30).encode(sequence).bitstream
    assert affine.header["prediction"] == "affine" and "weights" not in affine.sections
    chosen = Mcgv(prediction="blended", clusters=3).encode(sequence).bitstream
    assert chosen.header["prediction"] == "blended" and "clusters" not in chosen.sections
    without = {key: value for key, value in affine.header.items() if key != "prediction"}
    for wrong in (
        dataclasses.replace(affine, header=without),
        dataclasses.replace(chosen, header={**chosen.header, "prediction": ["blended"]}),
    ):
        with pytest.raises(CorruptFile, match="prediction"):
            open_reader(wrong)
    with pytest.raises(FormatError):
        open_reader(dataclasses.replace(chosen, header={**chosen.header, "prediction": "affine"})).read(0, 1)
    with pytest.raises(NewerVersion):
        open_reader(dataclasses.replace(chosen, version=2))
