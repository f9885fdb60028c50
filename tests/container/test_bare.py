"""The bare layout: the same geometry as in the plain layout, in fewer bytes, and every damage noticed."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path

import av
import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.container import bare
from gvpipe.container.bitstream import VERSION
from gvpipe.container.compact_header import RAW
from gvpipe.container.cursor import pack_block
from gvpipe.container.mp4 import read_file
from gvpipe.foundation.errors import CorruptFile, FormatError, NewerVersion, SettingError, TruncatedFile

SEQUENCE = waving(8, 6)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same encode in the plain and in the bare layout."""
    folder = tmp_path_factory.mktemp("bare")
    gvpipe.encode(SEQUENCE, folder / "plain.mp4", "pca")
    gvpipe.encode(SEQUENCE, folder / "bare.mp4", "pca", bare=True)
    return folder / "plain.mp4", folder / "bare.mp4"


def test_same_geometry_in_fewer_bytes(files: tuple[Path, Path]) -> None:
    plain, found = map(gvpipe.open, files)
    np.testing.assert_array_equal(found[:], plain[:])
    np.testing.assert_array_equal(found.faces, plain.faces)
    assert dict(found.bitstream.sections) == dict(plain.bitstream.sections)
    info = gvpipe.info(files[1])
    assert info.layout == "bare" and info.sections["container"] < 160
    assert info.bytes == sum(info.sections.values()) == files[1].stat().st_size
    assert info.bytes < gvpipe.info(files[0]).bytes - 700


def test_ffmpeg_opens_it_as_a_film_without_tracks(files: tuple[Path, Path]) -> None:
    with av.open(io.BytesIO(files[1].read_bytes())) as film:
        assert "mp4" in film.format.name and not film.streams


def test_pictures_stay(tmp_path: Path) -> None:
    gvpipe.encode(SEQUENCE, tmp_path / "plain.mp4", "mcgv", image="jpeg", clusters=2)
    gvpipe.encode(SEQUENCE, tmp_path / "bare.mp4", "mcgv", image="jpeg", clusters=2, bare=True)
    found = gvpipe.open(tmp_path / "bare.mp4")
    np.testing.assert_array_equal(found[:], gvpipe.open(tmp_path / "plain.mp4")[:])
    data = bytearray((tmp_path / "bare.mp4").read_bytes())
    data[data.index(b"mdat") + 20] ^= 1
    (tmp_path / "damaged.mp4").write_bytes(data)
    with pytest.raises(CorruptFile, match="its video is damaged"):
        gvpipe.open(tmp_path / "damaged.mp4")


def test_a_target_is_kept_and_the_poster_left_out(tmp_path: Path) -> None:
    report = gvpipe.encode(SEQUENCE, tmp_path / "a.mp4", "pca", max_error="0.1%", bare=True)
    assert "video" not in report.sections and report.bytes == (tmp_path / "a.mp4").stat().st_size
    error = gvpipe.compare(SEQUENCE, gvpipe.read(tmp_path / "a.mp4")).max_diag
    assert error is not None and error <= 0.001


def test_restream_gives_it_a_poster(files: tuple[Path, Path], tmp_path: Path) -> None:
    done = gvpipe.restream(files[1], tmp_path / "a.mp4")
    assert done.layout == "plain" and done.bytes_before == files[1].stat().st_size
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert len(film.streams.video) == 1
    np.testing.assert_array_equal(gvpipe.open(tmp_path / "a.mp4")[:], gvpipe.open(files[1])[:])


def test_a_page_holds_the_plain_layout(files: tuple[Path, Path], tmp_path: Path) -> None:
    report = gvpipe.export_html(files[1], tmp_path / "a.html")
    assert abs(report.video_bytes - files[0].stat().st_size) < 100  # the poster is of decoded positions


def test_every_damage_is_noticed(files: tuple[Path, Path], tmp_path: Path) -> None:
    data, path = files[1].read_bytes(), tmp_path / "a.mp4"
    for size in [*range(70), *range(70, len(data), 61), len(data) - 1]:
        path.write_bytes(data[:size])
        with pytest.raises(FormatError, match=r"a\.mp4: "):
            read_file(path)
    for place in [*range(20, 80), *range(80, len(data), 61)]:
        changed = bytearray(data)
        changed[place] ^= 0x21
        path.write_bytes(changed)
        with pytest.raises(FormatError, match=r"a\.mp4: "):
            read_file(path)
    path.write_bytes(data + b"\0")
    with pytest.raises(FormatError, match="stray"):
        read_file(path)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (b'{"codec":"pca"}', "'sections'|an object is missing|'version'"),
        (b'"text"', "an object is missing"),
        (b" " * (1 << 21), "more than"),
    ],
)
def test_bad_headers_are_refused(header: bytes, message: str) -> None:
    deflater = zlib.compressobj(9, zlib.DEFLATED, RAW, zdict=bare.DICTIONARY)
    packed = deflater.compress(header) + deflater.flush()
    content = bare.MAGIC + bare.PREFIX.pack(VERSION) + pack_block(packed)
    with pytest.raises(CorruptFile, match=message):
        bare.unpack_bare(content + struct.pack("<I", zlib.crc32(content)))


def test_short_and_newer_payloads(files: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(TruncatedFile):
        bare.unpack_bare(bare.MAGIC)
    data = files[1].read_bytes().replace(bare.MAGIC + b"\1\0", bare.MAGIC + b"\3\0")
    (tmp_path / "a.mp4").write_bytes(data)
    with pytest.raises(NewerVersion, match="container version 3"):
        read_file(tmp_path / "a.mp4")


def test_one_layout_at_a_time(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="two layouts"):
        gvpipe.encode(SEQUENCE, tmp_path / "a.mp4", "pca", stream=True, bare=True)
