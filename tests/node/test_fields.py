"""Fields as files have them, decoded by the player's JavaScript in Node: Python's values, bit for bit."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import DATA, SAMPLES
from waves import EXACT, SHEET, SHEET_FACES, wave

import gvpipe
from gvpipe.asset_coding.directory import OCTAHEDRAL, REDUCED, Listed
from gvpipe.fields import head
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.octahedral import angular_bound, from_octahedral, to_octahedral
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Float32
from gvpipe.playback.player import Player

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
N_FRAMES = 21
FIELDS = sorted((DATA / "fields").glob("*.npz"))


def moving() -> Float32:
    """Positions ``(F, V, 3)`` of the sheet, which waves."""
    t = np.arange(N_FRAMES)[:, None, None]
    return np.asarray(SHEET + 0.3 * np.sin(SHEET[:, [1, 2, 0]] * 3 + t / 4), np.float32)


@dataclass
class Job:
    """What `run_fields.mjs` is given: a mesh, its positions, and fields' sections with the values that Python makes of them."""

    faces: Array
    positions: Array
    polygons: Array | None = None
    data: bytearray = field(default_factory=bytearray)
    fields: list[Any] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)

    def put(self, array: Array | bytes) -> list[int]:
        start = len(self.data)
        self.data += array if isinstance(array, bytes) else array.tobytes()
        return [start, len(self.data)]

    def add(self, listed: Listed, section: bytes, values: Array, frames: Sequence[int]) -> None:
        """A field of which some frames are to be read; ``values (F, R, C)``."""
        entry = {"name": listed.name, "kind": listed.kind, "domain": listed.domain, "components": listed.components}
        entry |= {"section": listed.section, "type": listed.dtype, "bound": listed.bound}
        given = {"entry": entry, "isOctahedral": listed.coding == OCTAHEDRAL, "data": self.put(section)}
        given["reduced"] = None if listed.reduced is None else listed.reduced.values()
        self.fields.append({**given, "rows": values.shape[1], "frames": list(frames)})
        self.values.append(values[list(frames)])

    def run(self, folder: Path) -> str:
        """Run it, compare what comes back, and return what was printed."""
        polygons = None if self.polygons is None else self.polygons.tolist()
        job = {
            "polygons": polygons,
            "vertexCount": self.positions.shape[1],
            "frameCount": len(self.positions),
            "fields": self.fields,
        }
        positions = [self.put(np.ascontiguousarray(frame, "<f4")) for frame in self.positions]
        text = json.dumps({**job, "positions": positions, "faces": self.put(self.faces.astype("<i4"))})
        (folder / "job.json").write_text(text)
        (folder / "data.bin").write_bytes(self.data)
        script = Path(__file__).with_name("run_fields.mjs")
        done = subprocess.run(["node", script, folder], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        found = (folder / "values.bin").read_bytes()
        for entry, values in zip(self.fields, self.values, strict=True):
            assert found[: values.nbytes] == values.tobytes(), entry["entry"]
            found = found[values.nbytes :]
        assert not found
        return done.stdout


def add_made(job: Job, name: str, values: Array, bound: FieldBound, mode: str, domain: str = "vertex", **changes: Any) -> None:
    """Encode a field in one mode and add it, with frames in random order."""
    mesh = FieldMesh(SHEET_FACES, len(SHEET), domain)
    known: Any = (lambda a, b: job.positions[a:b]) if mode == "derived" else None
    read = to_octahedral if changes.get("coding") == OCTAHEDRAL else np.asarray
    section = encode_field(
        lambda a, b: read(values[a:b]), len(values), mesh, bound, name, positions=known, holes=True, modes=(mode,)
    )
    reader = FieldReader(section, len(values), mesh, name, known)
    assert reader.modes[0] == mode
    back = reader.read(0, len(values))
    back = from_octahedral(back) if changes.get("coding") == OCTAHEDRAL else back
    given = {"kind": "scalar", "dtype": back.dtype.name, "unit": "", "bound": 0.0, "coding": 1, **changes}
    listed = Listed(name=name, domain=domain, components=back.shape[2], section=name, **given)
    job.add(listed, section, back, np.random.default_rng(0).permutation(len(values)).tolist())


@pytest.mark.parametrize("longest", [head.FRAMES, 8], ids=["one segment", "three segments"])
def test_every_kind_of_field_is_python_s(longest: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(head, "FRAMES", longest)
    job = Job(SHEET_FACES, moving())
    triangles = FieldMesh(SHEET_FACES, len(SHEET), "triangle")
    bound, rng = FieldBound(0.02), np.random.default_rng(5)
    add_made(job, "scalar", wave(N_FRAMES), bound, "prediction")
    add_made(job, "cells", wave(N_FRAMES, 3, triangles), bound, "trajectories", "triangle", kind="vector")
    add_made(job, "tuned", wave(N_FRAMES), bound, "tuned")
    add_made(job, "exact", wave(N_FRAMES, 2), EXACT, "exact")
    add_made(job, "fine", wave(N_FRAMES, 2), FieldBound(2e-4), "trajectories")
    holes = wave(N_FRAMES, 2)
    holes[rng.random(holes.shape) < 0.2] = np.nan
    holes[3:9, 5:30] = np.nan
    add_made(job, "holes", holes, bound, "prediction")
    for dtype in ("int8", "uint8", "int16", "uint16", "int32", "uint32"):
        limits = np.iinfo(dtype)
        whole = np.cumsum(rng.integers(-2, 3, (N_FRAMES, len(SHEET), 2)), axis=0) + int(limits.max // 2)
        whole[5:11] = whole[4]  # frames that repeat
        whole[:, :, 1] = 7  # a component that is constant
        whole[:, ::5, 0] = whole[0, ::5, 0]  # rows that keep their values
        whole[7, 3, 0], whole[8, 4, 0] = limits.min, limits.max
        add_made(job, dtype, whole.astype(dtype), EXACT, "exact")
    follows = job.positions - job.positions[:1] + 0.01 * wave(N_FRAMES, 3)
    add_made(job, "displacement", follows.astype(np.float32), FieldBound(0.005), "derived", kind="vector")
    lengths = np.sqrt((follows.astype(np.float64) ** 2).sum(axis=2, keepdims=True)).astype(np.float32)
    add_made(job, "distance", lengths, FieldBound(0.01), "derived")
    ends = np.gradient(job.positions.astype(np.float64), axis=0)
    velocity = (24 * ends[:, SHEET_FACES].mean(axis=2)).astype(np.float32)
    add_made(job, "velocity", velocity, FieldBound(0.05), "derived", "triangle", kind="vector")
    normals = rng.normal(size=(1, len(SHEET), 3)) + 0.1 * np.cumsum(rng.normal(size=(N_FRAMES, len(SHEET), 3)), axis=0)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    add_made(job, "normal", normals.astype(np.float32), angular_bound(0.5), "prediction", kind="normal", coding=OCTAHEDRAL)
    assert job.run(tmp_path) == ""


@pytest.mark.slow
def test_fields_of_a_sample_are_python_s(tmp_path: Path) -> None:
    gvpipe.encode(SAMPLES / "flag.npz", tmp_path / "flag.mp4", preset="fast")
    with Player(tmp_path / "flag.mp4") as video:
        job = Job(video.faces, video[:])
        (listed,) = video.directory.fields
        values = video.fields["strain"].read(0, len(video))
        job.add(listed, video.bitstream.section(listed.section), values, [47, 0, 20])
    assert job.run(tmp_path) == ""


def test_what_repeats_is_python_s(tmp_path: Path) -> None:
    """Rows of polygons, equal components, offsets of float64; some of them together."""
    side = np.arange(len(SHEET)).reshape(round(len(SHEET) ** 0.5), -1)
    quads = np.stack([side[:-1, :-1], side[1:, :-1], side[1:, 1:], side[:-1, 1:]], axis=-1).reshape(-1, 4)
    faces, positions = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32), moving()
    counts = np.full(len(quads), 4)
    rng, t = np.random.default_rng(7), np.arange(N_FRAMES)[:, None, None]
    noise = 0.02 * rng.normal(size=(N_FRAMES, len(quads), 6))
    six = np.sin(SHEET[quads].mean(axis=1)[:, :1] + np.arange(6) + t / 5) + noise
    cells = np.repeat(six[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]], 2, axis=1)
    pressure = 101325 + np.sin(SHEET[:, 0] + t[..., 0] / 5)
    pressure[3, 5] = np.nan
    velocity = np.repeat(25 * np.gradient(positions.astype(np.float64), axis=0)[:, quads].mean(axis=2), 2, axis=1)
    fields = {
        "stress": gvpipe.Field(cells.astype(np.float32), "triangle"),
        "far": gvpipe.Field(cells[..., :3] + 1e6, "triangle"),
        "pressure": gvpipe.Field(pressure),
        "velocity": gvpipe.Field(velocity.astype(np.float32), "triangle"),
    }
    sequence = gvpipe.MeshSequence(positions, faces, 24, fields=fields, polygons=counts)
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca", fields={"velocity": "1%", "pressure": "0.1%,nan=keep"})
    with Player(tmp_path / "a.mp4") as video:
        job = Job(video.faces, video[:], video.polygons)
        for listed in video.directory.fields:
            assert listed.coding == REDUCED
            values = video.fields[listed.name].read(0, len(video))
            job.add(listed, video.bitstream.section(listed.section), values, [20, 0, 7, 3])
    assert job.run(tmp_path) == ""


@pytest.mark.slow
@pytest.mark.skipif(not FIELDS, reason="no ../shared/data")
@pytest.mark.parametrize("path", FIELDS, ids=lambda path: path.stem)
def test_real_fields_are_python_s(path: Path, tmp_path: Path) -> None:
    gvpipe.encode(path, tmp_path / "a.mp4", frames=(0, 30), preset="veryfast")
    with Player(tmp_path / "a.mp4") as video:
        assert video.directory.fields
        job = Job(video.faces, video[:])
        for listed in video.directory.fields:
            values = video.fields[listed.name]
            frames = [len(video) - 1, 0, len(video) // 2]
            blocks = {k: values.read(k, k + 1) for k in sorted(frames)}
            own = np.zeros((len(video), *blocks[0].shape[1:]), blocks[0].dtype)
            for k, block in blocks.items():
                own[k] = block[0]
            job.add(listed, video.bitstream.section(listed.section), own, frames)
    assert job.run(tmp_path) == ""


def test_damaged_sections_are_refused(tmp_path: Path) -> None:
    """Bytes changed or cut: an error that names the section, or values; never anything else."""
    whole = Job(SHEET_FACES, moving())
    add_made(whole, "cells", wave(N_FRAMES, 2), FieldBound(0.02), "trajectories")
    add_made(whole, "follows", whole.positions.copy(), FieldBound(0.02), "derived", kind="vector")
    add_made(whole, "numbers", wave(N_FRAMES).astype(np.int16), EXACT, "exact")
    rng, job = np.random.default_rng(1), Job(SHEET_FACES, moving())
    for given in whole.fields:
        section = bytes(whole.data[slice(*given["data"])])
        for trial in range(24):
            changed = bytearray(section[: rng.integers(len(section))] if trial % 3 == 0 else section)
            if trial % 3:
                changed[rng.integers(min(len(changed), 40 if trial % 3 == 1 else len(changed)))] ^= int(rng.integers(1, 256))
            job.fields.append({**given, "data": job.put(bytes(changed)), "frames": []})
            job.fields[-1]["entry"] = {**given["entry"], "section": f"{given['entry']['name']}.{trial}"}
            job.fields[-1]["probe"] = 3
    job.values = [np.zeros(0, np.float32)] * len(job.fields)
    printed = job.run(tmp_path).splitlines()
    assert len(printed) > 24
    assert all(": GeometryVideoError, corrupt: section '" in line for line in printed), printed
