"""Codes of entries <-> bytes.

    values = [8 bits] method, [8 bits] candidates, [8 bits] shift, stream (`gvpipe.entropy.serial_coder`)

Codes come entry after entry in an order that follows the surface (`gvpipe.attributes.entry_layout`). Each is predicted from
those before it, by the method that leaves the fewest bytes (`linear_kernels`, `octahedral_kernels`). The residuals of its
neighbours are the context of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.attributes.entry_layout import EntryLayout
from gvpipe.attributes.storage import DIRECTIONS, FLOATS, TANGENTS, Storage, float_values
from gvpipe.container.cursor import Cursor
from gvpipe.foundation.arrays import Int64
from gvpipe.mesh.topology import opposite_corners

if TYPE_CHECKING:
    from gvpipe.attributes.match_kernels import Entries
    from gvpipe.entropy.serial_coder import SerialEncoder
    from gvpipe.entropy.serial_kernels import SerialCoder

MAX_SHIFT = 32
SHIFTS = (0, 1, 2, 4, 7, 10, 14, 18)  # that an encoder tries
USUAL_SHIFT = 1
MAX_TRIED = 1 << 15  # entries


class Choice(NamedTuple):
    """How codes are predicted: ``method`` of the storage, ``flags`` of candidates, ``shift`` of contexts."""

    method: int
    flags: int
    shift: int


class Prepared(NamedTuple):
    """A layout, its entries in order, the entry ``(3T,)`` of each corner, and the corners opposite over entries."""

    layout: EntryLayout
    entries: Entries
    owners: Int64
    opposite: Int64


def encode_codes(storage: Storage, codes: Int64, layout: EntryLayout) -> bytes:
    """Return the bytes of ``codes (N, K)`` by the best of methods, candidates and shifts, tried one after the other."""
    if not codes.size:
        return bytes(3)
    from gvpipe.entropy.serial_coder import SerialEncoder, estimate_bytes

    prepared = _prepare(layout)
    has_twins = int(prepared.entries.places.max()) + 1 < len(codes)

    sample = prepared._replace(entries=_first_entries(prepared.entries))

    def encode(choice: Choice, prepared: Prepared) -> SerialEncoder:
        n = len(prepared.entries.order.order)
        coder = SerialEncoder(_n_contexts(choice), n * (codes.shape[1] + 1))
        _code(coder.coder, storage, choice, codes, prepared)
        return coder

    def cost(choice: Choice) -> float:
        return estimate_bytes(*encode(choice, sample).noted, _n_contexts(choice))

    best = min((Choice(method, 0, USUAL_SHIFT) for method in _methods(storage, layout)), key=cost)
    best = min((best._replace(flags=flags) for flags in ((0, 1, 2, 3) if has_twins else (0, 2))), key=cost)
    best = min((best._replace(shift=shift) for shift in SHIFTS), key=cost)
    return bytes(best) + encode(best, prepared).finish()


def decode_codes(cursor: Cursor, storage: Storage, layout: EntryLayout) -> Int64:
    """Mirror of `encode_codes`: reads ``cursor`` to its end; raises `CorruptFile`."""
    choice = Choice(*cursor.take(3))
    if choice.method not in _methods(storage, layout) or choice.flags > 3 or choice.shift > MAX_SHIFT:
        raise cursor.corrupt("an attribute is predicted by an unknown method")
    codes = np.zeros((layout.n_entries, storage.n_components), np.int64)
    if codes.size:
        from gvpipe.entropy.serial_coder import SerialDecoder

        coder = SerialDecoder(cursor.rest(), _n_contexts(choice), cursor.name)
        _code(coder.coder, storage, choice, codes, _prepare(layout))
        coder.end()
    cursor.end()
    return codes


def _prepare(layout: EntryLayout) -> Prepared:
    owners = layout.owners
    return Prepared(layout, layout.entries(), owners, opposite_corners(owners.reshape(-1, 3)))


def _first_entries(entries: Entries) -> Entries:
    """The first entries of the order, which choices are tried with."""
    order = entries.order
    return entries._replace(order=order._replace(order=order.order[:MAX_TRIED], starts=order.starts[: MAX_TRIED + 1]))


def _methods(storage: Storage, layout: EntryLayout) -> list[int]:
    """Methods that there are for an attribute."""
    from gvpipe.attributes import linear_kernels, octahedral_kernels

    has_shape = layout.surface.positions is not None and layout.domain != "part"
    if storage.id in (DIRECTIONS, TANGENTS):
        methods = [octahedral_kernels.LAST, octahedral_kernels.MEAN]
        return list(range(octahedral_kernels.PLACE_CORRECTED + 1)) if has_shape else methods
    methods = [linear_kernels.LAST, linear_kernels.MEAN, linear_kernels.PARALLELOGRAM]
    has_plane = has_shape and storage.n_components == 2 and layout.domain in ("vertex", "corner")
    return [*methods, linear_kernels.CONFORMAL, linear_kernels.AFFINE] if has_plane else methods


def _code(coder: SerialCoder, storage: Storage, choice: Choice, codes: Int64, prepared: Prepared) -> None:
    """Code ``codes (N, C)`` in either direction."""
    surface, method = prepared.layout.surface, choice.method
    entries = prepared.entries._replace(flags=choice.flags, shift=choice.shift)
    positions = surface.positions if surface.positions is not None else np.zeros((0, 3), np.float32)
    if storage.id in (DIRECTIONS, TANGENTS):
        from gvpipe.attributes import octahedral_kernels as kernels

        normals = np.zeros((0, 3))
        if method in (kernels.SURFACE, kernels.SURFACE_CORRECTED):
            normals = kernels.corner_normals(surface.faces, positions, prepared.owners, len(codes))
        elif method in (kernels.PLACE, kernels.PLACE_CORRECTED):
            places = entries.places
            own = places[prepared.owners]
            normals = kernels.corner_normals(surface.faces, positions, own, int(places.max()) + 1)[places]
        kernels.code_octahedral(coder, entries, kernels.Octahedral(method, storage.n, normals), codes)
        return
    from gvpipe.attributes.linear_kernels import Linear, code_linear

    numbers = codes.astype(np.float64)
    if storage.id == FLOATS:
        numbers = float_values(codes).astype(np.float64)
    linear = Linear(method, storage.id == FLOATS, surface.faces, prepared.opposite, positions)
    code_linear(coder, entries, linear, codes, numbers)


def _n_contexts(choice: Choice) -> int:
    from gvpipe.attributes.match_kernels import N_MATCH_CONTEXTS, N_RESIDUAL_CONTEXTS

    return N_RESIDUAL_CONTEXTS + (N_MATCH_CONTEXTS if choice.flags else 0)
