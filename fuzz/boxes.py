"""The boxes of an MP4 file as a tree that can be changed: sizes are those of what the boxes hold."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

from fuzz.mutation import mutate_bytes

HOLDERS = {b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts", b"dinf", b"udta", b"mvex", b"moof", b"traf"}
CHUNKS = (b"stco", b"co64")


@dataclass
class Box:
    """One box: its kind, and its bytes or the boxes in it."""

    kind: bytes
    content: bytes = b""
    boxes: list[Box] = field(default_factory=list)

    def pack(self) -> bytes:
        """The box as a file has it."""
        content = self.content + b"".join(box.pack() for box in self.boxes)
        return struct.pack(">I", 8 + len(content)) + self.kind + content


def parse_boxes(data: bytes) -> list[Box]:
    """Boxes of a sound file, those of holders in them."""
    boxes, position = [], 0
    while position + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, position)
        content = data[position + 8 : position + size]
        boxes.append(Box(kind, boxes=parse_boxes(content)) if kind in HOLDERS else Box(kind, content))
        position += max(size, 8)
    return boxes


def mutate_boxes(data: bytes, rng: np.random.Generator) -> bytes:
    """Change one box: its fields, its kind, its place; offsets of samples follow what was inserted before them."""
    boxes = parse_boxes(data)
    before = _media_start(boxes)
    holder = _choose_holder(boxes, rng)
    if not holder:
        return data
    i, j = (int(k) for k in rng.integers(len(holder), size=2))
    match int(rng.integers(10)):
        case 0:
            del holder[i]
        case 1:
            holder.insert(j, holder[i])
        case 2:
            holder[i], holder[j] = holder[j], holder[i]
        case 3:
            holder[i] = Box(
                bytes(rng.choice(list(b"abcdefghijklmnopqrstuvwxyz0 \0\xa9\x1b"), 4).tolist()),
                holder[i].content,
                holder[i].boxes,
            )
        case 4:
            holder.insert(i, Box(b"free", rng.bytes(int(rng.integers(40)))))
        case _:
            holder[i].content = mutate_bytes(holder[i].content, rng)
    if rng.random() < 0.8:
        _move_chunks(boxes, _media_start(boxes) - before)
    return b"".join(box.pack() for box in boxes)


def _choose_holder(boxes: list[Box], rng: np.random.Generator) -> list[Box]:
    holders, todo = [boxes], [box.boxes for box in boxes]
    while todo:
        inside = todo.pop()
        if inside:
            holders.append(inside)
            todo += [box.boxes for box in inside]
    return holders[int(rng.integers(len(holders)))]


def _media_start(boxes: list[Box]) -> int:
    start = 0
    for box in boxes:
        if box.kind == b"mdat":
            break
        start += len(box.pack())
    return start


def _move_chunks(boxes: list[Box], distance: int) -> None:
    for box in boxes:
        _move_chunks(box.boxes, distance)
        if box.kind in CHUNKS and len(box.content) >= 8:
            form = ">u4" if box.kind == b"stco" else ">u8"
            usable = 8 + (len(box.content) - 8) // int(form[2]) * int(form[2])
            places = np.frombuffer(box.content[8:usable], form).astype(np.int64) + distance
            box.content = box.content[:8] + places.astype(form).tobytes() + box.content[usable:]
