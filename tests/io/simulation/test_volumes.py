"""What lies inside of a simulation's surface: read, coded within its bounds, and written as the grid was."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import ROOT

import gvpipe
from gvpipe.asset_coding.volume_list import BY_WALK, CELLS, ORDER, POINTS, SECTION, VolumeList, pack_volume
from gvpipe.asset_coding.volume_reader import read_volume, read_volume_list
from gvpipe.connectivity.cell_traversal import decode_walk, encode_walk
from gvpipe.connectivity.cells import decode_cells, decode_order, encode_cells, encode_order
from gvpipe.container.mp4 import read_file
from gvpipe.foundation.errors import CorruptFile, InputError, OverBudget
from gvpipe.grids.borders import cell_edges, cells_behind, node_edges
from gvpipe.grids.cells import Cells, equal_cells, join_cells, structured_cells
from gvpipe.grids.volume import Volume
from gvpipe.io.simulation.surface import extract_surface

SAMPLE = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")
SIZES, N_FRAMES = (7, 6, 5), 6


def write_block(path: Path, tetrahedra: bool = False) -> Path:
    """A .pvd of the sample's block, small."""
    nodes = SAMPLE["tetrahedra" if tetrahedra else "hexahedra"](SIZES)
    folder = path.with_suffix("")
    folder.mkdir()
    listed = []
    for k, frame in enumerate(SAMPLE["frames"](SIZES, N_FRAMES, tetrahedra)):
        (folder / f"{k}.vtu").write_bytes(SAMPLE["vtu"](frame, nodes))
        listed.append(f'<DataSet timestep="{k}" file="{folder.name}/{k}.vtu"/>')
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(listed)}</Collection></VTKFile>')
    return path


def block(kind: str = "hexahedra", shuffled: bool = False) -> gvpipe.MeshSequence:
    """The same in memory; shuffled: points and cells in a random order."""
    nodes = SAMPLE["tetrahedra" if kind == "tetrahedra" else "hexahedra"](SIZES)
    frames = list(SAMPLE["frames"](SIZES, N_FRAMES))
    rng = np.random.default_rng(3)
    n_points = len(frames[0].points)
    place = rng.permutation(n_points) if shuffled else np.arange(n_points)
    nodes = place[nodes][rng.permutation(len(nodes)) if shuffled else slice(None)]
    cells = equal_cells(10 if kind == "tetrahedra" else 12, nodes)
    if kind == "mixed":
        cells = cut(nodes)
    back = np.argsort(place)
    points = np.stack([frame.points[back] for frame in frames]).astype(np.float32)
    heat = np.stack([frame.temperature[back] for frame in frames]).astype(np.float32)
    surface = extract_surface(cells, points[0])
    inner = np.setdiff1d(cells.nodes, surface.points)
    rows = np.concatenate([surface.points, inner])
    number = np.argsort(rows)
    own = Cells(cells.types, cells.offsets, number[cells.nodes])
    energy = np.repeat(np.arange(N_FRAMES, dtype=np.float32)[:, None], len(cells.types), 1) + np.arange(len(cells.types)) % 7
    volume = Volume(
        own,
        points[:, inner],
        np.argsort(number),
        {"heat": gvpipe.Field(heat[:, inner], "point")},
        {"energy": gvpipe.Field(energy.astype(np.float32), "cell")},
    )
    fields = {"heat": heat[:, surface.points], "energy": gvpipe.Field(energy[:, surface.cells].astype(np.float32), "triangle")}
    return gvpipe.MeshSequence(
        points[:, surface.points], surface.faces, 25, fields=fields, polygons=surface.polygons, volume=volume, name="block"
    )


def cut(nodes: np.ndarray) -> Cells:
    """Hexahedra of which some are two wedges."""
    wedges = nodes[::2]
    halves = np.concatenate([wedges[:, [0, 1, 2, 4, 5, 6]], wedges[:, [0, 2, 3, 4, 6, 7]]])
    return join_cells([equal_cells(12, nodes[1::2]), equal_cells(13, halves)], [0, 0])


