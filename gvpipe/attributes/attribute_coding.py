"""A static attribute of a mesh <-> bytes: exactly, or within a bound.

    attribute = storage (`gvpipe.attributes.storage`), [8 bits] method, [8 bits] candidates, [8 bits] shift,
                stream (`gvpipe.entropy.serial_coder`)
    corner attributes start with [varint] bytes of their sharing, sharing (`gvpipe.attributes.corner_sharing`)

Values are coded entry after entry in an order that follows the surface (`gvpipe.attributes.entry_order`). Each is predicted
from values before it, by the method that leaves the fewest bytes (`linear_kernels`, `octahedral_kernels`). The residuals of its
neighbours are the context of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.arrays import Array, Int32, Int64
from gvpipe.attributes import storage as stores
from gvpipe.attributes.corner_sharing import decode_sharing, encode_sharing, entries_of
from gvpipe.attributes.entry_order import DOMAINS, corner_owners, count_entries, prepare_entries
from gvpipe.attributes.storage import DIRECTIONS, FLOATS, RANKS, TANGENTS, TYPES, Storage
from gvpipe.attributes.surface import Surface
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.errors import InputError

if TYPE_CHECKING:
    from gvpipe.attributes.match_kernels import Entries
    from gvpipe.entropy.serial_kernels import SerialCoder

KINDS = ("uv", "normal", "tangent", "color", "scalar", "vector", "label")
MAX_SHIFT = 32
USUAL_SHIFT = 1
SHIFTS = (0, 1, 2, 4, 7, 10, 14, 18)  # that an encoder tries


class EntryMesh(NamedTuple):
    """What predicts values.

    Args:
        entries: in order.
        surface: the mesh.
        owners: ``(3T,)`` the entry of each corner.
    """

    entries: Entries
    surface: Surface
    owners: Int64


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
        domain: one of `DOMAINS`.
        kind: one of `KINDS`.
        bound: largest error of each component, in its unit; of kind normal and tangent an angle, degrees; 0: none. Integers are
            exact in any case.
        references: entries ``(3T,)`` of corner attributes that decoders have before this one (`decode_attribute` returns them).

    Raises:
        InputError: shapes, types or indices do not fit, or a number is not finite.
    """
    values, corners = _check(values, indices, surface, domain, kind)
    head = b""
    if corners is not None:
        head = pack_block(encode_sharing(corners, surface, references))
    choices = [_encode_codes(storage, codes, domain, surface, corners) for storage, codes in _store(values, kind, bound)]
    return head + min(choices, key=len)


