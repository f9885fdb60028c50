"""What an asset has beside positions, as the module reads it: Python's values bit by bit, and errors for damage."""

from __future__ import annotations

import base64
import itertools
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import asset_files
import browsers
import numpy as np
import numpy.typing as npt
import pytest
from asset_files import write_asset
from pages import TEXT, check_frames
from sequences import awkward, waving

import gvpipe
from gvpipe import Attribute, Field, Image, Material, Part, Texture
from gvpipe.coding.registry import codec_class
from gvpipe.container.mp4 import read_file
from gvpipe.fields import head
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.player import Player

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
READ = f"""{TEXT} const video = await GeometryVideo.load(args[0]);
    const attributes = {{}};
    for (const [name, {{ values, indices, components, domain, kind, unit, type }}] of video.attributes) {{
      const own = {{ values: text(Float64Array.from(values)), indices: indices && text(indices) }};
      attributes[name] = {{ ...own, components, domain, kind, unit, type }};
    }}
    const {{ parts, polygons, notes, materials }} = video;
    const images = video.images.map(({{ name, mediaType, data }}) => [name, mediaType, text(data.slice())]);
    const counts = polygons && [...polygons];
    return {{ attributes, parts, polygons: counts, notes, materials, images, indices: text(video.indices) }};"""
FIELD = f"""{TEXT} const video = await GeometryVideo.load(args[0]);
    const field = video.fields.get(args[1]);
    const frames = [];
    for (const k of args[2]) frames.push(text(await field.frame(k)));
    const {{ range, bound, unit, components, domain, type }} = field;
    return {{ frames, range, bound, unit, components, domain, type }};"""
KIND = """const read = async (video) => {
      try {
        for (const field of video.fields.values()) await field.frame(video.frameCount - 1);
      } finally {
        video.close(); // a browser has room for about a hundred memories of kernels, which those that are left open keep
      }
      return "read";
    };
    return GeometryVideo.load(args[0]).then(read).catch((error) => `${error.kind}: ${error.message}`)"""
NO_SIMD = "this browser has no WebAssembly with SIMD; a newer one is needed"
Module = Callable[..., Any]
LOADS = itertools.count()
Site = tuple[Path, str]


def array(text: str, dtype: str) -> npt.NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype)


def address(path: Path) -> str:
    """Of a file that has just been written: a new one each time, so that no browser shows the file before."""
    return f"{path.name}?{next(LOADS)}"


def check_attributes(module: Module, written: Player) -> Any:
    """Triangles, values and which corners share them are Python's."""
    found = module(READ, address(Path(written.path)))
    assert np.array_equal(array(found["indices"], "<u4").reshape(-1, 3), written.faces)
    assert set(found["attributes"]) == set(written.attributes)
    for name, attribute in written.attributes.items():
        own, values = found["attributes"][name], np.asarray(attribute.values)
        assert (own["components"], own["kind"], own["unit"]) == (values.shape[1], attribute.kind, attribute.unit)
        assert (own["type"], own["domain"]) == (str(values.dtype), attribute.domain)
        assert np.array_equal(array(own["values"], "<f8").reshape(values.shape), values.astype(np.float64)), name
        assert (own["indices"] is None) == (attribute.indices is None)
        if attribute.indices is not None:
            assert np.array_equal(array(own["indices"], "<u4"), attribute.indices), name
    return found


