"""Small files that ask for a lot, behind valid checksums: they are refused before they have cost much.

Memory and processor time are measured in one process of its own, which has read an ordinary file of each codec before.
"""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import GOLDEN
from odd_headers import payload_of
from sequences import grid
from tubes import operator_of

import gvpipe
from gvcodecs.laplacian.laplace_kernels import thin_rows
from gvcodecs.laplacian.normal_equations import NO_LIMIT, NormalEquations, count_fill, most_products
from gvpipe.asset_coding.directory import CODED
from gvpipe.attributes.attribute_coding import encode_attribute
from gvpipe.attributes.surface import Surface
from gvpipe.coding.corrections.displacements import decode_group
from gvpipe.connectivity.topology_only import HEADER as MESH
from gvpipe.connectivity.topology_only import encode_mesh
from gvpipe.container import mp4
from gvpipe.container.bitstream import Bitstream, unpack_payload
from gvpipe.container.cursor import pack_block, varint
from gvpipe.entropy.integers import encode_integers
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.head import Head
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.budget import BYTES_PER_BYTE, LEAST_BYTES, LEAST_SECONDS, SECONDS_PER_BYTE, Budget
from gvpipe.foundation.errors import CorruptFile, OverBudget
from gvpipe.media.video import PROFILES, VideoReader
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.files import read_runs

WARM = ("laplacian-1-still", "mcgv-1-jpeg", "mcgv-1-rigid", "pca-1-still", "pdct-1-seams")
ZERO = encode_integers(np.zeros(1, np.int64))  # however many zeros
MEASURE = """
import json, os, sys, time
import gvpipe
def peak():
    lines = open("/proc/self/status").read() if os.path.exists("/proc/self/status") else ""
    return 1024 * int(lines.split("VmHWM:")[1].split()[0]) if "VmHWM" in lines else 0
def measure(path):
    if os.path.exists("/proc/self/clear_refs"):
        open("/proc/self/clear_refs", "w").write("5")
    before, started, error = peak(), time.process_time(), ""
    try:
        gvpipe.open(path)[0]
    except gvpipe.GvpipeError as exc:
        error = type(exc).__name__ + ": " + str(exc)
    return [error, peak() - before, time.process_time() - started]
n_warm = int(sys.argv[1])
for path in sys.argv[2 : 2 + n_warm]:
    measure(path)
print(json.dumps([measure(path) for path in sys.argv[2 + n_warm :]]))
"""


def changed(name: str, **values: Any) -> Bitstream:
    """A golden file with other sections, counts or settings."""
    whole = mp4.read_file(GOLDEN / f"{name}.mp4")
    sections = {**whole.sections, **values.pop("sections", {})}
    header = {**whole.header, **values.pop("header", {})}
    return dataclasses.replace(whole, sections=sections, header=header, **values)


def random_triangles(n_points: int) -> Int32:
    """Two triangles a point, which connect points at random."""
    faces = np.random.default_rng(0).integers(0, n_points, (2 * n_points, 3)).astype(np.int32)
    return np.asarray(faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])


def much_fill(name: str) -> Bitstream:
    """A Laplacian whose factor has 14 million entries, and takes 23,000 million products."""
    faces, n = random_triangles(6000), 6000
    coded, mesh = encode_mesh(faces, np.arange(n), reorder=True)
    sections = {"mesh": coded.mesh, "order": coded.order}
    counts = {"n_vertices": len(mesh.points), "n_triangles": len(mesh.faces)}
    return changed(name, sections=sections, **counts)


def hub() -> Bitstream:
    """A fan of 40,000 points: the list of its middle is gone through for each of the others."""
    n = 40_000
    rim = np.arange(n - 2)
    faces = np.stack([rim, rim + 1, np.full_like(rim, n - 1)], axis=1).astype(np.int32)
    coded, _ = encode_mesh(faces, np.arange(n), reorder=True)
    sections = {"mesh": coded.mesh, "order": coded.order}
    return changed("laplacian-1-tutte", sections=sections, n_vertices=n, n_triangles=n - 2)


def wheel(name: str, n: int, turn: int) -> Bitstream:
    """Two hubs over a rim of n points, each of which takes sides from both; ``turn`` -1: triangles the other way round."""
    rim = np.arange(n)
    halves = [np.stack([rim, np.roll(rim, -1), np.full(n, n)]), np.stack([np.roll(rim, -1), rim, np.full(n, n + 1)])]
    faces = np.concatenate(halves, axis=1)[::turn].T.astype(np.int32)
    coded, _ = encode_mesh(faces, np.arange(n + 2), reorder=True)
    sections = {"mesh": coded.mesh, "order": coded.order}
    return changed(name, sections=sections, n_vertices=n + 2, n_triangles=2 * n)


