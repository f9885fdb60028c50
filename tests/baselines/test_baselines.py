"""What every baseline promises: the error that quality asks for, vertices and triangles in order, one error for bad bytes."""

from __future__ import annotations

import dataclasses
import tomllib
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from odd_headers import first_payload
from sequences import awkward, same_triangles, waving
from shapes import ball

from gvbaselines.awc import analyse, find_wavelets, level_norms, ring_weights, synthesise
from gvbaselines.baseline import Baseline
from gvbaselines.famc import LADDER, START, find_count
from gvbaselines.rlpca import localised, placed
from gvbaselines.square_map import map_to_square
from gvbaselines.tls import join, levels_of, split, subband_norms
from gvbaselines.wavelets import decode_levels, encode_levels, restore, transform
from gvcodecs.pdct.local_frames import local_frames
from gvpipe.coding.codec import Encoded
from gvpipe.coding.quality_scale import error_of
from gvpipe.container.bitstream import unpack_payload
from gvpipe.container.cursor import Cursor
from gvpipe.foundation.errors import FormatError, InputError, SettingError
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.sequence import MeshSequence

PROJECT = Path(__file__).parents[2] / "baselines" / "pyproject.toml"
ENTRIES = tomllib.loads(PROJECT.read_text("utf-8"))["project"]["entry-points"]["gvpipe.codecs"]
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in ENTRIES),
    *(("dynapack", {"predictor": predictor}) for predictor in ("replica", "space", "time")),
    ("gv", {"prediction": "none"}),
    ("kglpc", {"taps": 0}),
    ("maverg", {"predictor": "motion"}),
    ("cpca", {"clusters": 3, "components": 0}),
    ("famc", {"clusters": 0}),
    ("rlpca", {"clusters": 2}),
    ("tls", {"levels": 0}),
]
SLOW = pytest.mark.slow
each_variant = pytest.mark.parametrize(
    ("name", "settings"),
    [pytest.param(n, s, id=" ".join([n, *map(str, s.values())]), marks=SLOW if n == "gv" else []) for n, s in VARIANTS],
)
AWKWARD = awkward()
AWKWARD_CASES = [  # each codec meets every third input; the others are left to the slow run
    pytest.param(codec, name, id=f"{codec}-{name}", marks=[] if (i + j) % 3 == 0 else SLOW)
    for i, codec in enumerate(name for name in ENTRIES if name != "gv")  # it takes one surface
    for j, name in enumerate(AWKWARD)
]


def load(name: str) -> type[Baseline]:
    module, _, kind = ENTRIES[name].partition(":")
    found: type[Baseline] = getattr(import_module(module), kind)
    return found


@cache
def encoded(name: str) -> tuple[MeshSequence, Encoded]:
    sequence = waving(10, 20)
    return sequence, load(name)().encode(sequence)


def positions(codec: type[Baseline], made: Encoded) -> np.ndarray:
    """Decoded from bytes, ``(F, V, 3)``, in the order of the sequence's vertices."""
    bitstream, _ = unpack_payload(first_payload(made.bitstream, {}))
    decoded = codec.reader(bitstream).read(0, bitstream.n_frames)
    result = np.empty_like(decoded)
    result[:, made.permutation] = decoded
    return result


def _part(frames: np.ndarray, start: int, stop: int) -> np.ndarray:
    return frames[start:stop]


@pytest.mark.parametrize("name", ENTRIES)
def test_entry_points_name_codecs(name: str) -> None:
    codec = load(name)
    assert (codec.id, codec.version) == (name, 1)
    assert codec.from_texts({"quality": "30", "reorder": "true"}) == codec(quality=30.0, reorder=True)
    for wrong in ({"quality": 101}, {"segment": 0}):
        with pytest.raises(SettingError, match=next(iter(wrong))):
            codec(**wrong)  # type: ignore[arg-type]


