"""Files of captures: taken apart into head, index, shared sections, poster and shots, changed, and put together again.

Lengths and checksums of the index are made anew after each change, and so is the checksum of a bare shot.
"""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import numpy as np

from fuzz.boxes import mutate_boxes
from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import Parts, Seed, Target
from fuzz.results import check_faces, check_positions
from fuzz.videos import FILE
from gvpipe.container import bare
from gvpipe.container.bitstream import CHECKSUM, VERSION
from gvpipe.container.boxes import read_box, uuid_head
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.shot_layout import HEAD as HEAD_FIELDS
from gvpipe.container.shot_layout import MAGIC, SHOT_UUID
from gvpipe.container.sources import BytesSource
from gvpipe.container.stream_layout import DATA_UUID, SHOTS_UUID, find_index
from gvpipe.foundation.errors import FormatError
from gvpipe.playback.capture_player import CapturePlayer

HEAD, INDEX, POSTER = "(head)", "(index)", "(poster)"
SHARED, SHOT = "shared.", "shot."
MOST_VALUES = 1 << 22  # coordinates that are read of a file
RIGHT = 0.7  # of the cases whose lengths are right again


def split_capture(data: bytes) -> Parts:
    """A sound file in parts, in the order of the file; the index is JSON."""
    source = BytesSource(data)
    box = find_index(source)
    assert box is not None
    cursor = Cursor(data[box.content + len(MAGIC) + 2 : box.stop - CHECKSUM.size], "index")
    header = zlib.decompress(cursor.block())
    values = json.loads(header)
    parts: Parts = {HEAD: data[: box.start], INDEX: header}
    at = box.stop
    if values["shared"]:
        at += len(uuid_head(DATA_UUID, 0))
        for number, length in enumerate(values["shared"].values()):
            parts[f"{SHARED}{number}"] = data[at : at + length]
            at += length
    parts[POSTER] = data[at : at + values["poster"]]
    at += values["poster"]
    for number, length in enumerate(values["shots"]["bytes"]):
        shot = read_box(source.read, at, len(data))
        assert shot is not None and shot.uuid == SHOT_UUID.bytes
        parts[f"{SHOT}{number}"] = data[shot.content : shot.content + length]
        at = shot.stop
    return parts


def join_capture(parts: Parts) -> dict[str, bytes]:
    """The file of some parts."""
    shared = [data for name, data in parts.items() if name.startswith(SHARED)]
    shots = [data for name, data in parts.items() if name.startswith(SHOT)]
    packed = MAGIC + VERSION.to_bytes(2, "little") + pack_block(zlib.compress(_measured(parts, shared, shots), 9))
    packed += HEAD_FIELDS.pack(len(parts[HEAD]), zlib.crc32(parts[HEAD]))
    packed += CHECKSUM.pack(zlib.crc32(packed))
    content = [parts[HEAD], uuid_head(SHOTS_UUID, len(packed)), packed]
    if shared:
        content += [uuid_head(DATA_UUID, sum(map(len, shared))), *shared]
    content += [parts[POSTER], *(uuid_head(SHOT_UUID, len(data)) + _checked(data) for data in shots)]
    return {FILE: b"".join(content)}


def _measured(parts: Parts, shared: list[bytes], shots: list[bytes]) -> bytes:
    """The index with the lengths that the parts have, where it is still one, and as it is in some cases."""
    index = parts[INDEX]
    if zlib.crc32(index) % 10 >= 10 * RIGHT:
        return index
    try:
        values = json.loads(index)
        values["poster"] = len(parts[POSTER])
        values["shots"]["bytes"] = [len(data) for data in shots]
        values["shared"] = dict(zip(values["shared"], map(len, shared), strict=True))
        return json.dumps(values, separators=(",", ":")).encode()
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return index


def _checked(data: bytes) -> bytes:
    """A bare shot whose checksum is right."""
    start = data.find(bare.MAGIC)
    if start < 0 or len(data) - start < 2 * CHECKSUM.size:
        return data
    content = data[: -CHECKSUM.size]
    return content + CHECKSUM.pack(zlib.crc32(content[start:]))


def capture_target(seeds: tuple[Seed, ...]) -> Target:
    """The parser of captures."""
    return Target("capture", seeds, _mutate, join_capture, parse_capture, (FormatError,))


def parse_capture(path: Path) -> None:
    """Open a file and read what a player reads; of very large ones the first frame of each shot.

    Raises:
        FormatError: it is refused.
        BrokenPromise: what was read cannot be.
    """
    with CapturePlayer(path) as video:
        left = MOST_VALUES
        for shot in video.shots:
            n_frames, n_vertices, _ = shot.shape
            check_faces(shot.faces, n_vertices)
            stop = max(1, min(n_frames, left // (3 * n_vertices)))
            check_positions(shot[:stop], (stop, n_vertices, 3))
            left -= 3 * n_vertices * stop


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change parts; now and then one is left out, or comes to another place."""
    for _ in range(1 + (int(rng.geometric(0.5)) if rng.random() < 0.5 else 0)):
        names = [name for name in parts if name not in (HEAD, INDEX)]
        name = str(rng.choice([HEAD, INDEX, names[int(rng.integers(len(names)))]], p=[0.1, 0.4, 0.5]))
        if name == INDEX:
            parts[name] = mutate_json(parts[name], rng)
        elif name in (HEAD, POSTER):
            parts[name] = mutate_boxes(parts[name], rng)
        elif rng.random() < 0.1 and len(names) > 2:
            moved = parts.pop(name)
            if rng.random() < 0.5:
                parts[name] = moved
        else:
            parts[name] = mutate_bytes(parts[name], rng)
    return parts