def huge_pictures() -> Bitstream:
    """JPEG images of 32000 x 32000."""
    whole = changed("mcgv-1-jpeg")
    video, at = bytearray(whole.video), 0
    while (at := video.find(b"\xff\xc0\x00\x0b", at + 1)) >= 0:
        video[at + 5 : at + 9] = (32000).to_bytes(2, "big") * 2
    return dataclasses.replace(whole, video=bytes(video))


def deflated_triangles() -> Bitstream:
    n = 5 << 20
    mesh = MESH.pack(0, 0, len(loose := zlib.compress(bytes(12 * n), 9)), len(ZERO), n, 3) + loose + ZERO + ZERO
    return changed("pca-1-kalman", sections={"mesh": mesh, "order": b""}, n_vertices=3, n_triangles=n)


def vertices_alone() -> Bitstream:
    mesh = MESH.pack(0, 0, 0, len(ZERO), 0, 1 << 24) + ZERO
    return changed("pca-1-kalman", sections={"mesh": mesh, "order": b""}, n_vertices=1 << 24, n_triangles=0)


def free_values() -> Bitstream:
    basis = varint(1 << 14) + pack_block(ZERO) + bytes(40)
    return changed("pca-1-kalman", sections={"basis.0": basis}, n_frames=6000, header={"segments": 1, "steps": [0.1]})


def long_clip() -> Bitstream:
    return changed("pdct-1", n_frames=100_000, header={"clips": 1})


def long_transforms() -> Bitstream:
    whole = changed("mcgv-1-rigid", n_frames=1 << 24, header={"segments": 1})
    return dataclasses.replace(whole, sections={name: data for name, data in whole.sections.items() if name != "holds"})


def many_runs(n: int = 1 << 24) -> Bitstream:
    return changed("pca-1-still", n_frames=n, sections={"holds": varint(n) + ZERO})


def deflated_list() -> Bitstream:
    text = b'{"version": 1, "parts": [' + b"{}," * (16 << 20) + b"{}]}"
    return changed("pca-1-kalman", sections={"asset": zlib.compress(text, 9)})


def wide_attribute(n: int) -> Bitstream:
    """An attribute of 64 components, all zeros, where the list has one."""
    faces = np.array([[0, 1, 2]], np.int32)
    coded, _ = encode_mesh(faces, np.arange(n), reorder=True)
    listed = {"name": "a", "kind": "scalar", "domain": "vertex", "components": 1, "dtype": "uint8", "bound": 0, "coding": CODED}
    asset = {"version": 1, "geometry": False, "metadata": {}, "attributes": [{**listed, "section": "attribute.0"}]}
    empty: dict[str, list[object]] = {"parts": [], "fields": [], "materials": [], "images": []}
    sections = {
        "mesh": coded.mesh,
        "order": coded.order,
        "asset": zlib.compress(json.dumps({**asset, **empty}).encode()),
        "attribute.0": encode_attribute(np.zeros((10, 64), np.uint8), None, Surface(faces, 10), domain="vertex", kind="scalar"),
    }
    return changed("pca-1-kalman", sections=sections, n_vertices=n, n_triangles=1)


def many_samples(video: bytes) -> bytes:
    """2**24 samples of one byte."""
    at = video.find(b"stsz") + 8
    return video[:at] + (1).to_bytes(4, "big") + (1 << 24).to_bytes(4, "big") + video[at + 8 :]


def many_keys(video: bytes) -> bytes:
    """2**28 names of tags, which FFmpeg would allocate pointers for."""
    at = video.find(b"keys") + 8
    return video[:at] + (1 << 28).to_bytes(4, "big") + video[at + 4 :]