@each_variant
def test_the_error_is_the_one_that_quality_asks_for(name: str, settings: dict[str, Any]) -> None:
    sequence, codec = waving(10, 20), load(name)
    sizes = []
    for quality in (50.0, 75.0):
        made = codec(quality=quality, **settings).encode(sequence)
        assert same_triangles(made.permutation[codec.reader(made.bitstream).faces], sequence.faces)
        frames = positions(codec, made)
        kg = measure_errors(sequence, partial(_part, frames)).kg
        assert kg is not None and 0.7 * error_of(quality) < kg < 1.1 * error_of(quality)
        sizes.append(len(made.bitstream.sections["frames.0"]))
    assert sizes[0] < sizes[1]


@pytest.mark.parametrize("name", ENTRIES)
def test_segments_decode_alone_and_order_is_kept(name: str) -> None:
    sequence, codec = waving(8, 15), load(name)
    made = codec(segment=6).encode(sequence)
    assert np.array_equal(made.permutation, np.arange(sequence.n_vertices))
    whole = codec.reader(made.bitstream).read(0, 15)
    own = {k: v for k, v in made.bitstream.sections.items() if k in ("mesh", "order", "frames.1")}
    alone = codec.reader(dataclasses.replace(made.bitstream, sections=own))
    assert np.array_equal(alone.read(6, 9), whole[6:9])


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW if name == "gv" else []) for name in ENTRIES])
def test_changed_and_cut_bytes_are_refused_or_decode(name: str) -> None:
    """No change of a section's bytes leads to anything but frames or `FormatError`."""
    _, made = encoded(name)
    data, refused = made.bitstream.sections["frames.0"], 0
    rng = np.random.default_rng(7)
    for at in [*range(0, 40, 3), *rng.integers(0, len(data), 30).tolist()]:
        for changed in (data[:at], data[:at] + bytes([data[at] ^ 0x41]) + data[at + 1 :]):
            sections = {**made.bitstream.sections, "frames.0": changed}
            try:
                frames = load(name).reader(dataclasses.replace(made.bitstream, sections=sections)).read(0, 20)
                assert np.isfinite(frames).all()
            except FormatError:
                refused += 1
    assert refused >= 44  # every cut one at least


@pytest.mark.parametrize(("codec", "name"), AWKWARD_CASES)
def test_awkward_inputs(codec: str, name: str) -> None:
    sequence = AWKWARD[name]
    frames = positions(load(codec), load(codec)(quality=90).encode(sequence))
    given = np.asarray(sequence.positions[:], np.float64)
    extent = float(np.ptp(given, axis=(0, 1)).max())
    assert np.abs(frames - given).max() <= 0.02 * extent + 1e-6 * np.abs(given).max()


@pytest.mark.parametrize("name", ["soup", "two parts"])
def test_geometry_video_refuses_what_is_not_one_surface(name: str) -> None:
    sheet = waving(4, 3)
    faces = sheet.faces if name == "two parts" else sheet.faces[:1]
    twice = np.concatenate([faces, faces + sheet.n_vertices])
    positions = np.concatenate([sheet.positions[:], sheet.positions[:] + np.float32(9)], axis=1)
    with pytest.raises(InputError, match="^gv codes one connected manifold surface.*choose another codec$"):
        load("gv")().encode(MeshSequence(positions, twice))


def test_a_cut_surface_covers_the_square() -> None:
    """A sphere without poles: no triangle of the map is turned over, their areas make up the square."""
    points, triangles = ball(9, 14)
    found = map_to_square(points.astype(np.float64), triangles.astype(np.int64))
    first, second = (found.places[found.disk.triangles[:, k]] - found.places[found.disk.triangles[:, 0]] for k in (1, 2))
    areas = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert areas.min() > -1e-9
    assert areas.sum() == pytest.approx(1)


def test_wavelets_and_their_coding_give_back_images() -> None:
    images = np.random.default_rng(3).normal(0, 9, (2, 32, 32, 3))
    assert np.allclose(restore(transform(images[0])), images[0])
    values = np.rint(images).astype(np.int32)
    assert np.array_equal(decode_levels(Cursor(encode_levels(values), "levels"), values.shape), values)


