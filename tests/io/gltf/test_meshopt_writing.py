"""meshopt's streams as we write them: our decoder and the reference's read them alike."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from folders import ROOT
from numpy.typing import NDArray
from sequences import grid
from shapes import ball

from gvpipe.io.gltf.meshopt import filters
from gvpipe.io.gltf.meshopt.reading import decode_attributes, decode_triangles
from gvpipe.io.gltf.meshopt.writing import (
    encode_attributes,
    encode_triangles,
    pack_floats,
    pack_quaternions,
    pack_unit_vectors,
)
from gvpipe.mesh.drawing_order import first_uses, order_triangles

THREE = ROOT / "gvpipe" / "web" / "node_modules" / "three"
Values = NDArray[Any]


def by_reference(streams: list[tuple[bytes, int, int, str, str]]) -> list[Values]:
    """What the reference decoder makes of streams: data, count, bytes of an element, mode, filter."""
    if shutil.which("node") is None or not THREE.exists():
        pytest.skip("no node, or no three.js; npm ci in gvpipe/web")
    given = [
        {"data": base64.b64encode(data).decode(), "count": count, "size": size, "mode": mode, "filter": name}
        for data, count, size, mode, name in streams
    ]
    command = ["node", str(ROOT / "tests" / "run_meshopt.mjs"), str(THREE)]
    found = json.loads(subprocess.run(command, input=json.dumps(given).encode(), stdout=subprocess.PIPE, check=True).stdout)
    return [
        np.frombuffer(base64.b64decode(each), np.uint8).reshape(count, size)
        for each, (_, count, size, _, _) in zip(found, streams, strict=True)
    ]


def some_elements() -> list[Values]:
    """Of many lengths and sizes, from elements that stand to such that jump."""
    draw = np.random.default_rng(0)
    sizes = ((1, 4), (15, 8), (16, 12), (17, 4), (1000, 16), (300, 256), (700, 64))
    return [np.cumsum(draw.integers(0, jump, size), axis=0).astype(np.uint8) for size in sizes for jump in (1, 3, 20, 256)]


def test_attributes() -> None:
    given = some_elements()
    streams = [(encode_attributes(each), *each.shape, "ATTRIBUTES", "NONE") for each in given]
    for elements, (data, count, size, _, _) in zip(given, streams, strict=True):
        assert np.array_equal(decode_attributes(np.frombuffer(data, np.uint8), count, size), elements)
    for elements, found in zip(given, by_reference(streams), strict=True):
        assert np.array_equal(elements, found)


def test_elements_that_change_little_take_few_bytes() -> None:
    slow = np.cumsum(np.random.default_rng(0).integers(0, 2, (1600, 4)), axis=0).astype(np.uint8)
    assert len(encode_attributes(slow)) < 0.3 * slow.size
    assert len(encode_attributes(np.zeros((1600, 4), np.uint8))) < 200


def some_triangles() -> list[Values]:
    draw = np.random.default_rng(0)
    sheet, (_, sphere) = grid(20)[1], ball(8)
    drawn = sheet[order_triangles(sheet)]
    return [sheet, sphere, drawn, sheet[draw.permutation(len(sheet))], draw.integers(0, 70000, (500, 3)), np.zeros((3, 3), int)]


def same_but_for_turns(one: Values, two: Values) -> bool:
    return bool(np.logical_or.reduce([(np.roll(one, k, axis=1) == two).all(axis=1) for k in range(3)]).all())


def test_triangles() -> None:
    given = some_triangles()
    streams = [(encode_triangles(each.reshape(-1)), each.size, 4, "TRIANGLES", "NONE") for each in given]
    for faces, (data, count, _, _, _) in zip(given, streams, strict=True):
        assert same_but_for_turns(decode_triangles(np.frombuffer(data, np.uint8), count).reshape(-1, 3), faces)
    for faces, found in zip(given, by_reference(streams), strict=True):
        assert same_but_for_turns(np.ascontiguousarray(found).view(np.uint32).reshape(-1, 3), faces)


def test_an_order_in_which_triangles_take_a_byte() -> None:
    faces = grid(40)[1]
    order = order_triangles(faces)
    assert np.array_equal(np.sort(order), np.arange(len(faces)))
    uses = first_uses(faces[order], int(faces.max()) + 3)
    assert np.array_equal(np.sort(uses), np.arange(faces.max() + 3)) and uses[-2:].tolist() == [
        faces.max() + 1,
        faces.max() + 2,
    ]
    places = np.argsort(uses)
    assert len(encode_triangles(places[faces[order]].reshape(-1))) < 1.2 * len(faces)
    assert len(encode_triangles(faces[np.random.default_rng(0).permutation(len(faces))].reshape(-1))) > 3 * len(faces)


def test_filters_are_the_reference_s() -> None:
    draw = np.random.default_rng(0)
    rotations = draw.normal(size=(100, 4))
    rotations /= np.linalg.norm(rotations, axis=1)[:, None]
    normals = rotations[:, :3] / np.linalg.norm(rotations[:, :3], axis=1)[:, None]
    lengths = (draw.normal(size=(100, 3)) * 100).astype(np.float32)
    packed = [
        ("QUATERNION", pack_quaternions(rotations, 12)),
        ("QUATERNION", pack_quaternions(rotations)),
        ("OCTAHEDRAL", pack_unit_vectors(normals, 8)),
        ("OCTAHEDRAL", pack_unit_vectors(normals, 12)),
        ("EXPONENTIAL", pack_floats(lengths, 0.01)),
        ("EXPONENTIAL", pack_floats(lengths, 1e-4)),
    ]
    found = by_reference([(encode_attributes(each), *each.shape, "ATTRIBUTES", name) for name, each in packed])
    for (name, elements), reference in zip(packed, found, strict=True):
        letter = "f4" if name == "EXPONENTIAL" else f"i{elements.shape[1] // 4}"
        ours, theirs = (
            np.ascontiguousarray(each).view(letter).astype(float) for each in (filters.FILTERS[name](elements), reference)
        )
        assert np.abs(ours - theirs).max() <= (0 if letter == "f4" else 1)  # the reference rounds halves as it likes
    for reference, bits in zip(found[:2], (12, 16), strict=True):
        turned = np.ascontiguousarray(reference).view(np.int16) / 32767
        turned *= np.sign((turned * rotations).sum(axis=1))[:, None]
        assert np.abs(turned - rotations).max() < 1 / (1 << (bits - 1))
    eight = np.ascontiguousarray(found[2]).view(np.int8)[:, :3] / 127
    assert np.degrees(np.arccos(np.clip((eight * normals).sum(axis=1) / np.linalg.norm(eight, axis=1), -1, 1))).max() < 1
    for reference, step in zip(found[4:], (0.01, 1e-4), strict=True):
        assert np.abs(np.ascontiguousarray(reference).view(np.float32) - lengths).max() <= step
    with pytest.raises(OverflowError, match="too large"):
        pack_floats(lengths, 1e-6)