BOMBS: dict[str, tuple[Callable[[], Bitstream], str]] = {
    "pictures": (huge_pictures, "CorruptFile: .*32000x32000"),
    "deflated triangles": (deflated_triangles, "OverBudget: .*5242880 triangles"),
    "vertices alone": (vertices_alone, "OverBudget: .*16777216 vertices"),
    "free values": (free_values, "OverBudget: .*16384 trajectories"),
    "much fill": (partial(much_fill, "laplacian-1-tutte"), "TooMuchFill: .*points at random"),
    "much fill of the average": (partial(much_fill, "laplacian-1"), "TooMuchFill: .*points at random"),
    "a hub": (hub, "OverBudget: .*factoring over 40000 points"),
    "a wheel": (partial(wheel, "pca-1-kalman", 100_000, 1), "OverBudget: .*section 'basis.0'"),
    "a traversed wheel": (partial(wheel, "pca-1-first", 58_000, -1), "CorruptFile: .*coefficients.0"),
    "a long clip": (long_clip, "OverBudget: .*100000 frames"),
    "long transforms": (long_transforms, "OverBudget: .*16777216 frames"),
    "many runs": (many_runs, "OverBudget: .*16777216 distinct frames"),
    "a deflated list": (deflated_list, "OverBudget: .*section 'asset'"),
}
SLOWEST = 2.0  # times as long as the budget says, on machines of half the speed that it was measured on
TABLES = {"many samples": many_samples, "many keys": many_keys}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, str, int, float]]:
    """Of each bomb its file, the error, bytes of memory and seconds of processor time."""
    folder = tmp_path_factory.mktemp("bombs")
    paths = {}
    for name, (build, _) in BOMBS.items():
        mp4.write_file(build(), folder / f"{name}.mp4")
        paths[name] = folder / f"{name}.mp4"
    for name, change in TABLES.items():
        paths[name] = folder / f"{name}.mp4"
        paths[name].write_bytes(change((GOLDEN / "mcgv-1-h264.mp4").read_bytes()))
    warm = [str(GOLDEN / f"{name}.mp4") for name in WARM]
    command = [sys.executable, "-c", MEASURE, str(len(warm)), *warm, *map(str, paths.values())]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return {name: (paths[name], *result) for name, result in zip(paths, json.loads(printed), strict=True)}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*BOMBS, *TABLES])
def test_a_bomb_is_refused_cheaply(name: str, measured: dict[str, tuple[Path, str, int, float]]) -> None:
    path, error, memory, seconds = measured[name]
    n_bytes = path.stat().st_size
    assert memory <= max(LEAST_BYTES, BYTES_PER_BYTE * n_bytes), f"{memory / 1e6:.0f} MB for {n_bytes} bytes: {error}"
    assert seconds <= SLOWEST * max(LEAST_SECONDS, SECONDS_PER_BYTE * n_bytes), f"{seconds:.1f} s for {n_bytes} bytes: {error}"
    wanted = BOMBS[name][1] if name in BOMBS else "CorruptFile: .*table"
    assert re.match(wanted, error), error
    if not error.startswith("CorruptFile"):
        assert "--unlimited" in error and path.name in error


def test_a_limit_can_be_lifted(tmp_path: Path) -> None:
    mp4.write_file(many_runs(1 << 20), tmp_path / "a.mp4")
    with pytest.raises(OverBudget):
        gvpipe.open(tmp_path / "a.mp4")
    with pytest.raises(CorruptFile, match="1048576 frames in 3 segments"):  # its runs were decoded
        gvpipe.open(tmp_path / "a.mp4", unlimited=True)
    with pytest.raises(CorruptFile, match="1048576 frames"):
        read_runs(tmp_path / "a.mp4", unlimited=True)


@pytest.mark.parametrize("command", [("convert", "out.npz"), ("encode", "out.mp4")])
def test_a_limit_can_be_lifted_where_files_are_split(run: Callable[..., Any], tmp_path: Path, command: tuple[str, str]) -> None:
    mp4.write_file(many_runs(1 << 20), tmp_path / "a.mp4")
    given = (command[0], tmp_path / "a.mp4", tmp_path / command[1], "--split")
    assert "--unlimited" in run(*given).err
    assert "1048576 frames in 3 segments" in run(*given, "--unlimited").err


def test_a_limit_of_factors_can_be_lifted(tmp_path: Path) -> None:
    operator = thin_rows(operator_of(np.zeros((700, 3)), random_triangles(700), "tutte"))
    n_products = count_fill(operator, NO_LIMIT).products
    assert most_products(700) > n_products
    budget = Budget(1000)
    budget.keep("what came before", seconds=1.99)
    with pytest.raises(OverBudget, match="700 points takes about"):
        NormalEquations(operator, np.ones(700), budget)
    equations = NormalEquations(operator, np.ones(700), Budget(1000))
    equations.ask_to_solve(100)
    with pytest.raises(OverBudget, match="100000 solutions"):
        equations.ask_to_solve(100_000)
    NormalEquations(operator, np.ones(700)).ask_to_solve(100_000)