@pytest.mark.parametrize("n_frames", [1, 2, 7, 20])
def test_the_lifting_scheme_gives_back_frames(n_frames: int) -> None:
    frames = np.random.default_rng(4).normal(0, 1, (n_frames, 5, 3))
    bands = split(frames, levels_of(n_frames, 4))
    assert len(bands[0]) == -(-n_frames // 16)
    assert np.allclose(join(bands), frames)


def test_the_lifting_scheme_leaves_no_detail_of_cubic_motion() -> None:
    """Its prediction has four frames, and so order four; but for frames at the ends."""
    time = np.arange(40.0)
    detail = split((time**3 - 20 * time**2).reshape(-1, 1, 1), 1)[1]
    assert np.abs(detail[2:-2]).max() < 1e-9 < np.abs(detail).max()


def test_norms_of_subbands_are_those_of_their_errors() -> None:
    rng, sizes = np.random.default_rng(8), [64, 64, 128, 256]
    for band, norm in enumerate(subband_norms(3)):
        bands = [rng.normal(0, 1, (size, 50, 1)) * (k == band) for k, size in enumerate(sizes)]
        assert np.square(join(bands)).sum() == pytest.approx(norm**2 * sizes[band] * 50, rel=0.1)


def test_ring_weights_reproduce_planes() -> None:
    """A point of a plane has no second difference, however its ring lies; three points on one line have equal weights."""
    rng = np.random.default_rng(2)
    angles = np.sort(rng.uniform(0, 1, (30, 6)) + np.arange(6), axis=1)
    rings = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=2) * rng.uniform(0.8, 1.2, (30, 6, 1))
    points = 0.1 * rng.normal(0, 1, (30, 3)) * [1, 1, 0]
    found = ring_weights(points, rings)
    assert np.allclose(found.sum(axis=1), 1)
    assert np.allclose((found[..., None] * rings).sum(axis=1), points)
    line = np.array([[[1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0]]])
    assert np.allclose(ring_weights(line[:, 0], line), 1 / 3)


def test_wavelets_on_a_mesh_give_back_values() -> None:
    points, triangles = ball(9, 14)
    wavelets = find_wavelets(build_hierarchy(triangles.astype(np.int32), len(points)), points.astype(np.float64))
    values = np.random.default_rng(5).normal(0, 1, (len(points), 4))
    assert wavelets.levels.max() > 3
    assert np.allclose(synthesise(analyse(values, wavelets), wavelets), values)
    assert level_norms(wavelets)[0] > 1.5 * level_norms(wavelets)[-1] == pytest.approx(1.5)


def test_local_frames_take_rigid_motion_out() -> None:
    """A body that turns and travels stands still in the frame of one of its triangles, and comes back from there."""
    points, triangles = ball(9, 14)
    rng = np.random.default_rng(6)
    turns = np.linalg.qr(rng.normal(0, 1, (30, 3, 3)))[0]
    turns *= np.linalg.det(turns)[:, None, None]
    frames = points @ turns + rng.normal(0, 9, (30, 1, 3))
    origins, axes = local_frames(frames[:, triangles[20]])
    local = localised(frames, origins, axes)
    assert np.allclose(local.reshape(len(points), 30, 3), local.reshape(len(points), 30, 3)[:, :1])
    assert np.allclose(placed(local, origins, axes), frames)


@pytest.mark.parametrize("least", LADDER)
def test_a_search_finds_the_number_of_clusters(least: int) -> None:
    asked: list[int] = []

    def size(n: int) -> int:
        asked.append(n)
        return abs(LADDER.index(n) - LADDER.index(least))

    assert find_count(size) == least
    assert asked[0] in (START, LADDER[LADDER.index(START) - 1])
    assert len(set(asked)) == len(asked) <= 3 + abs(LADDER.index(least) - LADDER.index(START))
    assert find_count(lambda n: 7) == START