def with_everything(sequence: MeshSequence, seed: int = 0) -> MeshSequence:
    """The sequence with an attribute of every kind and domain: smooth ones with seams, and random ones."""
    rng = np.random.default_rng(seed)
    v, t = sequence.n_vertices, len(sequence.faces)
    frame = sequence.read(0, 1)[0].astype(np.float64)
    size = np.abs(frame).max() or 1.0
    smooth = (frame / size).astype(np.float32)
    corner_uv = smooth[sequence.faces.ravel()][:, :2] + rng.integers(0, 2, (t, 1)).repeat(3, axis=0).astype(np.float32)
    directions = rng.normal(size=(v, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    flat = np.repeat(rng.normal(size=(t, 3)), 3, axis=0) + 1e-3
    tangents = np.c_[directions, rng.choice([-1.0, 1.0], v)]
    values, indices = np.unique(np.round(corner_uv, 2), axis=0, return_inverse=True)
    attributes: dict[str, Any] = {
        "uv": Attribute(smooth[:, :2] * 0.7, "vertex", "uv"),
        "normal": Attribute(directions.astype(np.float32), "vertex", "normal"),
        "tangent": Attribute(tangents.astype(np.float32), "vertex", "tangent"),
        "color": Attribute(rng.integers(0, 256, (v, 4)).astype(np.uint8), "vertex", "color"),
        "weight": Attribute(smooth[:, :1], "vertex", "scalar", unit="kg"),
        "wind": Attribute(rng.normal(size=(v, 5)).astype(np.float32), "vertex", "vector"),
        "big": Attribute(rng.integers(-(1 << 50), 1 << 50, (v, 1)), "vertex", "label"),
    }
    if t:
        attributes |= {
            "uv1": Attribute(values.astype(np.float32), "corner", "uv", indices=indices.ravel().astype(np.int32)),
            "facet": Attribute((flat / np.linalg.norm(flat, axis=1, keepdims=True)).astype(np.float32), "corner", "normal"),
            "again": Attribute(corner_uv[:, :1].copy(), "corner", "scalar"),
            "cell": Attribute(rng.integers(0, 9, (t, 1)).astype(np.int32), "triangle", "label"),
            "flow": Attribute(rng.normal(size=(t, 2)).astype(np.float32), "triangle", "vector"),
        }
    if sequence.parts:
        attributes["id"] = Attribute(np.arange(len(sequence.parts))[:, None], "part", "label")
    return rebuilt(sequence, attributes=attributes)


def rebuilt(sequence: MeshSequence, **changes: Any) -> MeshSequence:
    """The sequence with other members."""
    names = ("positions", "faces", "fps", "attributes", "name", "fields", "parts", "polygons", "materials", "images")
    return MeshSequence(**{**{name: getattr(sequence, name) for name in names}, **changes})


def quads(n: int = 7, n_frames: int = 6) -> MeshSequence:
    """Two waving sheets of quads, triangles and hexagons, as three parts; the first two share a sheet."""
    sheet = waving(n, n_frames)
    y, x = np.divmod(np.arange(n * n), n)
    corners = np.flatnonzero((x < n - 1) & (y < n - 1))
    cells = np.c_[corners, corners + 1, corners + n + 1, corners + n]
    order = np.random.default_rng(3).permutation(n * n)
    place = np.argsort(order)
    polygons = [list(place[cell]) for cell in cells]
    polygons[3] = polygons[3][:3]
    polygons[8] = [*polygons[8][:3], *place[[n * n - 1, n * n - 2, n * n - 3]]]
    polygons = [*polygons, *[[vertex + n * n for vertex in polygon] for polygon in polygons]]
    faces = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    counts = np.array([len(polygon) for polygon in polygons])
    ends = np.cumsum(counts - 2)
    first, half, end = int(ends[9]), int(ends[len(polygons) // 2 - 1]), int(ends[-1])
    one = sheet.read(0, n_frames)
    both = np.concatenate([one, one + np.array([1.5, 0, 0], np.float32)], axis=1)
    parts = (
        Part("sheet", (0, n * n), (0, first), 0),
        Part("sheet", (0, n * n), (first, half)),
        Part("other", (n * n, 2 * n * n), (half, end), 1, "root"),
    )
    materials = (Material("red", base_color=(1, 0, 0, 1)), Material())
    return MeshSequence(both, np.array(faces), 24.0, parts=parts, polygons=counts, materials=materials)


@pytest.mark.parametrize("geometry", [True, False])
@pytest.mark.parametrize("bound", [0.0, 0.01])
def test_attributes_of_parts_and_polygons_equal_pythons(
    geometry: bool, bound: float, module: Module, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(codec_class("mcgv"), "same_bits", geometry, raising=False)
    sequence = with_everything(quads())
    bounds: dict[str, float | str] = {**dict.fromkeys(sequence.attributes, bound), "normal": 100 * bound, "facet": 50 * bound}
    found = check_attributes(module, write_asset(site[0] / "x.mp4", sequence, bounds if bound else None))
    assert [part["name"] for part in found["parts"]] == ["sheet", "sheet", "other"]
    assert [part["triangles"] for part in found["parts"]] == [list(part.triangles) for part in sequence.parts]
    assert sequence.polygons is not None and sorted(found["polygons"]) == sorted(sequence.polygons)
    assert found["notes"] == []


@pytest.mark.parametrize("sequence", awkward().values(), ids=lambda sequence: sequence.name)
def test_attributes_of_awkward_meshes_equal_pythons(sequence: MeshSequence, module: Module, site: Site) -> None:
    whole = with_everything(sequence)
    check_attributes(module, write_asset(site[0] / "x.mp4", whole, dict.fromkeys(whole.attributes, 0.02)))
    check_attributes(module, write_asset(site[0] / "x.mp4", whole))


def test_materials_and_images_arrive(module: Module, site: Site) -> None:
    image = Image("wood", "image/png", asset_files.picture([[[1, 2, 3]]]))
    texture = Texture(0, "uv1", wrap=("mirror", "clamp"), filter="nearest", offset=(0.5, 0.25), rotation=0.125, tiling=(2, 3))
    materials = (Material("a", (0.5, 0.25, 1, 0.5), texture, alpha_mode="blend", unlit=True, double_sided=True), Material())
    sequence = rebuilt(waving(6, 4), materials=materials, images=[image], parts=[Part("sheet", (0, 36), (0, 50), 0)])
    found = module(READ, address(Path(write_asset(site[0] / "x.mp4", sequence).path)))
    ((name, media_type, data),) = found["images"]
    assert (name, media_type, base64.b64decode(data)) == ("wood", "image/png", image.data)
    first, second = found["materials"]
    assert first["base_color"] == [0.5, 0.25, 1, 0.5] and first["alpha_mode"] == "blend"
    assert first["unlit"] is first["double_sided"] is True
    expected = {"image": 0, "uv": "uv1", "scale": 1, "wrap": ["mirror", "clamp"], "filter": "nearest"}
    assert first["base_color_texture"] == {**expected, "offset": [0.5, 0.25], "rotation": 0.125, "tiling": [2, 3]}
    assert second["base_color_texture"] is None and second["roughness"] == 1 and second["metallic"] == 0
    assert found["parts"][0]["material"] == 0


@pytest.mark.parametrize("placement", ["halves", "auto"])
def test_fields_equal_pythons(placement: str, module: Module, site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every kind, in several segments, in any order; what follows from positions, by pictures of its own."""
    monkeypatch.setattr(head, "FRAMES", 24)
    rng, sheet = np.random.default_rng(2), waving(5, 60)
    positions = np.asarray(sheet.positions[0:60])
    holes = np.cumsum(rng.normal(size=(60, 25)), axis=0).astype(np.float32)
    holes[10:20, 3:9] = np.nan
    normals = rng.normal(size=(60, 25, 3))
    fields = {
        "stress": Field(holes, unit="MPa"),
        "moved": Field(positions - positions[:1] + 0.001 * rng.normal(size=positions.shape), kind="vector"),
        "cell": Field(rng.integers(-40, 3000, (60, len(sheet.faces))).astype(np.int16), "triangle"),
        "normal": Field((normals / np.linalg.norm(normals, axis=2, keepdims=True)).astype(np.float32), kind="normal"),
    }
    bounds: dict[str, float | str] = {"stress": "0.01,nan=keep", "moved": 0.01, "cell": "exact", "normal": 1.0}
    settings = {**asset_files.FAST, "placement": placement}
    gvpipe.encode(rebuilt(sheet, fields=fields), site[0] / "x.mp4", fields=bounds, **settings)
    with gvpipe.open(site[0] / "x.mp4") as video:
        moved = FieldReader(
            video.bitstream.section("field.1"), 60, FieldMesh(video.faces, 25), "field.1", lambda a, b: video[a:b]
        )
        assert "derived" in moved.modes
        for name, bound in bounds.items():
            order = [59, 0, 30, *rng.permutation(60).tolist()[:8]]
            found = module(FIELD, address(site[0] / "x.mp4"), name, order)
            own = video.fields[name]
            assert (found["unit"], found["components"], found["domain"]) == (own.unit, own.n_components, own.domain)
            assert found["type"] == own.dtype.name and found["range"] == list(own.range or ())
            assert bound in ("exact", found["bound"], f"{found['bound']},nan=keep")
            for k, text in zip(order, found["frames"], strict=True):
                assert base64.b64decode(text) == own.read(k, k + 1).tobytes(), (name, k)


@pytest.mark.parametrize("codec", ["mcgv", "pca"])
def test_a_browser_that_lacks_something(codec: str, module: Module, browser: Any, site: Site) -> None:
    """Without workers the page decodes; without SIMD in WebAssembly a file is refused, and the message says why."""
    sequence = rebuilt(waving(5, 4), fields={"heat": np.arange(100.0).reshape(4, 25)})
    gvpipe.encode(sequence, site[0] / "x.mp4", codec, fields={"heat": "exact"})
    look = """const video = await GeometryVideo.load(args[0]);
        return [video.notes, (await video.fields.get("heat").frame(2))[24], (await video.frame(3)).length];"""
    assert module("delete window.Worker;" + look, address(site[0] / "x.mp4")) == [[], 74, 75]
    browser.get(f"{site[1]}/module.html")  # a page asks once
    refused = "WebAssembly.validate = () => false;" + KIND
    assert module(refused, address(site[0] / "x.mp4")) == f"unsupported: {NO_SIMD}"


def test_a_newer_or_unknown_asset_is_skipped_and_said(module: Module, site: Site) -> None:
    path = site[0] / "x.mp4"
    write_asset(path, rebuilt(waving(5, 4), fields={"heat": np.zeros((4, 25))}))
    listing = asset_files.read_listing(path)
    notes = "const video = await GeometryVideo.load(args[0]); return [video.notes, [...video.fields.keys()], video.frameCount]"
    listing["fields"][0]["coding"] = 9
    asset_files.replace_asset(path, listing, {})
    (note,), fields, frames = module(notes, address(path))
    assert note == "field heat is not shown: a newer gvpipe wrote it" and fields == [] and frames == 4
    asset_files.replace_asset(path, {**listing, "version": 2}, {})
    (note,), fields, frames = module(notes, address(path))
    assert "a newer gvpipe" in note and frames == 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"attributes": [{"name": "uv"}]}, "'section' is undefined"),
        ({"parts": [{"name": "a", "vertices": [0, 99]}]}, "'vertices' is [0,99]"),
        ({"parts": [{"name": "a", "vertices": [0, 25], "material": 3}]}, "'material' is 3"),
        ({"parts": 5}, "'parts' is 5"),
        ({"materials": [{"base_color": [1, 1, 1]}]}, "'base_color' is [1,1,1]"),
        ({"materials": [{"base_color_texture": {"image": 0}}]}, "'image' is 0"),
        ({"materials": [{"alpha_mode": "half"}]}, "'alpha_mode' is"),
        ({"images": [{"name": "x", "section": "image.7"}]}, "section 'image.7' is missing"),
        ({"version": "one"}, "'version' is"),
        ([], "the list: it is []"),
    ],
    ids=str,
)
def test_wrong_members_are_refused(change: Any, message: str, module: Module, site: Site) -> None:
    path = site[0] / "x.mp4"
    write_asset(path, rebuilt(waving(5, 4), attributes={"uv": np.zeros((25, 2))}))
    listing = {**asset_files.read_listing(path), **change} if isinstance(change, dict) else change
    asset_files.replace_asset(path, listing, {})
    assert module(KIND, address(path)).startswith("corrupt: ")
    assert message in module(KIND, address(path))


def test_damaged_sections_are_refused_or_read(module: Module, site: Site) -> None:
    """Bytes changed or cut behind a checksum that fits: an error of its kind or some values, never anything else."""
    rng = np.random.default_rng(1)
    sequence = rebuilt(with_everything(quads()), fields={"heat": np.random.default_rng(0).random((6, 98))})
    path = site[0] / "x.mp4"
    write_asset(path, sequence, dict.fromkeys(sequence.attributes, 0.01))
    original = read_file(path)
    names = [name for name in original.sections if name.startswith(("attribute", "field", "arrangement", "asset"))]
    listing, seen = asset_files.read_listing(path), set()
    for name in names:
        data = original.section(name)
        for trial in range(8):
            changed = bytearray(data[: rng.integers(len(data))] if trial % 2 else data)
            if changed and trial % 2 == 0:
                changed[rng.integers(min(len(changed), 60))] ^= int(rng.integers(1, 256))
            asset_files.replace_asset(path, listing, {name: bytes(changed)})
            result = module(KIND, address(path))
            assert result == "read" or result.startswith("corrupt: "), (name, trial, result)
            seen.add(result[:7])
            asset_files.replace_asset(path, listing, {name: data})
    assert seen == {"read", "corrupt"}


def test_an_asset_that_inflates_without_end_is_refused(module: Module, site: Site) -> None:
    path = site[0] / "x.mp4"
    write_asset(path, waving(5, 4))
    asset_files.replace_asset(path, {}, {"asset": zlib.compress(bytes((1 << 26) + 1), 9)})
    assert "inflates to more than" in module(KIND, address(path))


def test_positions_stay_exact(module: Module, site: Site) -> None:
    write_asset(site[0] / "x.mp4", with_everything(waving(8, 8)))
    video = site[0] / "x.mp4"
    check_frames(module, video)
