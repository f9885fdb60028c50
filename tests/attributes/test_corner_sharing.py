"""Partitions of corners come back exactly, whatever they are, and no bytes do harm."""

from __future__ import annotations

import numpy as np
import pytest
from attribute_meshes import each_surface, quilt, surfaces
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.attributes.corner_sharing import GUIDED, LOOSE, SHARED, WHOLE, decode_sharing, encode_sharing, entries_of
from gvpipe.attributes.surface import Surface
from gvpipe.container.cursor import Cursor
from gvpipe.foundation.errors import CorruptFile, InputError


@each_surface
@pytest.mark.parametrize("most", [1, 2, 3, 40])
@pytest.mark.parametrize("n_references", [0, 1, 6])
def test_any_partition_comes_back(surface: Surface, most: int, n_references: int) -> None:
    random = np.random.default_rng(most)
    entries = entries_of(random.integers(0, most, surface.faces.size), surface)
    references = [entries_of(random.integers(0, 3, surface.faces.size), surface) for _ in range(n_references)]
    data = encode_sharing(entries, surface, references)
    assert np.array_equal(decode_sharing(Cursor(data, "x"), surface, references), entries)


def test_entries_are_numbered_by_first_corner_and_belong_to_one_vertex() -> None:
    surface, patch = quilt()
    entries = entries_of(patch, surface)
    used, first = np.unique(entries, return_index=True)
    assert np.array_equal(used, np.arange(len(used)))
    assert (np.diff(first) > 0).all()
    pairs = np.unique(np.stack([entries, surface.faces.ravel(), patch]), axis=1)
    assert pairs.shape[1] == len(used) == len(np.unique(pairs[1:], axis=1).T)


def test_simple_partitions_take_a_byte_or_two() -> None:
    surface, patch = quilt()
    whole, loose = entries_of(np.zeros_like(patch), surface), entries_of(np.arange(patch.size), surface)
    seams = entries_of(patch, surface)
    assert encode_sharing(whole, surface) == bytes([WHOLE])
    assert encode_sharing(loose, surface) == bytes([LOOSE])
    assert encode_sharing(seams, surface, [whole, seams]) == bytes([SHARED, 1])


def test_a_similar_partition_makes_seams_cheap() -> None:
    surface, patch = quilt(60)
    patch = patch + 4 * (np.arange(len(patch)) // 3 % 50 < 5)
    changed = patch.copy()
    changed[3000:3030] += 8
    reference, entries = entries_of(patch, surface), entries_of(changed, surface)
    alone, guided = encode_sharing(entries, surface), encode_sharing(entries, surface, [reference])
    assert guided[0] == GUIDED
    assert len(guided) < 0.7 * len(alone)


def test_too_few_indices_are_refused() -> None:
    surface, patch = quilt()
    with pytest.raises(InputError, match="three for each triangle"):
        entries_of(patch[:-1], surface)


def test_truncated_sharing_is_corrupt() -> None:
    """Missing words of a stream may go unnoticed, as decoders read zeros behind the end; most do not."""
    surface, patch = quilt()
    seams, other = entries_of(patch, surface), entries_of(patch // 2, surface)
    for references in ([], [other]):
        data = encode_sharing(seams, surface, references)
        n_refused = 0
        for end in range(len(data)):
            try:
                decode_sharing(Cursor(data[:end], "x"), surface, references)
            except CorruptFile:
                n_refused += 1
        assert n_refused >= len(data) - 4
    with pytest.raises(CorruptFile, match="does not exist"):
        decode_sharing(Cursor(bytes([SHARED, 0]), "x"), surface)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_damaged_sharing_is_corrupt_or_a_partition(data: st.DataObject) -> None:
    surface = surfaces()["non-manifold"]
    entries = entries_of(np.random.default_rng(0).integers(0, 3, surface.faces.size), surface)
    damaged = bytearray(encode_sharing(entries, surface))
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        decoded = decode_sharing(Cursor(bytes(damaged), "x"), surface)
    except CorruptFile:
        return
    assert decoded.shape == entries.shape
    vertex_of = np.full(len(entries), -1)
    vertex_of[decoded] = surface.faces.ravel()
    assert np.array_equal(vertex_of[decoded], surface.faces.ravel())