def volume_of(sequence: gvpipe.MeshSequence) -> Volume:
    assert sequence.volume is not None
    return sequence.volume


def order_of(sequence: gvpipe.MeshSequence) -> np.ndarray:
    order = volume_of(sequence).order
    assert order is not None
    return order


def same_grid(a: gvpipe.MeshSequence, b: gvpipe.MeshSequence) -> None:
    """Two sequences have one surface, and bit for bit the same inside."""
    one, other = volume_of(a), volume_of(b)
    assert np.array_equal(a[:], b[:]) and {*map(frozenset, a.faces.tolist())} == {*map(frozenset, b.faces.tolist())}
    assert np.array_equal(one.cells.nodes, other.cells.nodes) and np.array_equal(one.cells.types, other.cells.types)
    assert np.array_equal(np.asarray(one.points[:]), np.asarray(other.points[:]))
    for mine, others in ((one.point_fields, other.point_fields), (one.cell_fields, other.cell_fields)):
        assert set(mine) == set(others)
        assert all(np.array_equal(mine[name][:], others[name][:]) for name in mine)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_a_volume_goes_through_a_file(tmp_path: Path, run: Any, tetrahedra: bool) -> None:
    source = write_block(tmp_path / "in.pvd", tetrahedra)
    given = gvpipe.read(source, volume=True)
    n_cells = 6 * 5 * 4 * (6 if tetrahedra else 1)
    assert len(volume_of(given).cells.types) == n_cells and volume_of(given).n_points == 5 * 4 * 3
    assert not given.not_carried and gvpipe.read(source).volume is None
    assert "--volume carries volume cells" in " ".join(gvpipe.read(source).notes)
    assert run("encode", source, tmp_path / "a.mp4", "--codec", "pca", "--volume").status == 0
    about = gvpipe.info(tmp_path / "a.mp4").volume
    assert about is not None and (about["cells"], about["points"]) == (n_cells, 60) and about["bytes"] > 0
    assert f"volume: {n_cells} cells, 60 inner points" in run("info", tmp_path / "a.mp4").out
    errors = gvpipe.compare(source, tmp_path / "a.mp4")
    assert errors.volume["(points)"]["max"] is not None and errors.volume["(points)"]["max"] <= errors.max
    decoded = gvpipe.read(tmp_path / "a.mp4")
    assert np.array_equal(order_of(decoded), order_of(given))
    for name, fields in (("temperature", volume_of(given).point_fields), ("energy", volume_of(given).cell_fields)):
        values = fields[name][:]
        surface = given.fields[name][:]
        spread = max(values.max(), surface.max()) - min(values.min(), surface.min())
        largest = errors.volume[name]["max"]
        assert largest is not None and 0 < largest <= 1e-3 * spread * (1 + 1e-6)
    assert run("decode", tmp_path / "a.mp4", tmp_path / "out.pvd").status == 0
    same_grid(decoded, gvpipe.read(tmp_path / "out.pvd", volume=True))
    part = gvpipe.read(tmp_path / "a.mp4", frames=(2, 5))
    assert np.array_equal(np.asarray(volume_of(part).points[0:1]), np.asarray(volume_of(decoded).points[2:3]))


@pytest.mark.parametrize("name", ["out.pvd", "out.vtkhdf", "out.xdmf", "out/%02d.vtu"])
def test_grids_are_written_as_they_were(tmp_path: Path, name: str) -> None:
    """Points, cells and numbers come back bit for bit, in the grid's order."""
    if name.endswith(("hdf", "xdmf")):
        pytest.importorskip("h5py")
    given = gvpipe.read(write_block(tmp_path / "in.pvd"), volume=True)
    gvpipe.write(given, tmp_path / name)
    found = gvpipe.read(tmp_path / name, volume=True)
    same_grid(given, found)
    assert np.array_equal(order_of(given), order_of(found))


