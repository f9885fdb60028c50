"""A static attribute of a mesh <-> bytes: exactly, or within a bound.

attribute = layout, storage (`gvpipe.attributes.storage`), values (`gvpipe.attributes.value_coding`)
layout    = of a corner attribute: [varint] bytes of its sharing, sharing (`gvpipe.attributes.corner_sharing`)
          | of a vertex attribute: [8 bits] 0, or 1, [varint] bytes of its sharing over welded vertices, sharing
          | nothing
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gvpipe.attributes import storage as stores
from gvpipe.attributes.attribute_input import check_attribute
from gvpipe.attributes.corner_sharing import decode_sharing, encode_sharing, entries_of
from gvpipe.attributes.entry_layout import EntryLayout, may_weld, vertex_rows
from gvpipe.attributes.storage import RANKS, Storage
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.value_coding import decode_codes, encode_codes
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.mesh.unique_rows import row_ids

SPLIT, WELDED = 0, 1  # layouts of a vertex attribute


def encode_attribute(
    values: Array,
    indices: Array | None,
    surface: Surface,
    *,
    domain: str,
    kind: str,
    bound: float = 0.0,
    references: Sequence[Int32] = (),
) -> bytes:
    """Return the bytes of an attribute.

    Args:
        values: ``(N, C)``; floating-point numbers count as float32.
        indices: rows of ``values``: ``(3T,)`` by corner, ``(V,)``, ``(T,)`` or ``(n_parts,)``; None: as the values come.
        surface: the mesh.
        domain: one of `gvpipe.attributes.entry_layout.DOMAINS`.
        kind: one of `gvpipe.attributes.attribute_input.KINDS`.
        bound: largest error of each component, in its unit; of kind normal and tangent an angle, degrees; 0: none. Integers are
            exact in any case.
        references: entries ``(3T,)`` of corner attributes that decoders have before this one (`decode_attribute` returns them).

    Raises:
        InputError: shapes, types or indices do not fit, or a number is not finite.
    """
    values, corners = check_attribute(values, indices, surface, domain, kind)
    choices = []
    for storage, codes in _store(values, kind, bound):
        choices.append(encode_stored(storage, codes, EntryLayout(domain, surface, corners), references))
        if domain == "vertex" and may_weld(surface):
            choices.append(encode_welded(storage, codes, surface))
    return min(choices, key=len)


def decode_attribute(
    data: bytes, surface: Surface, name: str, *, domain: str, references: Sequence[Int32] = (), n_components: int | None = None
) -> tuple[Array, Int32 | None]:
    """Mirror of `encode_attribute`.

    Args:
        data: the attribute's bytes.
        surface: the same mesh, with the same positions.
        name: of the section, for messages.
        domain, references: as given to the encoder.
        n_components: C that is wanted; None: any.

    Returns:
        values ``(N, C)``, one for each vertex, triangle, part or entry, and the entries ``(3T,)`` of the corners or None.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    cursor = Cursor(data, name)
    if domain == "vertex" and cursor.varint(WELDED, "the layout") == WELDED:
        return _decode_welded(cursor, surface, n_components), None
    corners = decode_sharing(Cursor(cursor.block(), name), surface, references) if domain == "corner" else None
    layout = EntryLayout(domain, surface, corners)
    storage = stores.read_storage(cursor, layout.n_entries, n_components)
    codes = decode_codes(cursor, storage, layout)
    return stores.restore(storage, codes, cursor), corners


def encode_stored(storage: Storage, codes: Int64, layout: EntryLayout, references: Sequence[Int32] = ()) -> bytes:
    """Return the bytes of ``codes (N, K)`` in a layout that is not welded."""
    head = bytes([SPLIT]) if layout.domain == "vertex" else b""
    if layout.corners is not None:
        head = pack_block(encode_sharing(layout.corners, layout.surface, references))
    return head + stores.pack_storage(storage) + encode_codes(storage, codes, layout)


def encode_welded(storage: Storage, codes: Int64, surface: Surface) -> bytes:
    """Bytes of ``codes (V, K)`` with vertices of one position as one: those with equal codes are one entry."""
    welded = surface.welded()
    corners = entries_of(row_ids(codes)[0][surface.faces.ravel()], welded)
    sharing = encode_sharing(corners, welded, [entries_of(surface.faces.ravel(), welded)])
    own = np.empty((int(corners.max()) + 1, codes.shape[1]), np.int64)
    own[corners] = codes[surface.faces.ravel()]
    layout = EntryLayout("corner", welded, corners)
    return bytes([WELDED]) + pack_block(sharing) + stores.pack_storage(storage) + encode_codes(storage, own, layout)


def _decode_welded(cursor: Cursor, surface: Surface, n_components: int | None) -> Array:
    """Mirror of `encode_welded`: the values of vertices."""
    if not may_weld(surface):
        raise cursor.corrupt("an attribute is welded where vertices cannot be")
    welded = surface.welded()
    sharing = Cursor(cursor.block(), cursor.name)
    corners = decode_sharing(sharing, welded, [entries_of(surface.faces.ravel(), welded)])
    storage = stores.read_storage(cursor, surface.n_vertices, n_components)
    codes = decode_codes(cursor, storage, EntryLayout("corner", welded, corners))
    return stores.restore(storage, codes[vertex_rows(surface, corners)], cursor)


def _store(values: Array, kind: str, bound: float) -> list[tuple[Storage, Int64]]:
    """Storages that keep the bound, of which the smallest is taken."""
    if values.dtype.kind != "f":
        stored = [stores.store_integers(values)]
        if kind == "label" and stored[0][0].id != RANKS:
            stored.append(stores.store_ranks(values))
        return stored
    if bound > 0 and (kind, values.shape[1]) in (("normal", 3), ("tangent", 3), ("tangent", 4)):
        return [stores.store_directions(values, bound)]
    return [stores.store_floats(values, bound if kind not in ("normal", "tangent") else 0.0)]
