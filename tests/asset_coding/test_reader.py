"""Damaged sections of an asset raise `FormatError`, and cost no more than their file's size allows."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from asset_scene import scene

import gvpipe
from gvpipe.asset_coding.directory import SECTION, Directory, file_notes, pack_directory, unpack_directory
from gvpipe.asset_coding.reader import AssetReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.json_object import pack_json
from gvpipe.container.mp4 import read_file
from gvpipe.foundation.errors import CorruptFile, FormatError

MUTATIONS = 25  # of each section


@pytest.fixture(scope="module")
def bitstream(tmp_path_factory: pytest.TempPathFactory) -> Bitstream:
    path = tmp_path_factory.mktemp("asset") / "a.mp4"
    gvpipe.encode(scene(), path, "pdct")
    return read_file(path)


def read_all(bitstream: Bitstream) -> None:
    """Decode everything beside the positions."""
    asset = AssetReader(bitstream, open_reader(bitstream))
    assert sum(part.triangles[1] - part.triangles[0] for part in asset.parts) == len(asset.faces)
    assert asset.polygons is None or (asset.polygons >= 3).all()
    assert len(asset.materials) == 2
    assert len(asset.images) == 1
    for attribute in asset.attributes.values():
        assert np.isfinite(np.asarray(attribute, np.float64)).all()
    for field in asset.fields.values():
        assert len(field[:]) == bitstream.n_frames


def with_section(bitstream: Bitstream, name: str, data: bytes) -> Bitstream:
    return dataclasses.replace(bitstream, sections={**bitstream.sections, name: data})


def test_everything_is_there(bitstream: Bitstream) -> None:
    assert {"asset", "arrangement", "attribute.5", "field.2", "image.0"} <= set(bitstream.sections)
    read_all(bitstream)


@pytest.mark.parametrize("name", ["arrangement", *(f"attribute.{k}" for k in range(6)), *(f"field.{k}" for k in range(3))])
def test_mutated_sections(bitstream: Bitstream, name: str) -> None:
    rng = np.random.default_rng(len(name))
    data = bitstream.section(name)
    for _ in range(MUTATIONS):
        changed = bytearray(data)
        for at in rng.integers(0, len(data), rng.integers(1, 4)):
            changed[at] = rng.integers(0, 256)
        try:
            read_all(with_section(bitstream, name, bytes(changed)))
        except FormatError as exc:
            assert "section" in str(exc)
    for stop in {0, 1, len(data) // 2, len(data) - 1}:
        with pytest.raises(FormatError):
            read_all(with_section(bitstream, name, data[:stop]))
    with pytest.raises(FormatError):
        read_all(with_section(bitstream, name, data + b"\0"))


def test_sections_that_are_missing(bitstream: Bitstream) -> None:
    for name in ("attribute.2", "field.1", "image.0"):
        sections = {key: data for key, data in bitstream.sections.items() if key != name}
        with pytest.raises(CorruptFile, match=f"'{name}' is missing"):
            read_all(dataclasses.replace(bitstream, sections=sections))


def test_a_directory_that_lies(bitstream: Bitstream) -> None:
    directory = unpack_directory(bitstream.section(SECTION), bitstream.n_vertices)
    uv, *others = directory.attributes
    for changed in (
        dataclasses.replace(directory, attributes=(dataclasses.replace(uv, components=3), *others)),
        dataclasses.replace(directory, attributes=(dataclasses.replace(uv, dtype="int8"), *others)),
        dataclasses.replace(directory, attributes=(dataclasses.replace(uv, section="attribute.1"), *others)),
        dataclasses.replace(directory, attributes=(dataclasses.replace(uv, domain="triangle"), *others)),
        dataclasses.replace(directory, fields=tuple(dataclasses.replace(f, components=2) for f in directory.fields)),
        dataclasses.replace(directory, fields=tuple(dataclasses.replace(f, dtype="uint8") for f in directory.fields)),
        dataclasses.replace(directory, parts=directory.parts[:1]),
    ):
        with pytest.raises(FormatError):
            read_all(with_section(bitstream, SECTION, pack_directory(changed, bitstream.n_vertices)))


def test_what_a_newer_version_wrote_is_skipped_and_told(bitstream: Bitstream) -> None:
    reader = open_reader(bitstream)
    asset = AssetReader(with_section(bitstream, SECTION, pack_json({"version": 2, "parts": 5})), reader)
    assert asset.directory == Directory(version=2)
    assert asset.faces.shape == reader.faces.shape
    assert "all of it" in file_notes(asset.directory, bitstream)[0]
    directory = unpack_directory(bitstream.section(SECTION), bitstream.n_vertices)
    newer = tuple(dataclasses.replace(each, coding=9) if each.name == "stress" else each for each in directory.fields)
    packed = pack_directory(dataclasses.replace(directory, fields=newer), bitstream.n_vertices)
    asset = AssetReader(with_section(bitstream, SECTION, packed), reader)
    assert list(asset.fields) == ["flow", "state"]
    assert "stress" in file_notes(asset.directory, bitstream)[0]


def test_errors_name_the_file(tmp_path: Path, bitstream: Bitstream) -> None:
    damaged = with_section(bitstream, "attribute.0", b"\xff" * 9)
    asset = AssetReader(damaged, open_reader(damaged), "walk.mp4")
    with pytest.raises(CorruptFile, match=r"^walk\.mp4: section 'attribute\.0'"):
        asset.attributes["uv"]