def test_other_formats_say_what_they_leave_out(tmp_path: Path, run: Any) -> None:
    source = write_block(tmp_path / "in.pvd")
    given = gvpipe.read(source, volume=True)
    notes = gvpipe.write(given, tmp_path / "a.glb")
    assert any("120 cells and 60 inner points are left out" in note for note in notes)
    assert run("convert", source, tmp_path / "b.pvd", "--volume").status == 0
    same_grid(given, gvpipe.read(tmp_path / "b.pvd", volume=True))
    moved = gvpipe.read(source, volume=True, warp="velocity:0.1")
    expected = np.asarray(volume_of(given).points[2:3]) + 0.1 * volume_of(given).point_fields["velocity"][2:3]
    assert np.allclose(np.asarray(volume_of(moved).points[2:3]), expected, atol=1e-5)
    part = gvpipe.MeshSequence(given[:], given.faces, parts=(gvpipe.Part("a", (0, given.n_vertices), (0, len(given.faces))),))
    assert replace(part, volume=given.volume).reordered(np.arange(given.n_vertices), given.faces).volume is None


@pytest.mark.parametrize(
    "codec", ["pca", *(pytest.param(name, marks=pytest.mark.slow) for name in ("laplacian", "mcgv", "pdct"))]
)
def test_every_codec_and_layout_carries_volumes(tmp_path: Path, codec: str) -> None:
    given = gvpipe.read(write_block(tmp_path / "in.pvd"), volume=True)
    gvpipe.encode(given, tmp_path / "a.mp4", codec, max_error="0.1%", reorder=True)
    for layout in ("stream", "bare"):
        if layout == "bare":
            gvpipe.encode(given, tmp_path / "bare.mp4", codec, bare=True)
        else:
            gvpipe.restream(tmp_path / "a.mp4", tmp_path / "stream.mp4", layout)
        assert volume_of(gvpipe.read(tmp_path / f"{layout}.mp4")).n_points == 60
    errors = gvpipe.compare(given, tmp_path / "a.mp4")
    diagonal = errors.max / errors.max_diag if errors.max_diag else 1.0
    largest = errors.volume["(points)"]["max"]
    assert largest is not None and largest <= 1e-3 * diagonal * (1 + 1e-5)


def test_still_numbers_take_one_frame(tmp_path: Path) -> None:
    """A grid that stands still, with numbers that do not move inside, or nowhere."""
    given = gvpipe.read(write_block(tmp_path / "in.pvd"), volume=True)
    volume = volume_of(given)
    heat = {"temperature": gvpipe.Field(volume.point_fields["temperature"][0:1], "point")}
    still = np.repeat(np.asarray(volume.points[0:1]), N_FRAMES, 0)
    quiet = replace(volume, points=still, point_fields=heat, cell_fields={})
    sequence = replace(given, positions=np.repeat(given[0:1], N_FRAMES, 0), volume=quiet)
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca")
    found = volume_of(gvpipe.read(tmp_path / "a.mp4"))
    assert len(found.point_fields["temperature"]) == 1 and not found.cell_fields
    assert np.array_equal(np.asarray(found.points[0:1]), np.asarray(found.points[5:6]))
    gvpipe.write(gvpipe.read(tmp_path / "a.mp4"), tmp_path / "b.pvd")
    again = volume_of(gvpipe.read(tmp_path / "b.pvd", volume=True))
    assert np.array_equal(again.point_fields["temperature"][:][0], found.point_fields["temperature"][0])


@pytest.mark.parametrize("reorder", [False, True])
@pytest.mark.parametrize("kind", ["hexahedra", "tetrahedra", "mixed"])
def test_a_walk_codes_cells_in_any_order(tmp_path: Path, kind: str, reorder: bool) -> None:
    """Shuffled grids come back as they were, or, reordered, as the same cells of the same points."""
    given = block(kind, shuffled=True)
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", quality=95, reorder=reorder)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert video.bitstream.sections[CELLS][0] == BY_WALK
        found = video.sequence()
        ours, theirs = volume_of(given), volume_of(found)
        if not reorder:
            assert order_of(found)[theirs.cells.nodes].tolist() == order_of(given)[ours.cells.nodes].tolist()
            assert gvpipe.compare(given, video).volume["heat"]["max"] is not None
        else:
            assert theirs.order is None and "heat" not in gvpipe.compare(given, video).volume
        assert middles(given) == middles(found)
        for k in (0, N_FRAMES - 1):
            a, b = np.sort(ours.cell_fields["energy"][k]), np.sort(theirs.cell_fields["energy"][k])
            assert np.abs(a - b).max() <= 0.02


