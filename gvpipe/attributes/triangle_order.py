"""Parts and polygons: the order and rotation of triangles that a codec does not keep.

    arrangement = nothing: parts follow from vertices, and there are no polygons
                | [8 bits] flags: 1 parts are coded, 2 polygons are, [varint] bytes of the parts' stream (flag 1), stream,
                  polygons' stream to the end (flag 2)

Codecs return triangles in an order of their own. They are grouped by part, then polygons are put together (`polygon_kernels`).
Streams are of `gvpipe.entropy.serial_coder`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.topology import opposite_corners
from gvpipe.mesh.unique_rows import row_ids

if TYPE_CHECKING:
    from gvpipe.attributes.fan_kernels import Soup
    from gvpipe.attributes.polygon_kernels import Fans

PARTS, POLYGONS = 1, 2  # flags


@dataclass(frozen=True)
class Arrangement:
    """Triangles as users see them.

    Args:
        faces: ``(T, 3) int32``, part after part, each polygon's triangles in order of its fan.
        part_starts: ``(n_parts + 1,)`` first triangle of each part, then T.
        polygons: ``(P,) int32`` corners of each polygon; None: there are triangles alone.
        decoded: ``(T,)`` the codec's triangle that each one is.
        first_corners: ``(T,)`` the corner 0..2 of the codec's triangle with which each one begins.
    """

    faces: Int32
    part_starts: Int64
    polygons: Int32 | None
    decoded: Int64
    first_corners: Int64


@dataclass(frozen=True)
class SourceCorners:
    """Where final triangles come from: ``triangles (T,)`` of the source, and ``corners (3T,)``, of each corner the source's."""

    triangles: Int64
    corners: Int64


def encode_arrangement(
    decoded: Int32,
    source: Int32,
    *,
    polygons: Array | None = None,
    parts: Array | None = None,
    n_parts: int = 1,
    vertex_starts: Array | None = None,
) -> tuple[bytes, Arrangement, SourceCorners]:
    """Return the bytes from which `decode_arrangement` orders a codec's triangles, their final order, and their sources.

    Args:
        decoded: ``(T, 3)`` triangles as the codec returns them.
        source: ``(T, 3)`` the same triangles as they were, over the codec's vertices.
        polygons: ``(P,)`` corners of each of the source's polygons, whose fans the triangles are in order; None: triangles.
        parts: ``(T,)`` part of each source triangle, ascending; None: all are of part 0.
        n_parts: how many parts there are.
        vertex_starts: ``(n_parts + 1,)`` first vertex of each part, if each has vertices of its own; the decoder has them.

    Raises:
        InputError: the triangles are not the same, or not fans of polygons, or parts do not ascend.
    """
    owner, turn = _match(decoded, source)
    own_parts = np.zeros(len(source), np.int64) if parts is None else np.asarray(parts, np.int64)
    if len(own_parts) and (own_parts[0] < 0 or own_parts[-1] >= n_parts or (np.diff(own_parts) < 0).any()):
        raise InputError(f"parts of triangles must ascend, from 0 to {n_parts - 1} at most")
    decoded_parts = own_parts[owner]
    ranges = _part_ranges(decoded, vertex_starts)
    flags, data = 0, b""
    if not np.array_equal(decoded_parts, ranges if len(ranges) else np.zeros(len(decoded))):
        flags, data = PARTS, pack_block(_encode_parts(decoded, ranges, decoded_parts, n_parts))
    grouped = np.argsort(decoded_parts, kind="stable")
    triangles, apexes, sizes = grouped, np.zeros(len(decoded), np.int64), None
    if polygons is not None:
        flags |= POLYGONS
        fans = _find_fans(owner[grouped], turn[grouped], source, np.asarray(polygons, np.int64), own_parts)
        stream, places, apexes, sizes = _encode_polygons(_soup(decoded, grouped, decoded_parts), fans)
        data += stream
        triangles = grouped[places]
    arrangement = _arrange(decoded, decoded_parts, n_parts, triangles, apexes, sizes)
    corners = 3 * owner[triangles][:, None] + (arrangement.first_corners[:, None] + np.arange(3) + turn[triangles][:, None]) % 3
    sources = SourceCorners(owner[triangles], corners.ravel())
    return (bytes([flags]) + data if flags else b""), arrangement, sources


def decode_arrangement(
    data: bytes, decoded: Int32, n_parts: int = 1, vertex_starts: Array | None = None, name: str = "arrangement"
) -> Arrangement:
    """Mirror of `encode_arrangement`; ``name`` is the section's, for messages.

    Raises:
        CorruptFile: the bytes are not what the encoder writes for these triangles.
    """
    cursor = Cursor(data, name)
    flags = cursor.take(1)[0] if data else 0
    if flags > PARTS | POLYGONS or (data and not flags):
        raise cursor.corrupt("unknown flags")
    ranges = _part_ranges(decoded, vertex_starts)
    parts = ranges if len(ranges) else np.zeros(len(decoded), np.int64)
    if len(parts) and parts.max() >= n_parts:
        raise cursor.corrupt("a vertex has no part")
    if flags & PARTS:
        parts = _decode_parts(cursor.block(), decoded, ranges, n_parts, name)
    grouped = np.argsort(parts, kind="stable")
    triangles, apexes, sizes = grouped, np.zeros(len(decoded), np.int64), None
    if flags & POLYGONS:
        places, apexes, sizes = _decode_polygons(cursor.rest(), _soup(decoded, grouped, parts), name)
        triangles = grouped[places]
    cursor.end()
    return _arrange(decoded, parts, n_parts, triangles, apexes, sizes)