def test_groups_of_displacements_have_a_limit() -> None:
    n = 1 << 20
    group = varint(1) + pack_block(ZERO) + pack_block(encode_integers(np.array([n - 1]))) + 3 * pack_block(ZERO)
    with pytest.raises(OverBudget, match="1048576 displacements"):
        decode_group(group, n >> 4, 16, "corrections", Budget(1000))


def test_attributes_have_as_many_components_as_are_listed(tmp_path: Path) -> None:
    """75,000 vertices fit the budget with one component; 64 took 124 MB of a file of 2 kB."""
    mp4.write_file(wide_attribute(75_000), tmp_path / "a.mp4")
    video = gvpipe.open(tmp_path / "a.mp4")
    with pytest.raises(CorruptFile, match="64 components; section 'asset' lists 1"):
        video.attributes["a"]


def test_segments_of_fields_have_a_limit() -> None:
    mesh = FieldMesh(np.array([[0, 1, 2]], np.int32), 3)
    n_frames = 100_000
    segment = bytes(2) + b"\1" + bytes(64) + np.float64(1).tobytes() + bytes(5)
    section = Head(np.dtype("f4"), 55, n_frames).pack([segment])
    with pytest.raises(OverBudget, match="100000 frames of 3 rows"):
        FieldReader(section, n_frames, mesh, "heat", budget=Budget(1000)).read(0, 1)


@pytest.mark.parametrize("kind", ["constant", "ramp"])
def test_fields_that_take_no_bytes_are_read_within_the_budget(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gvpipe.foundation.budget.LEAST_BYTES", 1 << 20)
    mesh, n_frames = FieldMesh(grid(12)[1], 144), 500
    slope = np.linspace(0, 1, n_frames, dtype=np.float32) if kind == "ramp" else np.zeros(n_frames, np.float32)
    values = np.broadcast_to(20 + slope[:, None, None], (n_frames, 144, 1))
    section = encode_field(lambda start, stop: values[start:stop], n_frames, mesh, FieldBound(0.01))
    budget = Budget(len(section))
    assert 53 * values.size > budget.memory  # in one segment it would be too much
    assert np.abs(FieldReader(section, n_frames, mesh, "heat", budget=budget).read(0, n_frames) - values).max() <= 0.01


def test_a_file_whose_attributes_are_refused_gets_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gvpipe.foundation.budget.LEAST_BYTES", 2 << 20)
    monkeypatch.setattr("gvpipe.foundation.budget.BYTES_PER_BYTE", 0)
    positions, faces = grid(30)
    wide = MeshSequence(np.stack([positions, positions + 1]), faces, 24, attributes={"wide": np.zeros((900, 40), np.uint8)})
    assert not gvpipe.encode(dataclasses.replace(wide, attributes={}), tmp_path / "a.mp4", "pca").notes
    (note,) = gvpipe.encode(wide, tmp_path / "a.mp4", "pca").notes
    assert "needs --unlimited (attribute 'wide' takes" in note
    with pytest.raises(OverBudget):
        gvpipe.open(tmp_path / "a.mp4").attributes["wide"]
    assert gvpipe.open(tmp_path / "a.mp4", unlimited=True).attributes["wide"].shape == (900, 40)


def test_pictures_have_a_limit() -> None:
    with pytest.raises(OverBudget, match="16000x16000"):
        VideoReader(mp4.read_file(GOLDEN / "mcgv-1-h264.mp4").video, PROFILES["h264-8"], 16000, 16000, Budget(1000))


def test_what_is_kept_counts_with_what_is_asked_for() -> None:
    budget = Budget(0)
    budget.keep("a mesh", memory=LEAST_BYTES / 2, seconds=1.5)
    budget.ask("a frame", memory=LEAST_BYTES / 2, seconds=0.5)
    for more in ({"memory": LEAST_BYTES / 2 + 1}, {"seconds": 0.6}):
        with pytest.raises(OverBudget, match="a frame takes about"):
            budget.ask("a frame", **more)
    assert Budget(1 << 20).memory == BYTES_PER_BYTE << 20 and Budget(1 << 20).seconds == SECONDS_PER_BYTE * (1 << 20)


@pytest.mark.parametrize("name", ["\x1b[31m", "Mesh", "mesh 0", "[red]", "m\0sh", "\xff"])
def test_sections_have_plain_names(name: str) -> None:
    with pytest.raises(CorruptFile, match="a section's name is not of a to z") as caught:
        unpack_payload(payload_of("{}", {name: b""}))
    assert name not in str(caught.value)