def middles(sequence: gvpipe.MeshSequence) -> list[Any]:
    """Where the cells of the first frame are, rounded, in any order."""
    volume = volume_of(sequence)
    points = np.concatenate([sequence[0], np.asarray(volume.points[0:1])[0]])
    sums = np.add.reduceat(points[volume.cells.nodes], volume.cells.offsets[:-1], axis=0)
    return sorted(np.rint(20 * sums / volume.cells.sizes[:, None]).astype(int).tolist())


def test_damaged_walks_are_refused_or_give_cells() -> None:
    """Whatever bytes there are, no kernel reads outside of its arrays, and no more cells come than are asked for."""
    given = block("tetrahedra", shuffled=True)
    volume = volume_of(given)
    counts = given.n_vertices, given.n_vertices + volume.n_points
    for keeps in (False, True):
        found = encode_walk(volume.cells, given.faces, given.polygons, counts, keeps)
        assert found is not None
        data, n_cells = found[0], len(volume.cells.types)
        rng = np.random.default_rng(2)
        for _ in range(300):
            broken = bytearray(data)
            for at in rng.integers(0, len(data), 3):
                broken[at] = rng.integers(0, 256)
            try:
                cells = decode_walk(bytes(broken), (given.faces, given.polygons), counts, n_cells, CELLS)
            except CorruptFile:
                continue
            assert len(cells.types) == n_cells and 0 <= cells.nodes.min() <= cells.nodes.max() < counts[1]


def test_cells_and_orders_come_back() -> None:
    """Cells of several types, in any order of points."""
    rng = np.random.default_rng(1)
    mixed = join_cells([structured_cells((4, 3, 3)), equal_cells(10, rng.integers(0, 36, (9, 4)))], [0, 0])
    wedge = join_cells(
        [mixed, equal_cells(13, rng.integers(0, 36, (2, 6))), equal_cells(12, rng.integers(0, 36, (1, 8)))], [0] * 3
    )
    found = decode_cells(encode_cells(wedge), len(wedge.types), 36, CELLS)
    assert np.array_equal(found.types, wedge.types) and np.array_equal(found.nodes, wedge.nodes)
    with pytest.raises(CorruptFile, match="none of 20 points"):
        decode_cells(encode_cells(wedge), len(wedge.types), 20, CELLS)
    with pytest.raises(CorruptFile, match="does not have 5 cells"):
        decode_cells(encode_cells(equal_cells(10, np.zeros((4, 4)))), 5, 36, CELLS)
    for order in (np.arange(9), np.array([0, 2, 5, 1, 3, 4, 6, 7, 8]), rng.permutation(9)):
        data = encode_order(order, 3)
        again = decode_order(data, 3, 9, ORDER)
        assert np.array_equal(np.arange(9) if again is None else again, order)
        for bad in (data[:1] + b"x", b"\x07"):
            if again is not None:
                with pytest.raises(CorruptFile):
                    decode_order(bad, 3, 9, ORDER)


def test_neighbours_of_cells() -> None:
    cells = structured_cells((3, 2, 2))  # two hexahedra
    assert cell_edges(cells).tolist() == [[1, 0]] and len(node_edges(cells)) == 20
    faces = np.array([[0, 3, 9], [0, 9, 6], [1, 4, 10], [1, 10, 7]], np.int32)
    assert cells_behind(cells, faces, np.array([4, 4], np.int32)).tolist()[0] == 0
    empty = Cells(np.zeros(0, np.uint8), np.zeros(1, np.int64), np.zeros(0, np.int64))
    assert cells_behind(empty, faces, None).tolist() == [-1] * 4 and not len(cell_edges(empty)) and not len(node_edges(empty))


