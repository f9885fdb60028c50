"""`gvpipe.info` tells what a file says of its mesh, and decodes only where the file says nothing."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from odd_headers import header_of, payload_of

import gvpipe
from gvpipe.coding.registry import codec_ids
from gvpipe.container.bitstream import Bitstream, pack_header, read_header, unpack_payload
from gvpipe.container.json_object import pack_json
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.container.outline import Outline
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence

DECODERS = ("scipy", "numba", "cv2", "gvcodecs", "trimesh", "DracoPy")


def without_box(info: gvpipe.Info) -> dict[str, Any]:
    """What two files of one sequence have in common, whatever their layouts."""
    hidden = ("bounding_box", "bytes", "bpvf", "sections", "layout")
    return {key: value for key, value in info.to_json().items() if key not in hidden}


@pytest.mark.parametrize("codec", codec_ids())
@pytest.mark.parametrize("make", ["sequence", "scene"])
def test_a_file_says_what_decoding_it_gives(codec: str, make: str, sequence: MeshSequence, tmp_path: Path) -> None:
    source = sequence if make == "sequence" else scene()
    for name in ("plain", "bare"):
        gvpipe.encode(source, tmp_path / f"{name}.mp4", codec, bare=name == "bare", quality=100)
    stored, found = read_file(tmp_path / "plain.mp4").outline, gvpipe.open(tmp_path / "plain.mp4").outline()
    assert stored is not None and read_file(tmp_path / "bare.mp4").outline is None
    assert dataclasses.replace(stored, box=()) == dataclasses.replace(found, box=())
    assert stored.box == pytest.approx(found.box, abs=0.01 * float(np.ptp(source[0])))
    first = source[0]
    assert np.array_equal(np.array(stored.box, np.float32), [*first.min(axis=0), *first.max(axis=0)])
    said, decoded = gvpipe.info(tmp_path / "plain.mp4"), gvpipe.info(tmp_path / "bare.mp4")
    assert without_box(said) == without_box(decoded)
    assert said.bounding_box == {"min": list(stored.box[:3]), "max": list(stored.box[3:])}


def test_of_such_a_file_nothing_is_decoded(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4", "pca")
    code = "import sys; from gvpipe import info; info(sys.argv[1]); print([n for n in sys.argv[2:] if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.mp4"), *DECODERS], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


def test_other_layouts_keep_or_get_it(tmp_path: Path, sequence: MeshSequence) -> None:
    plain, stream, bare, from_bare = (tmp_path / f"{name}.mp4" for name in ("plain", "stream", "bare", "from_bare"))
    gvpipe.encode(sequence, plain, "pca")
    gvpipe.restream(plain, stream)
    gvpipe.encode(sequence, bare, "pca", bare=True)
    gvpipe.restream(bare, from_bare)
    wanted = read_file(plain).outline
    assert wanted is not None and read_file(stream).outline == wanted
    got = read_file(from_bare).outline
    assert got is not None and got.levels == wanted.levels


def test_files_of_earlier_versions_are_decoded(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "now.mp4", "pca")
    write_file(dataclasses.replace(read_file(tmp_path / "now.mp4"), outline=None), tmp_path / "before.mp4")
    assert without_box(gvpipe.info(tmp_path / "now.mp4")) == without_box(gvpipe.info(tmp_path / "before.mp4"))


def test_an_asset_of_a_newer_version_is_told_and_not_listed(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4", "pca")
    bitstream = read_file(tmp_path / "a.mp4")
    newer = {**bitstream.sections, "asset": pack_json({"version": 2, "parts": []})}
    write_file(dataclasses.replace(bitstream, sections=newer), tmp_path / "b.mp4")
    found = gvpipe.info(tmp_path / "b.mp4")
    assert found.parts == [] and found.polygons == {} and "all of it" in found.notes[0]


def test_of_very_many_parts_a_header_says_nothing() -> None:
    many = Bitstream("pca", 1, 1, 9, 1 << 20, 30.0, outline=Outline((0.0,) * 6, part_triangles=(1,) * 20_000))
    assert read_header(pack_header(many, {}))[0].outline is None


@pytest.mark.parametrize(
    "outline",
    [
        [],
        {},
        {"box": [0, 0, 0, 1, 1]},
        {"box": [0, 0, 0, 1, 1, "1"]},
        {"box": [0, 0, 2, 1, 1, 1]},
        {"box": [0, 0, 0, 1, 1, 1e39]},
        {"box": [0, 0, 0, 1, 1, 1], "levels": [0]},
        {"box": [0, 0, 0, 1, 1, 1], "levels": [1] * 65},
        {"box": [0, 0, 0, 1, 1, 1], "triangles": [10**9]},
        {"box": [0, 0, 0, 1, 1, 1], "polygons": [4]},
        {"box": [0, 0, 0, 1, 1, 1], "polygons": {"4": 1}},
    ],
)
def test_a_hostile_outline_is_refused(outline: Any, video: Path) -> None:
    bitstream = read_file(video)
    header = json.dumps({**header_of(bitstream), "outline": outline})
    with pytest.raises(CorruptFile, match="header"):
        unpack_payload(payload_of(header, dict(bitstream.sections)))


def test_an_outline_of_other_parts_is_refused(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4", "pca")
    bitstream = read_file(tmp_path / "a.mp4")
    write_file(dataclasses.replace(bitstream, outline=Outline((0.0,) * 6, part_triangles=(1,) * 9)), tmp_path / "b.mp4")
    with pytest.raises(CorruptFile, match=r"b\.mp4: .*outline counts the triangles of 9 parts"):
        gvpipe.info(tmp_path / "b.mp4")
