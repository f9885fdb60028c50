from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.asset_coding.normal_fields import NormalRule, pack_rule, unpack_rule
from gvpipe.attributes.surface import Surface
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import CorruptFile
from gvpipe.metrics.asset_errors import angles


def normals_of(sequence: gvpipe.MeshSequence, is_welded: bool = False) -> Array:
    frames = sequence.read(0, len(sequence))
    return NormalRule("area", is_welded).normals(frames, Surface(sequence.faces, sequence.n_vertices, frames[0]))


def sized(sequence: gvpipe.MeshSequence, normals: Array, path: Path, **settings: str) -> tuple[int, float]:
    """Bytes of the normals in a file, and their largest error, degrees."""
    given = gvpipe.MeshSequence(
        sequence.positions, sequence.faces, fields={"normal": gvpipe.Field(normals, kind="normal")}, name="normals"
    )
    gvpipe.encode(given, path, "pca", quality=95, fields=settings)
    decoded = gvpipe.decode(path).fields["normal"]
    assert decoded.kind == "normal"
    return gvpipe.info(path).fields[0]["bytes"], float(angles(decoded[:], normals).max())


def test_normals_of_the_surface_need_no_numbers(tmp_path: Path) -> None:
    sequence = waving(12, 15)
    size, error = sized(sequence, normals_of(sequence), tmp_path / "a.mp4")
    assert size == 2
    assert error <= 1


def test_other_normals_are_kept_within_the_angle(tmp_path: Path) -> None:
    sequence = waving(12, 15)
    bent = normals_of(sequence) + np.array([0.3, 0, 0], np.float32)
    bent /= np.linalg.norm(bent, axis=2, keepdims=True)
    size, error = sized(sequence, bent, tmp_path / "a.mp4", normal="0.5")
    assert size > 100
    assert 0.05 < error <= 0.5
    exact, none = sized(sequence, bent, tmp_path / "a.mp4", normal="exact")
    assert exact > size
    assert none < 1e-3


def test_copies_of_a_vertex_share_the_normal(tmp_path: Path) -> None:
    sequence = waving(8, 6)
    frames = np.asarray(sequence.positions[:])[:, sequence.faces.reshape(-1)]
    soup = gvpipe.MeshSequence(frames, np.arange(frames.shape[1], dtype=np.int32).reshape(-1, 3))
    size, error = sized(soup, normals_of(soup, is_welded=True), tmp_path / "a.mp4")
    assert size == 2
    assert error <= 1


def test_rules_are_checked() -> None:
    rule = NormalRule("angle", True)
    assert unpack_rule(pack_rule(rule), "field.0") == rule
    for data in (b"", b"\0", b"\4\0", b"\0\2", b"\0\0\0"):
        with pytest.raises(CorruptFile, match="field.0"):
            unpack_rule(data, "field.0")