def test_wrong_volumes_are_refused(tmp_path: Path) -> None:
    given = gvpipe.read(write_block(tmp_path / "in.pvd"), volume=True)
    volume = volume_of(given)
    with pytest.raises(InputError, match="cells of type 9"):
        Volume(equal_cells(9, np.zeros((1, 4))), np.zeros((1, 0, 3)))
    with pytest.raises(InputError, match="a volume of 2 frames"):
        replace(given, volume=replace(volume.part(0, 2)))
    with pytest.raises(InputError, match="have nodes"):
        replace(given, volume=replace(volume, cells=equal_cells(12, np.full((1, 8), 999)), cell_fields={}))
    with pytest.raises(InputError, match="a row for each of 60"):
        replace(volume, point_fields={"x": gvpipe.Field(np.zeros((N_FRAMES, 3), np.float32), "point")})
    with pytest.raises(InputError, match="per cell; a surface has"):
        replace(given, fields={"x": gvpipe.Field(np.zeros((N_FRAMES, 3), np.float32), "cell")})


def test_damaged_volumes_are_refused(tmp_path: Path) -> None:
    """Each section cut, or of other counts, gives one clear error."""
    given = gvpipe.read(write_block(tmp_path / "in.pvd"), volume=True)
    gvpipe.encode(given, tmp_path / "a.mp4", "pca")
    bitstream = read_file(tmp_path / "a.mp4")
    whole = dict(bitstream.sections)
    video = gvpipe.open(tmp_path / "a.mp4")
    surface = video.faces, video.polygons

    def opened(sections: dict[str, bytes]) -> None:
        broken = replace(bitstream, sections=sections)
        found = read_volume(broken, surface, video.attributes, video.fields, "a.mp4")
        assert found is not None
        for each in (found.points, *found.point_fields.values(), *found.cell_fields.values()):
            each[0:2]

    opened(whole)
    for name in (SECTION, CELLS, ORDER, POINTS, "volume.point.0", "volume.cell.2"):
        with pytest.raises(CorruptFile):
            opened({**whole, name: whole[name][:-9]})
        if name != SECTION:
            with pytest.raises(CorruptFile):
                opened({key: data for key, data in whole.items() if key != name})
    for listed in (VolumeList(121, 60), VolumeList(120, 61), VolumeList(120, 60, numbers=(_unknown(),))):
        with pytest.raises((CorruptFile, InputError)):
            opened({**whole, SECTION: pack_volume(listed)})
    with pytest.raises((OverBudget, CorruptFile)):
        opened({**whole, SECTION: pack_volume(VolumeList(1 << 29, 60))})


def _unknown() -> Any:
    from gvpipe.asset_coding.directory import Listed

    return Listed("nothing", "scalar", "cell", 0, "float32", "", 0.1, 1, "volume.cell.2")


