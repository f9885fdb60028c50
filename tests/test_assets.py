"""Everything beside positions goes through a file, with every codec."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene

import gvpipe
from gvpipe.asset.polygons import polygon_corners
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.correspondence import match_corners

CODECS: list[tuple[str, dict[str, Any]]] = [
    ("mcgv", {}),
    ("mcgv", {"prediction": "affine"}),
    ("pca", {}),
    ("laplacian", {}),
    ("pdct", {}),
    ("pca", {"reorder": True}),
]
BOUNDS = {"uv": 0.25 / 32, "normal": 1.0, "color": 0, "mass": 1e-3, "group": 0, "density": 6.3e-3}


def polygons_of(sequence: gvpipe.MeshSequence, vertices: Any = None) -> set[tuple[int, ...]]:
    """Its polygons, each from its first corner on."""
    assert sequence.polygons is not None
    corners = sequence.faces.reshape(-1)[polygon_corners(sequence.polygons)]
    corners = corners if vertices is None else vertices[corners]
    ends = np.cumsum(sequence.polygons)
    return {tuple(corners[a:b].tolist()) for a, b in zip([0, *ends[:-1]], ends, strict=True) if b - a > 3}


@pytest.mark.parametrize(("codec", "settings"), CODECS)
def test_a_scene_goes_through_a_file(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    source = scene()
    report = gvpipe.encode(source, tmp_path / "a.mp4", codec, **settings)
    assert report.not_carried == []
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    if not settings.get("reorder"):
        assert [(p.name, p.vertices, p.triangles, p.material, p.parent) for p in decoded.parts] == [
            (p.name, p.vertices, p.triangles, p.material, p.parent) for p in source.parts
        ]
        assert polygons_of(decoded) == polygons_of(source)
    assert [part.name for part in decoded.parts] == ["left", "right"]
    assert decoded.polygons is not None
    assert sorted(decoded.polygons.tolist()) == sorted(np.asarray(source.polygons).tolist())
    assert decoded.materials == source.materials
    assert decoded.images == source.images
    assert decoded.metadata == source.metadata
    assert {name: each.domain for name, each in decoded.attributes.items()} == {
        name: each.domain for name, each in source.attributes.items()
    }
    errors = gvpipe.compare(source, decoded)
    for name, bound in BOUNDS.items():
        largest = errors.attributes[name]["max"]
        assert largest is not None
        assert largest <= bound * (1 + 1e-6), name
    spread = np.asarray(source.fields["flow"].read(0, 10))
    for name, bound in {"stress": 0.1, "flow": 1e-3 * float(np.ptp(spread)), "state": 0}.items():
        largest = errors.fields[name]["max"]
        assert largest is not None
        assert largest <= bound * 1.01, name
    assert decoded.fields["stress"].unit == "MPa"
    assert decoded.fields["state"].dtype == np.int16


@pytest.mark.parametrize("codec", ["mcgv", "pca"])
def test_seams_are_exact(codec: str, tmp_path: Path) -> None:
    source = scene()
    gvpipe.encode(source, tmp_path / "a.mp4", codec)
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    corners = match_corners(source.faces, decoded.faces)
    ours, theirs = source.attributes["uv"].indices[corners], decoded.attributes["uv"].indices
    pairs = np.unique(np.stack([ours, theirs], axis=1), axis=0)
    assert len(pairs) == len(np.unique(ours)) == len(np.unique(theirs))


def test_one_field_is_read_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = scene()
    gvpipe.encode(source, tmp_path / "a.mp4")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        with monkeypatch.context() as patch:
            patch.setattr(video._reader, "read", None)  # positions are not decoded
            assert video.fields["state"][2:5].shape == source.fields["state"][2:5].shape
        some = video.fields["stress"][2:5]  # follows from positions
        assert some.shape == (3, source.n_vertices)
        assert np.abs(some - source.fields["stress"][2:5]).max() <= 0.1
        assert video.fields["flow"][-1].shape == (source.n_vertices, 3)
        assert np.asarray(video.attributes["density"])[:, 0] == pytest.approx([1.5, 7.8], abs=6.3e-3)


def test_bounds_are_those_asked_for(tmp_path: Path) -> None:
    source = scene()
    report = gvpipe.encode(
        source, tmp_path / "a.mp4", attributes={"uv": 1e-5, "normal": "none", "mass": "exact"}, fields={"stress": "exact"}
    )
    assert report.not_carried == ["normal"]
    assert any("normal" in note for note in report.notes)
    errors = gvpipe.compare(source, gvpipe.decode(tmp_path / "a.mp4"))
    assert errors.attributes["uv"]["max"] is not None
    assert 0 < errors.attributes["uv"]["max"] <= 1e-5
    assert errors.attributes["normal"] == {"max": None, "mean": None}
    assert errors.attributes["mass"] == {"max": 0, "mean": 0}
    assert errors.fields["stress"] == {"max": 0, "mean": 0}


def test_textures_are_limited_on_request(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4", textures="16,webp")
    info = gvpipe.info(tmp_path / "a.mp4")
    assert [(image["media_type"], image["size"]) for image in info.images] == [("image/webp", [16, 16])]


def test_holes_are_refused_or_kept(tmp_path: Path) -> None:
    source = scene()
    stress = np.array(source.fields["stress"][:])
    stress[3, 7] = np.nan
    holed = gvpipe.MeshSequence(source.positions, source.faces, fields={"stress": stress})
    with pytest.raises(InputError, match="field 'stress': frame 3, vertex 7 is .*nan=keep"):
        gvpipe.encode(holed, tmp_path / "a.mp4")
    assert not (tmp_path / "a.mp4").exists()
    gvpipe.encode(holed, tmp_path / "a.mp4", fields={"stress": "0.1%,nan=keep"})
    kept = gvpipe.decode(tmp_path / "a.mp4").fields["stress"]
    assert np.array_equal(np.isnan(kept[:]), np.isnan(stress))
    assert np.nanmax(np.abs(kept[:] - stress)) <= 1e-3 * (np.nanmax(stress) - np.nanmin(stress)) * 1.001


def test_info_lists_everything(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4")
    info = gvpipe.info(tmp_path / "a.mp4")
    assert [part["material"] for part in info.parts] == ["skin", "steel"]
    assert {each["name"]: each["domain"] for each in info.attributes}["uv"] == "corner"
    assert all(each["bytes"] > 0 for each in [*info.attributes, *info.fields])
    assert info.fields[0]["range"] == pytest.approx([20, 80], abs=5)
    assert info.polygons["4"] > 36
    assert info.metadata["texts"] == {"author": "gvpipe"}


def test_a_target_in_bits_counts_everything(tmp_path: Path) -> None:
    report = gvpipe.encode(scene(40), tmp_path / "a.mp4", "pca", target_bpvf=25)
    assert report.bpvf <= 25
    assert (tmp_path / "a.mp4").stat().st_size * 8 / (report.vertices * report.frames) == report.bpvf


def test_part_of_a_video_keeps_its_asset(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4")
    some = gvpipe.decode(tmp_path / "a.mp4", 2, 5)
    assert len(some) == len(some.fields["stress"]) == 3
    assert len(some.parts) == 2
