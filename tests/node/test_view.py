"""What the player picks under a pointer, draws as edges, plots over time and takes for displacements, in Node."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gvpipe.foundation.errors import InputError
from gvpipe.model.warp import parse_warp

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
FAN = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 3, 5], [5, 3, 6], [5, 6, 7]]  # a pentagon, a triangle, a quad


def ask(command: str, **given: Any) -> Any:
    script = Path(__file__).with_name("run_view.mjs")
    text = json.dumps({"command": command, **given})
    done = subprocess.run(["node", str(script)], input=text, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def edges(**given: Any) -> set[tuple[int, int]]:
    found = np.reshape(ask("edges", faces=FAN, **given), (-1, 2))
    assert len(np.unique(found, axis=0)) == len(found)
    return {(min(pair), max(pair)) for pair in found.tolist()}


def test_edges_of_polygons_have_no_diagonals() -> None:
    pentagon = {(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)}
    triangle, quad = {(3, 4), (3, 5), (4, 5)}, {(3, 5), (3, 6), (6, 7), (5, 7)}
    assert edges(polygons=[5, 3, 4], ranges=[[0, 6]]) == pentagon | triangle | quad
    assert edges(polygons=[5, 3, 4], ranges=[[4, 6]]) == quad
    assert edges(polygons=[5, 3, 4], ranges=[[0, 3], [4, 6]]) == pentagon | quad
    assert edges(polygons=[5, 3, 4], ranges=[]) == set()
    assert edges(polygons=None, ranges=[[0, 6]]) == pentagon | triangle | quad | {(0, 2), (0, 3), (5, 6)}


def test_rays_meet_what_is_nearest() -> None:
    """Rays from random points to random points of triangles, beside all distances that numpy computes."""
    random = np.random.default_rng(1)
    points = random.normal(size=(60, 3)).astype(np.float32)
    faces = random.permutation(60).reshape(20, 3)
    weights = random.dirichlet([2, 2, 2], 50)
    targets = np.einsum("nc,ncx->nx", weights, points[faces[random.integers(0, 20, 50)]])
    origins = 6 * random.normal(size=(50, 3))
    rays = np.stack([origins, 2 * (targets - origins)], axis=1)
    ranges = [[0, 7], [9, 20]]
    found = ask("pick", points=points.tolist(), faces=faces.tolist(), ranges=ranges, rays=rays.tolist())
    shown = [t for start, stop in ranges for t in range(start, stop)]
    n_met = 0
    for (origin, direction), met in zip(rays, found, strict=True):
        distances = {}
        for t in shown:
            a, b, c = points[faces[t]].astype(float)
            beta, gamma, distance = np.linalg.solve(np.stack([b - a, c - a, -direction], axis=1), origin - a)
            if min(beta, gamma, 1 - beta - gamma) >= 0 and distance > 0:
                distances[t] = distance
        assert (met is None) == (not distances)
        if met is not None:
            n_met += 1
            triangle = min(distances, key=lambda t: distances[t])
            place = origin + distances[triangle] * direction
            assert met["triangle"] == triangle
            assert met["vertex"] == min(faces[triangle], key=lambda v: float(np.linalg.norm(points[v] - place)))
    assert n_met > 30


def test_points_are_picked_beside_the_ray() -> None:
    points = [[0, 0, 0], [0.05, 0, 1], [0.3, 0, 2]]
    rays = [[[0, 0, 10], [0, 0, -3]], [[0, 0, 1.5], [0, 0, -1]], [[0, 0, 10], [0, 0, 1]], [[0, 5, 10], [0, 0, -1]]]
    found = ask("pick", points=points, faces=[], ranges=[], rays=rays)
    assert [met and (met["triangle"], met["vertex"]) for met in found] == [(None, 1), (None, 0), None, None]


def test_a_trace_has_few_frames_and_loads_what_it_lacks() -> None:
    found = ask("trace", count=1000, kept=[0, 4], stop=99)
    assert len(found["frames"]) == 200 and found["frames"][::199] == [0, 999] and found["first"]
    assert [k // 100 for k in found["asked"]] == [1, 2, 3, 5, 6, 7, 8, 9] and found["changes"] == 8
    values = zip(found["frames"], found["values"], strict=True)
    assert all(value == (None if k == 5 else 5 * k) for k, value in values)  # JSON has no NaN
    few = ask("trace", count=3, kept=[], stop=99)
    assert few["frames"] == [0, 1, 2] and few["values"] == [0, 5, 10] and not few["first"]
    assert ask("trace", count=1, kept=[0], stop=9)["values"] == [0]
    stopped = ask("trace", count=1000, kept=[0], stop=2)
    assert len(stopped["asked"]) == 2 and stopped["values"].count(None) > 100


def test_displacements_are_named_as_in_python() -> None:
    names = ("U", "a:b", "disp", "plane")
    fields = [{"name": name, "domain": "vertex", "components": 3} for name in names]
    fields[3]["components"] = 2
    fields += [{"name": "s", "domain": "vertex", "components": 1}, {"name": "t", "domain": "triangle", "components": 3}]
    texts = ["U", "U:2.5", "a:b", "a:b:-1e-3", "plane: 7 ", "U:", "U:x", ":3", "U:inf", "U:2:3", "s:1", "t:1", "none", ""]
    found, usual = ask("warp", texts=texts, fields=fields)
    for text, got in zip(texts, found, strict=True):
        try:
            name, scale = (text, 1.0) if text in names else parse_warp(text)
        except InputError:
            name, scale = "", 0.0
        assert got == ({"name": name, "scale": scale} if name in names else None), text
    assert usual == "U"
    assert ask("warp", texts=[None], fields=fields[3:]) == [[None], None]


def test_bounds_have_room_for_displacements() -> None:
    assert ask("bounds", extents=[[-1, 2], [0, 0], [0, 5]], scale=-2) == {"min": [-4, 0, -10], "max": [3, 1, 1]}
    assert ask("bounds", extents=[[-1, 2], [0, 3]], scale=1) == {"min": [-1, 0, 0], "max": [3, 4, 1]}