def _match(decoded: Int32, source: Int32) -> tuple[Int64, Int64]:
    """``(T,)`` the source of each decoded triangle, equal ones in order, and by how many corners the source is turned."""
    if decoded.shape != source.shape:
        raise InputError(f"{len(decoded)} decoded triangles for {len(source)}: they must be the same")
    turned, own_turn = _least_rotation(np.concatenate([decoded, source]))
    n = len(decoded)
    ids = row_ids(turned)[0]
    owner = np.empty(n, np.int64)
    owner[np.argsort(ids[:n], kind="stable")] = np.argsort(ids[n:], kind="stable")
    if not np.array_equal(ids[:n], ids[n:][owner]):
        raise InputError("the decoded triangles are not those of the source")
    return owner, (own_turn[n:][owner] - own_turn[:n]) % 3


def _least_rotation(faces: Array) -> tuple[Int64, Int64]:
    """``(n, 3)`` triangles rotated so that their corners are least, compared in order, and by how much, ``(n,)``."""
    best, turn = faces.astype(np.int64), np.zeros(len(faces), np.int64)
    for k in (1, 2):
        other = np.roll(faces, -k, axis=1)
        differs = other != best
        first = differs.argmax(axis=1)[:, None]
        less = np.take_along_axis(other, first, axis=1)[:, 0] < np.take_along_axis(best, first, axis=1)[:, 0]
        best[less], turn[less] = other[less], k
    return best, turn


def _part_ranges(decoded: Int32, vertex_starts: Array | None) -> Int64:
    """``(T,)`` the part of each triangle's first vertex; none if parts have no vertices of their own."""
    if vertex_starts is None:
        return np.zeros(0, np.int64)
    return np.asarray(np.searchsorted(vertex_starts, decoded[:, 0], side="right") - 1, np.int64)


def _encode_parts(decoded: Int32, ranges: Int64, parts: Int64, n_parts: int) -> bytes:
    from gvpipe.attributes.part_kernels import N_PART_CONTEXTS, code_parts
    from gvpipe.entropy.serial_coder import SerialEncoder

    coder = SerialEncoder(N_PART_CONTEXTS, len(parts))
    code_parts(coder.coder, opposite_corners(decoded), ranges, parts.copy(), n_parts)
    return coder.finish()


def _decode_parts(data: bytes, decoded: Int32, ranges: Int64, n_parts: int, name: str) -> Int64:
    from gvpipe.attributes.part_kernels import N_PART_CONTEXTS, code_parts
    from gvpipe.entropy.serial_coder import SerialDecoder

    coder = SerialDecoder(data, N_PART_CONTEXTS, name)
    parts = np.zeros(len(decoded), np.int64)
    code_parts(coder.coder, opposite_corners(decoded), ranges, parts, n_parts)
    coder.end()
    return parts


def _soup(decoded: Int32, grouped: Int64, parts: Int64) -> Soup:
    from gvpipe.attributes.fan_kernels import Soup

    triangles = np.ascontiguousarray(decoded[grouped], np.int32)
    return Soup(triangles, opposite_corners(triangles), parts[grouped])


def _find_fans(owner: Int64, turn: Int64, source: Int32, polygons: Int64, parts: Int64) -> Fans:
    """What triangles, in the order grouped by parts, are of polygons."""
    from gvpipe.attributes.polygon_kernels import Fans

    if (polygons < 3).any() or int((polygons - 2).sum()) != len(source):
        raise InputError(
            f"polygons of {int((polygons - 2).sum())} triangles for {len(source)}; each has three corners at least"
        )
    starts = np.concatenate([[0], np.cumsum(polygons - 2)])
    polygon = np.repeat(np.arange(len(polygons)), polygons - 2)
    place = np.arange(len(source)) - starts[polygon]
    inner = np.flatnonzero(place > 0)
    is_fan = (source[inner, 0] == source[inner - 1, 0]) & (source[inner, 1] == source[inner - 1, 2])
    if not (is_fan & (parts[inner] == parts[inner - 1])).all():
        raise InputError("the triangles of a polygon are not its fan, or not of one part")
    members = np.empty(len(source), np.int64)
    members[owner] = np.arange(len(source))
    return Fans(polygon[owner], place[owner], (-turn) % 3, starts, members)


def _encode_polygons(soup: Soup, fans: Fans) -> tuple[bytes, Int64, Int64, Int64]:
    from gvpipe.attributes.polygon_kernels import N_CONTEXTS, code_polygons
    from gvpipe.entropy.serial_coder import SerialEncoder

    coder = SerialEncoder(N_CONTEXTS, 12 * len(soup.triangles))
    places, apexes, sizes = code_polygons(coder.coder, soup, fans)
    return coder.finish(), places, apexes, sizes


def _decode_polygons(data: bytes, soup: Soup, name: str) -> tuple[Int64, Int64, Int64]:
    from gvpipe.attributes.polygon_kernels import N_CONTEXTS, Fans, code_polygons
    from gvpipe.entropy.serial_coder import SerialDecoder

    coder = SerialDecoder(data, N_CONTEXTS, name)
    none = np.zeros(0, np.int64)
    result = code_polygons(coder.coder, soup, Fans(none, none, none, none, none))
    coder.end()
    return result


def _arrange(
    decoded: Int32, parts: Int64, n_parts: int, triangles: Int64, first_corners: Int64, sizes: Int64 | None
) -> Arrangement:
    part_starts = np.concatenate([[0], np.cumsum(np.bincount(parts, minlength=n_parts))])
    faces = np.take_along_axis(decoded[triangles], (first_corners[:, None] + np.arange(3)) % 3, axis=1)
    polygons = None if sizes is None else sizes.astype(np.int32)
    return Arrangement(np.ascontiguousarray(faces, np.int32), part_starts, polygons, triangles, first_corners)