def decode_attribute(
    data: bytes, surface: Surface, name: str, *, domain: str, references: Sequence[Int32] = ()
) -> tuple[Array, Int32 | None]:
    """Mirror of `encode_attribute`.

    Args:
        data: the attribute's bytes.
        surface: the same mesh, with the same positions.
        name: of the section, for messages.
        domain, references: as given to the encoder.

    Returns:
        values ``(N, C)``, one for each vertex, triangle, part or entry, and the entries ``(3T,)`` of the corners or None.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    cursor = Cursor(data, name)
    corners = decode_sharing(Cursor(cursor.block(), name), surface, references) if domain == "corner" else None
    n = count_entries(domain, surface, corners)
    storage = stores.read_storage(cursor, n)
    method, flags, shift = cursor.take(3)
    if method not in _methods(storage, domain, surface) or flags > 3 or shift > MAX_SHIFT:
        raise cursor.corrupt("an attribute is predicted by an unknown method")
    codes = np.zeros((n, storage.n_components), np.int64)
    if codes.size:
        from gvpipe.entropy.serial_coder import SerialDecoder

        coder = SerialDecoder(cursor.rest(), _n_contexts(flags), name)
        entries = prepare_entries(domain, surface, corners)._replace(flags=flags, shift=shift)
        _code(coder.coder, storage, method, codes, EntryMesh(entries, surface, corner_owners(domain, surface, corners)))
        coder.end()
    cursor.end()
    return stores.restore(storage, codes, cursor), corners


def _check(values: Array, indices: Array | None, surface: Surface, domain: str, kind: str) -> tuple[Array, Int32 | None]:
    """Values ``(N, C)`` of a stored type, one for each entry, and the entries of corners."""
    if domain not in DOMAINS or kind not in KINDS:
        raise InputError(f"{kind!r} on {domain!r}: kinds are {', '.join(KINDS)}, domains {', '.join(DOMAINS)}")
    values = np.asarray(values)
    if values.dtype.kind == "f":
        values = values.astype(np.float32)
    if values.ndim != 2 or values.shape[1] > stores.MAX_COMPONENTS or values.dtype.newbyteorder("=") not in TYPES:
        raise InputError(f"{kind} values {values.shape} {values.dtype}: a table of numbers is needed, at most 64 columns")
    if kind == "label" and values.dtype.kind == "f":
        raise InputError("labels are floating-point numbers; labels are integers")
    if values.dtype == np.uint64 and values.size and int(values.max()) >= 1 << 63:
        raise InputError(f"{kind} value {int(values.max())}: at most 2**63 - 1")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise InputError(f"{kind} value {row} is {values[row].tolist()}; replace what is not finite")
    if indices is None:
        indices = np.arange(len(values))
    indices = np.asarray(indices)
    if indices.size and (int(indices.min()) < 0 or int(indices.max()) >= len(values)):
        raise InputError(f"{kind} indices {int(indices.min())}..{int(indices.max())}: there are {len(values)} values")
    corners = entries_of(indices, surface) if domain == "corner" else None
    n = count_entries(domain, surface, corners)
    if corners is not None:
        rows = np.zeros(n, np.int64)
        rows[corners] = indices
        return np.ascontiguousarray(values[rows]), corners
    if indices.shape != (n,):
        raise InputError(f"{kind} has {len(indices)} values on domain {domain}: {n} are needed")
    return np.ascontiguousarray(values[indices]), None


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


def _encode_codes(storage: Storage, codes: Int64, domain: str, surface: Surface, corners: Int32 | None) -> bytes:
    """Bytes of codes ``(N, K)`` by the best of methods, candidates and shifts, tried one after the other."""
    head = stores.pack_storage(storage)
    if not codes.size:
        return head + bytes(3)
    from gvpipe.entropy.serial_coder import SerialEncoder, estimate_bytes

    entries = prepare_entries(domain, surface, corners)
    owners = corner_owners(domain, surface, corners)
    has_twins = int(entries.places.max()) + 1 < len(entries.places)

    def encode(method: int, flags: int, shift: int) -> SerialEncoder:
        coder = SerialEncoder(_n_contexts(flags), len(codes) * (codes.shape[1] + 1))
        mesh = EntryMesh(entries._replace(flags=flags, shift=shift), surface, owners)
        _code(coder.coder, storage, method, codes.copy(), mesh)
        return coder

    def cost(method: int, flags: int, shift: int) -> float:
        return estimate_bytes(*encode(method, flags, shift).noted, _n_contexts(flags))

    method = min(_methods(storage, domain, surface), key=lambda method: cost(method, 0, USUAL_SHIFT))
    flags = min((0, 1, 2, 3) if has_twins else (0, 2), key=lambda flags: cost(method, flags, USUAL_SHIFT))
    shift = min(SHIFTS, key=lambda shift: cost(method, flags, shift))
    return head + bytes((method, flags, shift)) + encode(method, flags, shift).finish()


def _methods(storage: Storage, domain: str, surface: Surface) -> list[int]:
    """Methods that there are for an attribute."""
    from gvpipe.attributes import linear_kernels, octahedral_kernels

    has_shape = surface.positions is not None and domain != "part"
    if storage.id in (DIRECTIONS, TANGENTS):
        methods = [octahedral_kernels.LAST, octahedral_kernels.MEAN]
        return [*methods, octahedral_kernels.SURFACE, octahedral_kernels.PLACE] if has_shape else methods
    methods = [linear_kernels.LAST, linear_kernels.MEAN, linear_kernels.PARALLELOGRAM]
    has_plane = has_shape and storage.n_components == 2 and domain in ("vertex", "corner")
    return [*methods, linear_kernels.CONFORMAL] if has_plane else methods


def _code(coder: SerialCoder, storage: Storage, method: int, codes: Int64, mesh: EntryMesh) -> None:
    """Code ``codes (N, C)`` in either direction."""
    surface = mesh.surface
    positions = surface.positions if surface.positions is not None else np.zeros((0, 3), np.float32)
    if storage.id in (DIRECTIONS, TANGENTS):
        from gvpipe.attributes.octahedral_kernels import PLACE, SURFACE, Octahedral, code_octahedral, corner_normals

        normals = np.zeros((0, 3))
        if method == SURFACE:
            normals = corner_normals(surface.faces, positions, mesh.owners, len(codes))
        elif method == PLACE:
            places = mesh.entries.places
            normals = corner_normals(surface.faces, positions, places[mesh.owners], int(places.max()) + 1)[places]
        code_octahedral(coder, mesh.entries, Octahedral(method, storage.n, normals), codes)
        return
    from gvpipe.attributes.linear_kernels import Linear, code_linear

    numbers = codes.astype(np.float64)
    if storage.id == FLOATS:
        numbers = stores.restore(storage, codes, Cursor(b"", "")).astype(np.float64)
    code_linear(coder, mesh.entries, Linear(method, storage.id == FLOATS, surface.faces, positions), codes, numbers)


def _n_contexts(flags: int) -> int:
    from gvpipe.attributes.match_kernels import N_MATCH_CONTEXTS, N_RESIDUAL_CONTEXTS

    return N_RESIDUAL_CONTEXTS + (N_MATCH_CONTEXTS if flags else 0)
