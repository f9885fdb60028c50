"""Normals of a moving surface that are its own: no numbers, but a rule by which they follow from decoded positions.

Section of such a field::

    section = [8 bits] rule, its place in `gvpipe.attributes.surface_normals.RULES`,
              [8 bits] 1: vertices that coincide in frame 0 share a normal, or 0
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.asset_coding.scan import chunks
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.surface_normals import RULES, find_rule, largest_error, surface_normals
from gvpipe.coding.codec import FrameReader
from gvpipe.container.cursor import Cursor
from gvpipe.foundation.arrays import Array, Int64


@dataclass(frozen=True)
class NormalRule:
    """How normals follow from positions.

    Args:
        rule: one of `RULES`.
        is_welded: whether vertices that coincide in frame 0 share a normal.
    """

    rule: str
    is_welded: bool

    def normals(self, positions: Array, surface: Surface) -> Array:
        """Return ``(n, V, 3) float32`` unit normals of frames ``positions (n, V, 3)``."""
        shared = share_normals(surface, self.is_welded)
        return surface_normals(positions, surface.faces, shared[surface.faces.reshape(-1)], self.rule)[:, shared]


def find_normal_rule(given: Field, reader: FrameReader, surface: Surface, bound: float) -> NormalRule | None:
    """Return the rule that gives all normals of all frames within an angle; None if there is none.

    Args:
        given: normals by vertex, vertices as they are decoded.
        reader: of the decoded frames.
        surface: the mesh, with decoded positions of frame 0.
        bound: degrees.
    """
    is_used = np.bincount(surface.faces.reshape(-1), minlength=surface.n_vertices) > 0
    if surface.positions is None or not is_used.all():
        return None
    first = given.read(0, 1)
    for is_welded in (False, True):
        shared = share_normals(surface, is_welded)
        one = np.zeros((int(shared.max()) + 1, 3))
        one[shared] = first[0]
        entries = shared[surface.faces.reshape(-1)].astype(np.int32)
        rule = find_rule(one, entries, surface.positions, surface.faces, bound)
        if rule is not None and _holds(NormalRule(rule, is_welded), given, reader, surface, bound):
            return NormalRule(rule, is_welded)
    return None


def pack_rule(rule: NormalRule) -> bytes:
    """Return the section of a field of such normals."""
    return bytes([RULES.index(rule.rule), rule.is_welded])


def unpack_rule(data: bytes, section: str) -> NormalRule:
    """Mirror of `pack_rule`; raises `CorruptFile`."""
    cursor = Cursor(data, section)
    rule, is_welded = cursor.take(2)
    cursor.end()
    if rule >= len(RULES) or is_welded > 1:
        raise cursor.corrupt(f"its rule is {rule}, {is_welded}")
    return NormalRule(RULES[rule], bool(is_welded))


def share_normals(surface: Surface, is_welded: bool) -> Int64:
    """``(V,)`` the number of each vertex's normal."""
    return surface.places if is_welded else np.arange(surface.n_vertices)


def _holds(rule: NormalRule, given: Field, reader: FrameReader, surface: Surface, bound: float) -> bool:
    return all(
        largest_error(block.astype(np.float64), rule.normals(reader.read(first, first + len(block)), surface)) <= bound
        for first, block in chunks(given)
    )
