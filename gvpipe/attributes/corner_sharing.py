"""Which corners of a vertex share a value of an attribute: seams of texture coordinates, hard edges, any partition, exactly.

An *entry* is a value at a vertex, used by one or more of its corners. Entries are numbered by the first corner that uses them.

    sharing = [u8] mode, [varint] number of the reference (modes SHARED and GUIDED), stream (modes CODED and GUIDED)

Corners come vertex after vertex, in order along the fans of triangles around the vertex. Each one is signalled as having the
entry of the corner before it, a new one, or an older one of the vertex. Three things predict that:

- whether an edge is cut at its other end, if that is done;
- how many cuts the vertex has so far, as cuts come in pairs;
- the *reference*, the partition of another attribute of the same mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.attributes.surface import Surface
from gvpipe.container.cursor import Cursor, varint
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.unique_rows import row_ids

if TYPE_CHECKING:
    from gvpipe.attributes.sharing_kernels import Corners

WHOLE, LOOSE, SHARED, CODED, GUIDED = range(5)  # modes: one entry per vertex; one per corner; as the reference; two streams
MAX_TRIED = 4  # references, the last ones, that an encoder tries


def entries_of(indices: Array, surface: Surface) -> Int32:
    """``(3T,) int32`` entries of ``indices (3T,)`` into values: pairs of vertex and index, numbered by first corner.

    Raises:
        InputError: there are not 3T indices.
    """
    if indices.shape != (surface.faces.size,):
        raise InputError(f"{indices.shape} indices of corners: {surface.faces.size} are needed, three for each triangle")
    pairs = np.stack([surface.faces.ravel(), indices], axis=1).astype(np.int64)
    return _by_first_corner(row_ids(pairs)[0])


def encode_sharing(entries: Int32, surface: Surface, references: Sequence[Int32] = ()) -> bytes:
    """Return the bytes of a partition.

    Args:
        entries: ``(3T,)`` of `entries_of`.
        surface: the mesh.
        references: entries of attributes that the decoder has before this one.
    """
    n_entries = int(entries.max(initial=-1)) + 1
    if n_entries == len(np.unique(surface.faces)):
        return bytes([WHOLE])
    if n_entries == len(entries):
        return bytes([LOOSE])
    for number, reference in enumerate(references):
        if np.array_equal(entries, reference):
            return bytes([SHARED]) + varint(number)
    choices = [bytes([CODED]) + _encode_fans(entries, surface, None)]
    for number in range(max(0, len(references) - MAX_TRIED), len(references)):
        choices.append(bytes([GUIDED]) + varint(number) + _encode_fans(entries, surface, references[number]))
    return min(choices, key=len)


def decode_sharing(cursor: Cursor, surface: Surface, references: Sequence[Int32] = ()) -> Int32:
    """Mirror of `encode_sharing`: ``(3T,)`` entries; reads ``cursor`` to its end; raises `CorruptFile`."""
    mode = cursor.take(1)[0]
    if mode > GUIDED:
        raise cursor.corrupt(f"the corners are shared in an unknown mode {mode}")
    reference = None
    if mode in (SHARED, GUIDED):
        if not references:
            raise cursor.corrupt("the corners refer to those of an attribute that does not exist")
        reference = references[cursor.varint(len(references) - 1, "the number of a reference")]
    if mode in (CODED, GUIDED):
        return _decode_fans(cursor, surface, reference)
    cursor.end()
    if mode == WHOLE:
        return _by_first_corner(surface.faces.ravel().astype(np.int64))
    return np.arange(surface.faces.size, dtype=np.int32) if reference is None else reference


def _encode_fans(entries: Int32, surface: Surface, reference: Int32 | None) -> bytes:
    from gvpipe.attributes.sharing_kernels import N_CONTEXTS, code_sharing
    from gvpipe.entropy.serial_coder import SerialEncoder

    coder = SerialEncoder(N_CONTEXTS, len(entries))
    code_sharing(coder.coder, _corners(surface, reference), surface.n_vertices, entries.astype(np.int64))
    return coder.finish()


def _decode_fans(cursor: Cursor, surface: Surface, reference: Int32 | None) -> Int32:
    from gvpipe.attributes.sharing_kernels import N_CONTEXTS, code_sharing
    from gvpipe.entropy.serial_coder import SerialDecoder

    coder = SerialDecoder(cursor.rest(), N_CONTEXTS, cursor.name)
    entries = np.zeros(surface.faces.size, np.int64)
    code_sharing(coder.coder, _corners(surface, reference), surface.n_vertices, entries)
    coder.end()
    return _by_first_corner(entries)


def _corners(surface: Surface, reference: Int32 | None) -> Corners:
    from gvpipe.attributes.sharing_kernels import Corners

    guide = np.zeros(0, np.int64) if reference is None else reference.astype(np.int64)
    return Corners(np.ascontiguousarray(surface.faces, np.int32), surface.opposite, guide)


def _by_first_corner(numbers: Int64) -> Int32:
    """Number ``(3T,)`` entries 0, 1, ... by their first corner."""
    _, first, inverse = np.unique(numbers, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int32)
    rank[np.argsort(first)] = np.arange(len(first), dtype=np.int32)
    return rank[inverse]