@pytest.mark.parametrize("dimensions", [(2, 2, 2), (5, 2, 2)])
def test_grids_without_inner_points(tmp_path: Path, dimensions: tuple[int, int, int]) -> None:
    """A grid that is one cell thick has cells and no point inside."""
    cells = structured_cells(dimensions)
    z, y, x = np.meshgrid(*(np.arange(n) for n in dimensions[::-1]), indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    surface = extract_surface(cells, points)
    volume = Volume(cells, np.zeros((2, 0, 3), np.float32))
    given = gvpipe.MeshSequence(np.stack([points, points + 1]), surface.faces, 25, polygons=surface.polygons, volume=volume)
    for reorder in (False, True):
        gvpipe.encode(given, tmp_path / "a.mp4", "pca", reorder=reorder)
        assert len(volume_of(gvpipe.read(tmp_path / "a.mp4")).cells.types) == len(cells.types)
    gvpipe.write(gvpipe.read(tmp_path / "a.mp4"), tmp_path / "b.pvd")
    assert volume_of(gvpipe.read(tmp_path / "b.pvd", volume=True)).n_points == 0


def test_numbers_that_are_still_on_the_surface_alone(tmp_path: Path, run: Any) -> None:
    """They are an attribute there, move inside with more digits than float32 has, and come back within their bound."""
    given = block()
    volume = volume_of(given)
    steps = np.arange(volume.n_points) * 1e-3 * np.arange(N_FRAMES)[:, None] + 101325.0
    heat = gvpipe.Field(steps, "point")
    assert heat.dtype == np.float64
    attributes = {"heat": np.full(given.n_vertices, 101325, np.float32)}
    given = replace(
        given, attributes=attributes, fields={}, volume=replace(volume, point_fields={"heat": heat}, cell_fields={})
    )
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"heat": 0.001})
    assert run("decode", tmp_path / "a.mp4", tmp_path / "b.pvd").status == 0
    found = volume_of(gvpipe.read(tmp_path / "b.pvd", volume=True)).point_fields["heat"]
    assert np.abs(found[:] - steps).max() <= 0.001
    gvpipe.render(tmp_path / "a.mp4", tmp_path / "a.png", field="heat", cut="x=50%", size=160)  # of an attribute


def test_what_volumes_lose_is_said(tmp_path: Path) -> None:
    nodes = SAMPLE["hexahedra"]((3, 3, 3))
    frame = next(SAMPLE["frames"]((3, 3, 3), 1))
    more = frame._replace(
        points=np.concatenate([frame.points, [[9, 9, 9]]]),
        temperature=np.append(frame.temperature, 1),
        velocity=np.concatenate([frame.velocity, [[0, 0, 0]]]),
    )
    (tmp_path / "a.vtu").write_bytes(SAMPLE["vtu"](more, nodes))
    assert "points of no cell" in gvpipe.read(tmp_path / "a.vtu", volume=True).not_carried
    plain = gvpipe.read(tmp_path / "a.vtu", volume=True)
    points: Any = volume_of(plain).points
    assert np.array_equal(points[0], np.asarray(points)[0])
    with pytest.raises(IndexError):
        points[1]
    gvpipe.write(gvpipe.read(ROOT / "samples" / "flag.npz").part(0, 1), tmp_path / "b.vtp")
    assert "there are no volume cells to keep" in gvpipe.read(tmp_path / "b.vtp", volume=True).notes


def test_times_of_parts_follow(tmp_path: Path, run: Any) -> None:
    """Whichever way frames are chosen, they keep their times."""
    source = write_block(tmp_path / "in.pvd")
    assert gvpipe.read(source).part(2, 5).times.tolist() == [2, 3, 4]
    for options in (("--start", "3"), ("--frames", "3:")):
        assert run("convert", source, tmp_path / "out.pvd", *options).status == 0
        assert gvpipe.read(tmp_path / "out.pvd").times.tolist() == [3, 4, 5]


def test_numbers_inside_have_the_surface_s_bound(tmp_path: Path) -> None:
    """Of a field whose numbers grow: the range of all frames counts, inside as on the surface."""
    sequence = block()
    volume = volume_of(sequence)
    grows = np.arange(1, N_FRAMES + 1, dtype=np.float32)[:, None] ** 3
    surface = gvpipe.Field((np.asarray(sequence.fields["heat"][:]) * grows).astype(np.float32))
    inner = gvpipe.Field((np.asarray(volume.point_fields["heat"][:]) * 0.01).astype(np.float32), "point")
    changed = replace(
        sequence, fields={**sequence.fields, "heat": surface}, volume=replace(volume, point_fields={"heat": inner})
    )
    gvpipe.encode(changed, tmp_path / "a.mp4", "pca")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        bounds = {each.name: each.bound for each in video.directory.fields}
        listed = read_volume_list(video.bitstream)
    assert listed is not None
    (heat,) = [each for each in listed.numbers if each.name == "heat"]
    assert heat.bound == pytest.approx(bounds["heat"], rel=0.01)  # inside, numbers go a little lower
