"""The stream layout: lossless both ways, read piece by piece, and as hostile as any file."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from folders import GOLDEN
from sequences import held, waving

import gvpipe
from fuzz.streams import join_stream, split_stream
from fuzz.videos import FILE
from gvpipe.coding.registry import segment_parts
from gvpipe.container import mp4
from gvpipe.container.fragments import count_pictures, split_fragments
from gvpipe.container.sources import FileSource
from gvpipe.container.stream_layout import FRAGMENT, INDEX_UUID, find_index
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, NewerVersion, StrippedFile, TruncatedFile

FILES = ["mcgv-1-h264", "mcgv-1-jpeg", "mcgv-1-klt-10", "mcgv-1-outliers", "mcgv-1-rigid", "pca-1-still", "pca-1-kalman"]
FILES += ["laplacian-1", "laplacian-1-still", "pdct-1-asset", "pdct-1-still"]
SEGMENTED: dict[str, dict[str, Any]] = {
    "mcgv": {"segment": 20, "gop": 16},
    "mcgv klt": {"segment": 20, "transform": "klt"},
    "mcgv jpeg": {"segment": 20, "image": "jpeg"},
    "pca": {"segment": 20},
    "laplacian": {"segment": 20},
    "pdct": {"segment": 20},
}


def streamed(name: str, folder: Path) -> tuple[Path, Path]:
    """A golden file as it is written today, in both layouts."""
    plain, stream = folder / f"{name}.mp4", folder / f"{name}-stream.mp4"
    mp4.write_file(mp4.read_file(GOLDEN / f"{name}.mp4"), plain)
    assert gvpipe.restream(plain, stream).layout == "stream"
    return plain, stream


@pytest.mark.parametrize("name", FILES)
def test_both_ways_without_loss(name: str, tmp_path: Path) -> None:
    plain, stream = streamed(name, tmp_path)
    a, b = mp4.read_file(plain), mp4.read_file(stream)
    assert (a.layout, b.layout) == ("plain", "stream")
    assert dict(a.sections) == dict(b.sections) and list(a.sections) == list(b.sections)
    assert a == mp4.load(b) or a.header == b.header
    assert gvpipe.restream(stream, tmp_path / "back.mp4").layout == "plain"
    assert (tmp_path / "back.mp4").read_bytes() == plain.read_bytes()
    assert np.array_equal(gvpipe.decode(plain).read(0, a.n_frames), gvpipe.decode(stream).read(0, a.n_frames))


def test_a_layout_may_be_asked_for(tmp_path: Path) -> None:
    plain, stream = streamed("mcgv-1-h264", tmp_path)
    assert gvpipe.restream(stream, tmp_path / "again.mp4", "stream").bytes == stream.stat().st_size
    assert (tmp_path / "again.mp4").read_bytes() == stream.read_bytes()
    with pytest.raises(InputError, match="plain or stream is needed"):
        gvpipe.restream(plain, tmp_path / "x.mp4", "other")
    found = gvpipe.info(stream)
    assert found.layout == "stream" and sum(found.sections.values()) == found.bytes == stream.stat().st_size
    assert gvpipe.info(plain).layout == "plain"


@pytest.mark.parametrize("variant", list(SEGMENTED))
def test_a_jump_reads_the_index_and_one_segment(variant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mp4"
    sequence = waving(8, 60)
    gvpipe.encode(sequence, path, variant.split()[0], stream=True, **SEGMENTED[variant])
    places: list[tuple[int, int]] = []
    plain = FileSource.read

    def noted(self: FileSource, offset: int, length: int) -> bytes:
        places.append((offset, offset + length))
        return plain(self, offset, length)

    monkeypatch.setattr(FileSource, "read", noted)
    with gvpipe.open(path) as video:
        video[0]
        first = max(stop for _, stop in places)
        places.clear()
        frame = video[59]
        last = min(start for start, _ in places)
        assert 0 < first <= last  # the first frame needs the first part of the file, the last frame another one
        assert np.array_equal(frame, gvpipe.decode(path).read(59, 60)[0])
    assert any(stop > 0.8 * path.stat().st_size for _, stop in places)


def test_repeated_frames_and_corrections(tmp_path: Path) -> None:
    sequence = held(waving(6, 24), [1, 3] * 12)
    report = gvpipe.encode(sequence, tmp_path / "a.mp4", "pca", stream=True, max_error="0.2%", segment=8)
    assert report.bytes == (tmp_path / "a.mp4").stat().st_size
    assert (gvpipe.compare(sequence, gvpipe.read(tmp_path / "a.mp4")).max_diag or 1) <= 0.002


def test_a_size_that_is_asked_for_is_that_of_the_plain_layout(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="restream"):
        gvpipe.encode(waving(4, 4), tmp_path / "a.mp4", stream=True, target_bpvf=10)


def test_players_see_the_same_pictures(tmp_path: Path) -> None:
    plain, stream = streamed("mcgv-1-h264", tmp_path)
    decoded = []
    for path in (plain, stream):
        with av.open(path) as container:
            decoded.append([(frame.pts, frame.to_ndarray()) for frame in container.decode(video=0)])
    assert len(decoded[0]) == len(decoded[1]) > 1
    for (at, picture), (other_at, other) in zip(*decoded, strict=True):
        assert at == other_at and np.array_equal(picture, other)


def test_remuxed_files_say_so(tmp_path: Path) -> None:
    _, stream = streamed("mcgv-1-h264", tmp_path)
    with av.open(stream) as source, av.open(tmp_path / "copy.mp4", "w") as target:
        target.metadata.update(source.metadata)
        track = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.size:
                packet.stream = track
                target.mux(packet)
    with pytest.raises(StrippedFile):
        mp4.read_file(tmp_path / "copy.mp4")


def read_all(path: Path) -> np.ndarray:
    return gvpipe.decode(path).read(0, 4)


@pytest.mark.parametrize("name", ["pdct-1-still", "mcgv-1-h264"])
def test_damage_is_noticed(name: str, tmp_path: Path) -> None:
    _, stream = streamed(name, tmp_path)
    data, wanted, path = stream.read_bytes(), read_all(stream), tmp_path / "b.mp4"
    for end in [*range(0, 60, 7), *range(60, len(data), 131), len(data) - 1]:
        path.write_bytes(data[:end])
        with pytest.raises(FormatError, match="again from its source|encode the sequence first"):
            mp4.read_file(path)
    for at in range(0, len(data), 67):
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        try:  # heads of boxes that gvpipe does not need have no checksum
            assert np.array_equal(read_all(path), wanted)
        except FormatError as exc:
            assert str(exc).startswith(str(path)) and "\n" not in str(exc)
    path.write_bytes(data + b"\0")
    with pytest.raises(CorruptFile, match="stray"):
        mp4.read_file(path)


@pytest.mark.parametrize("name", ["pdct-1-still", "mcgv-1-h264"])
def test_every_section_and_fragment_has_a_checksum(name: str, tmp_path: Path) -> None:
    _, stream = streamed(name, tmp_path)
    data, bitstream, path = bytearray(stream.read_bytes()), mp4.read_file(stream), tmp_path / "b.mp4"
    for section, content in bitstream.sections.items():
        at = bytes(data).index(content)
        path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        with pytest.raises(CorruptFile, match=section):
            mp4.read_file(path).section(section)
    assert bitstream.fragments is not None
    at = bytes(data).index(bitstream.fragments.read(0)) + 30
    path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    with pytest.raises(CorruptFile, match="fragment 0"):
        mp4.load(mp4.read_file(path))


def with_index(path: Path, change: Any) -> bytes:
    """A file whose index is changed, with a checksum that holds."""
    data = bytearray(path.read_bytes())
    box = find_index(FileSource(path))
    assert box is not None
    header = zlib_header(bytes(data), box.content)
    packed = data[box.content : header - 4]
    changed = change(bytearray(packed))
    assert len(changed) == len(packed)
    data[box.content : header] = bytes(changed) + struct.pack("<I", zlib.crc32(changed))
    return bytes(data)


def zlib_header(data: bytes, at: int) -> int:
    """Where the section ``header`` starts: the place that the first entry names."""
    entry = at + 12 + 1 + len("header")
    return int(struct.unpack_from("<QIQ", data, entry)[2])


def poke(offset: int, fmt: str, value: int) -> Any:
    def change(index: bytearray) -> bytearray:
        struct.pack_into(fmt, index, offset % len(index), value)
        return index

    return change


def test_an_index_that_lies_is_refused(tmp_path: Path) -> None:
    _, stream = streamed("mcgv-1-h264", tmp_path)
    path, size = tmp_path / "b.mp4", stream.stat().st_size
    second = 12 + 1 + 6 + 20 + 1 + 4  # "mesh", behind "header"
    fragments = -16 - FRAGMENT.itemsize  # the last of them
    lies: list[tuple[Any, str]] = [
        (poke(8, "<H", 9), "upgrade"),
        (poke(10, "<H", 0), "0 sections"),
        (poke(second, "<Q", size), "outside|overlap"),
        (poke(second, "<Q", (1 << 64) - 1), "outside"),
        (poke(second + 12, "<Q", 0), "overlap"),
        (poke(second + 12, "<Q", (1 << 64) - 1), "outside"),
        (poke(fragments, "<Q", size - 10), "outside"),
        (poke(fragments + 8, "<I", (1 << 32) - 1), "outside"),
        (poke(fragments - 4, "<I", 1 << 31), "more bytes"),
        (poke(fragments + 16, "<I", 1 << 31), "more pictures"),
        (poke(fragments + 16, "<I", 0), "more pictures"),
        (poke(-8, "<I", 24), "behind the description"),
        (poke(-16, "<Q", size + 1), "1 bytes early"),
    ]
    for change, message in lies:
        path.write_bytes(with_index(stream, change))
        with pytest.raises((CorruptFile, NewerVersion, TruncatedFile), match=message):
            mp4.read_file(path)
    path.write_bytes(with_index(stream, poke(fragments + 16, "<I", 7)))  # pictures
    with pytest.raises(CorruptFile, match="not what its index describes|in place of"):
        gvpipe.open(path)[0]


def test_a_content_id_of_any_text_is_refused(tmp_path: Path) -> None:
    _, stream = streamed("pca-1-still", tmp_path)
    parts = split_stream(stream.read_bytes())
    header = json.loads(parts["header"])
    header["container"]["id"] = "another"
    stream.write_bytes(join_stream({**parts, "header": json.dumps(header).encode()})[FILE])
    with pytest.raises(CorruptFile, match="belongs to another file"):
        gvpipe.open(stream)


def test_fragments_claim_no_more_pictures_than_bytes(tmp_path: Path) -> None:
    _, stream = streamed("mcgv-1-h264", tmp_path)
    bitstream = mp4.read_file(stream)
    assert bitstream.fragments is not None
    video = bitstream.fragments.head + bitstream.fragments.read(0)
    _, (fragment, *_) = split_fragments(video)
    at = fragment.moof.index(b"trun") + 8
    for count in (0, 1 << 31, len(fragment.mdat) - 7):
        with pytest.raises(CorruptFile, match="announced"):
            count_pictures(fragment.moof[:at] + struct.pack(">I", count) + fragment.moof[at + 4 :], len(fragment.mdat))
    for wrong in (fragment.moof[:40], fragment.moof + b"\0", b"\0\0\0\x08moof", fragment.moof.replace(b"tfdt", b"trun")):
        with pytest.raises(CorruptFile):
            count_pictures(wrong, len(fragment.mdat))


def test_a_moov_with_pictures_is_refused(tmp_path: Path) -> None:
    plain, stream = streamed("mcgv-1-h264", tmp_path)
    data = plain.read_bytes()
    index = data.index(b"mdat") - 4
    foreign = stream.read_bytes()
    box = foreign[foreign.index(INDEX_UUID.bytes) - 8 :]
    (tmp_path / "b.mp4").write_bytes(data[:index] + box)
    with pytest.raises(FormatError):
        mp4.read_file(tmp_path / "b.mp4")


def test_a_file_that_changes_while_it_is_open(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    gvpipe.encode(waving(6, 40), path, "pca", stream=True, segment=10)
    with gvpipe.open(path) as video:
        video[0]
        gvpipe.encode(waving(6, 41), path, "pca", stream=True, segment=10)
        with pytest.raises(FormatError, match="has changed since it was opened"):
            video[35]
        path.unlink()
        with pytest.raises(InputError, match="no longer be read"):
            video[35]


def test_parts_name_what_is_there(tmp_path: Path) -> None:
    for variant, settings in SEGMENTED.items():
        gvpipe.encode(waving(5, 45), tmp_path / "a.mp4", variant.split()[0], **settings)
        bitstream = mp4.read_file(tmp_path / "a.mp4")
        parts = segment_parts(bitstream)
        named = {name for names in parts.sections for name in names} & set(bitstream.sections)
        assert len(parts.sections) == 3
        assert named == {name for name in bitstream.sections if name[-1].isdigit()}
