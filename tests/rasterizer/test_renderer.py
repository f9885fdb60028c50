"""The painter: what is in front hides what is behind, outlines are where geometry says, and files hold what was asked for."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image
from sequences import awkward, waving

import gvpipe
from gvpipe.errors import InputError, OutputError
from gvpipe.rasterizer.camera import UP_AXES, VIEWS, Camera, framing
from gvpipe.rasterizer.colours import BACKGROUND, LEVELS, error_colours, srgb_codes, to_linear, to_srgb
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.error_map import ErrorMap
from gvpipe.rendering.films import Film, parse_size
from gvpipe.rendering.poster import make_poster, paint
from gvpipe.sequence import MeshSequence

Run = Callable[..., Any]
EMPTY = np.rint(255 * np.array(BACKGROUND)).astype(np.uint8)
FRONT_VIEW = Camera(distance=10.0, azimuth=0.0, elevation=0.0)


def ball(n_rings: int = 60, n_around: int = 120, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A sphere about the origin, counter-clockwise from outside; poles are rings of equal points."""
    down, around = np.meshgrid(np.linspace(0, np.pi, n_rings), 2 * np.pi * np.arange(n_around) / n_around, indexing="ij")
    points = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], axis=2)
    i, j = np.divmod(np.arange((n_rings - 1) * n_around), n_around)
    a, b = i * n_around + j, i * n_around + (j + 1) % n_around
    faces = np.concatenate([np.c_[a, a + n_around, b], np.c_[b, a + n_around, b + n_around]])
    return (radius * points).reshape(-1, 3).astype(np.float32), faces.astype(np.int32)


def sheet(z: float, slope: float, half: float = 1.0) -> np.ndarray:
    """A square that faces the eye, tilted about the y axis."""
    x, y = np.array([-half, half, half, -half]), np.array([-half, -half, half, half])
    return np.stack([x, y, z + slope * x], axis=1).astype(np.float32)


SQUARE = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def eye_of(camera: Camera) -> np.ndarray:
    return np.asarray(camera.target) + camera.distance * camera.rotation[2]


def ray_directions(camera: Camera, width: int, height: int) -> np.ndarray:
    """Where each pixel's middle looks, ``(height, width, 3)``: the camera model once more, by rays."""
    focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    x, y = (np.arange(width) + 0.5 - width / 2) / focal, -(np.arange(height) + 0.5 - height / 2) / focal
    grid = np.stack([*np.meshgrid(x, y), np.full((height, width), -1.0)], axis=2)
    return grid @ camera.rotation


def seen_by_rays(positions: np.ndarray, faces: np.ndarray, camera: Camera, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The nearest triangle along every ray, -1 for none, by Moeller and Trumbore; and how far the next one is behind it."""
    rays, eye = ray_directions(camera, size, size), eye_of(camera)
    distances = []
    for corner, one, two in positions.astype(float)[faces]:
        u, v = one - corner, two - corner
        across = np.cross(rays, v)
        determinant = across @ u
        with np.errstate(divide="ignore", invalid="ignore"):
            s = across @ (eye - corner) / determinant
            q = np.cross(eye - corner, u)
            t = rays @ q / determinant
            hit = (s >= 0) & (t >= 0) & (s + t <= 1)
            distances.append(np.where(hit, (v @ q) / determinant, np.inf))
    stacked = np.stack(distances)
    order = np.sort(stacked, axis=0)
    with np.errstate(invalid="ignore"):
        gap = order[1] - order[0]
    return np.where(np.isfinite(order[0]), stacked.argmin(axis=0), -1), gap


def test_interpenetrating_sheets_meet_where_their_planes_do() -> None:
    positions = np.concatenate([sheet(0.2, 0.5), sheet(0.0, -0.3)])  # equal where x = -0.25
    faces = np.concatenate([SQUARE, SQUARE + 4])
    size = 200
    for order in (faces, faces[::-1]):  # a painter's order would let one win
        seen = Renderer(order, positions, (size, size), samples=1).visible(positions, FRONT_VIEW)
        owner = np.where(seen < 0, -1, order[seen, 0] >= 4)
        line = FRONT_VIEW.distance - (0.2 - 0.5 * 0.25)  # depth of the meeting line
        focal = size / 2 / np.tan(np.radians(FRONT_VIEW.field_of_view) / 2)
        column = size / 2 - 0.25 * focal / line
        inside = slice(size // 2 - 30, size // 2 + 30)
        assert (owner[inside, round(column) + 1 : size // 2 + 30] == 0).all()
        assert (owner[inside, size // 2 - 35 : round(column) - 1] == 1).all()


def test_every_pixel_sees_what_its_ray_meets() -> None:
    rng = np.random.default_rng(11)
    positions = rng.uniform(-1, 1, (90, 3)).astype(np.float32)
    faces = np.arange(90, dtype=np.int32).reshape(-1, 3)  # thirty triangles through each other
    camera = Camera((0.1, 0.0, -0.1), 5.0, 30.0, 20.0)
    seen = Renderer(faces, positions, (128, 128), samples=1).visible(positions, camera)
    expected, gap = seen_by_rays(positions, faces, camera, 128)
    assert (expected >= 0).mean() > 0.3
    certain = (expected < 0) | ~np.isfinite(gap) | (gap > 1e-3)
    # only outlines, snapped to 1/256 of a pixel, may differ
    assert (seen != expected)[certain].mean() < 2e-3


def test_ball_covers_the_circle_that_geometry_says() -> None:
    positions, faces = ball(120, 240)
    camera = Camera((0.0, 0.0, 0.0), 6.0, 25.0, 40.0)
    size = 300
    seen = Renderer(faces, positions, (size, size), samples=1).visible(positions, camera) >= 0
    focal = size / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    radius = focal / np.sqrt(camera.distance**2 - 1)
    y, x = np.mgrid[:size, :size] + 0.5 - size / 2
    from_middle = np.hypot(x, y)
    assert seen[from_middle < radius * (1 - 4e-4) - 0.01].all()  # a polyhedron inside the sphere
    assert not seen[from_middle > radius + 0.01].any()


def test_neighbours_leave_no_crack_and_outlines_are_smooth() -> None:
    sequence = waving(30, 2)
    positions = sequence.read(0, 1)[0]
    camera = framing(sequence, view=(0.0, 60.0))
    seen = Renderer(sequence.faces, positions, (256, 256), samples=1).visible(positions, camera) >= 0
    runs = np.diff(seen.astype(np.int8), axis=1) == 1  # each row of a bent sheet enters it once
    assert runs.sum(axis=1).max() == 1
    points, faces = ball()
    jagged, smooth = (
        Renderer(faces, points, (64, 64), samples=n).draw(points, replace(FRONT_VIEW, distance=6.0)) for n in (1, 3)
    )
    assert len(np.unique(smooth[:, :, 0])) > len(np.unique(jagged[:, :, 0]))
    assert np.abs(smooth.astype(int) - jagged).mean() < 4


@pytest.mark.parametrize("up", UP_AXES)
@pytest.mark.parametrize("view", [*VIEWS, (123.0, -40.0)])
@pytest.mark.parametrize("aspect", [1.0, 2.5, 0.5])
def test_camera_frames_the_whole_motion(up: str, view: Any, aspect: float) -> None:
    moving = waving(8, 50)
    drift = np.linspace(0, 3, 50)[:, None, None] * np.array([1.0, 0.5, -2.0])
    loose = np.full((50, 1, 3), 1e4)  # a vertex that no triangle uses
    positions = np.concatenate([np.asarray(moving.positions[:]) + drift, loose], axis=1).astype(np.float32)
    sequence = MeshSequence(positions, moving.faces)
    camera = framing(sequence, None, view, up, aspect)
    x, y = projected(positions[:, :-1].reshape(-1, 3), camera)
    assert max(np.abs(x / aspect).max(), np.abs(y).max()) <= 0.95  # of half the picture
    assert max(np.ptp(x / aspect), np.ptp(y)) >= 1.85  # and no smaller than needed
    turning = framing(sequence, None, view, up, aspect, turntable=True)
    for azimuth in np.arange(0, 360, 7.0):
        x, y = projected(positions[:, :-1].reshape(-1, 3), replace(turning, azimuth=turning.azimuth + azimuth))
        assert max(np.abs(x / aspect).max(), np.abs(y).max()) <= 1.0


def projected(points: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Across and up, in halves of the picture's height."""
    seen = (points - np.asarray(camera.target)) @ camera.rotation.T
    scale = 1 / np.tan(np.radians(camera.field_of_view) / 2) / (camera.distance - seen[:, 2])
    return seen[:, 0] * scale, seen[:, 1] * scale


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_up_axis_points_up_and_views_are_where_they_say(up: str, axis: int) -> None:
    for name, (azimuth, elevation) in VIEWS.items():
        rotation = Camera(azimuth=azimuth, elevation=elevation, up=up).rotation
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12) and np.linalg.det(rotation) > 0
        assert (abs(rotation[1, axis]) > 0.9) == (name not in ("top", "bottom"))
        assert np.sign(round(rotation[2, axis], 9)) == {"top": 1, "bottom": -1, "three-quarter": 1}.get(name, 0)
    assert np.allclose(Camera(azimuth=90.0, elevation=0.0).rotation[2], [1, 0, 0])


def test_light_comes_from_the_upper_left_and_reaches_both_sides() -> None:
    positions, faces = ball()
    camera = replace(FRONT_VIEW, distance=6.0)
    picture = Renderer(faces, positions, (128, 128)).draw(positions, camera).astype(int).sum(axis=2)
    assert picture[40, 40] > picture[88, 88] + 100
    square = sheet(0.0, 0.0)
    front, back = (
        Renderer(f, square, (64, 64)).draw(square, FRONT_VIEW)[32, 32].astype(int) for f in (SQUARE, SQUARE[:, ::-1])
    )
    assert front[2] > front[0] and back[0] > back[2]  # bluish outside, warm inside
    assert min(front.max(), back.max()) > 120
    inside_out = Renderer(faces[:, ::-1], positions, (128, 128)).draw(positions, camera).astype(int).sum(axis=2)
    assert inside_out[40, 40] > inside_out[88, 88] + 100


def test_smooth_shading_hides_triangles_and_seams_and_flat_shows_them() -> None:
    positions, faces = ball(12, 24)
    soup = positions[faces.ravel()], np.arange(faces.size, dtype=np.int32).reshape(-1, 3)
    camera = replace(FRONT_VIEW, distance=6.0)
    smooth, flat = (Renderer(faces, positions, (128, 128), kind).draw(positions, camera) for kind in ("smooth", "flat"))
    assert len(np.unique(flat.reshape(-1, 3), axis=0)) < len(np.unique(smooth.reshape(-1, 3), axis=0)) / 2
    from_soup = Renderer(soup[1], soup[0], (128, 128)).draw(soup[0], camera)
    assert np.abs(from_soup.astype(int) - smooth).max() <= 1
    assert np.array_equal(Renderer(soup[1], soup[0], (128, 128), "flat").draw(soup[0], camera), flat)


def test_error_colours_keep_their_hue_under_light_and_match_the_values() -> None:
    assert np.array_equal(error_colours(np.array([-1.0, 0.0, 1.0, 7.0])), error_colours(np.array([0.0, 0.0, 1.0, 1.0])))
    luminance = to_linear(error_colours(np.linspace(0, 1, 50))) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) < 0).all()
    square = sheet(0.0, 0.0)
    renderer = Renderer(SQUARE, square, (64, 64))
    for value in (0.0, 0.3, 0.5, 0.8, 1.0):
        pixel = to_linear(renderer.draw(square, FRONT_VIEW, np.full(4, value))[32, 32] / 255)
        colour = to_linear(error_colours(np.array(value)))
        assert np.allclose(pixel / pixel.max(), colour / colour.max(), atol=0.02)
    across = renderer.draw(square, FRONT_VIEW, np.array([0.0, 1.0, 1.0, 0.0]))
    row = to_linear(across[32, 20:44] / 255) / to_linear(across[32, 20:44] / 255).max(axis=1, keepdims=True)
    assert (np.diff(row[:, 1]) < 0).any() and row[0, 1] > 0.8 and row[-1, 1] < 0.4


def test_error_map_measures_in_percent_of_the_diagonal() -> None:
    sequence = waving(8, 12)
    moved = np.array(sequence.positions[:])
    moved[5, 17] += [0.03, 0.0, 0.04]
    reference = np.asarray(sequence.positions[:1])[0]
    diagonal = float(np.linalg.norm(np.ptp(reference, axis=0)))
    errors = ErrorMap(sequence, replace(sequence, positions=moved), range(12))
    assert errors.largest == pytest.approx(100 * 0.05 / diagonal, rel=1e-5)
    assert np.flatnonzero(errors.values(5)).tolist() == [17] and errors.values(5)[17] == pytest.approx(1.0)
    assert not errors.values(4).any()
    assert ErrorMap(sequence, replace(sequence, positions=moved), range(12), largest=10.0).values(5)[17] < 1
    assert ErrorMap(sequence, sequence, range(12)).values(0).max() == 0
    legend = errors.legend((256, 200))
    assert len(legend) == 200 and 40 < legend.shape[1] < 128
    bar = legend[:, 14].astype(int)  # one column of the colour bar, top to bottom
    ends = np.rint(255 * error_colours(np.array([1.0, 0.0]))).astype(int)
    assert [np.abs(bar - end).sum(axis=1).min() for end in ends] == [0, 0]
    assert np.abs(bar - ends[0]).sum(axis=1).argmin() < np.abs(bar - ends[1]).sum(axis=1).argmin()


def test_srgb_there_and_back() -> None:
    values = np.linspace(0, 1, 256)
    assert np.allclose(to_srgb(to_linear(values)), values, atol=1e-7)
    codes = srgb_codes()
    assert codes[0] == 0 and codes[-1] == 255 and (np.diff(codes.astype(int)) >= 0).all() and len(codes) == LEVELS
    assert codes[round(0.2140 * (LEVELS - 1))] in (127, 128)


@pytest.mark.parametrize("turntable", [False, True])
def test_a_camera_that_follows_keeps_the_mesh_where_it_is(turntable: bool) -> None:
    """A mesh that only moves along gives the same picture in every frame, larger than in a picture of the whole way."""
    still = waving(10, 6)
    way = np.linspace(0, 40, 6, dtype=np.float32)[:, None, None] * np.float32([1, 0.5, -1])
    walking = replace(still, positions=np.repeat(still.positions[:1], 6, axis=0) + way)
    renderer = gvpipe.Renderer(walking.faces, walking.positions[0], (96, 96))
    camera = framing(walking, turntable=turntable, follow=True)
    assert camera.distance < framing(walking, turntable=turntable).distance / 2
    film = Film(walking, [0, 3, 5], camera, renderer, follow=True)
    first, *others = (film[k].astype(int) for k in range(3))
    assert (first != first[0, 0]).any()
    for picture in others:
        assert np.abs(picture - first).mean() < 0.5  # coordinates round as they grow


def test_turntable_ends_one_step_before_its_start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    azimuths: list[float] = []
    draw = Renderer.draw

    def noted(self: Renderer, positions: Any, camera: Camera, values: Any = None) -> Any:
        azimuths.append(camera.azimuth)
        return draw(self, positions, camera, values)

    monkeypatch.setattr(Renderer, "draw", noted)
    sequence = waving(6, 10)
    gvpipe.render(sequence, tmp_path / "turn.mp4", turntable=True, size=64, view=(10.0, 20.0))
    assert len(azimuths) == 100  # ten times ten frames at 24 fps are the first whole number to last four seconds
    steps = np.diff(azimuths)
    assert azimuths[0] == 10.0 and np.allclose(steps, 3.6)
    assert azimuths[-1] + steps[0] == pytest.approx(azimuths[0] + 360)
    gvpipe.render(sequence, tmp_path / "still.mp4", turntable=True, frame=3, size=64)
    with av.open(str(tmp_path / "still.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == 96


@pytest.mark.parametrize("name", awkward())
def test_awkward_inputs_are_painted_or_refused(name: str, tmp_path: Path) -> None:
    sequence = awkward()[name]
    if not len(sequence.faces):
        with pytest.raises(InputError, match="no triangles"):
            gvpipe.render(sequence, tmp_path / "a.png")
        assert not list(tmp_path.iterdir())
        assert (paint(sequence.read(0, 1)[0], sequence.faces) == 235).all()
        return
    for shading in ("smooth", "flat"):
        gvpipe.render(sequence, tmp_path / "a.png", size=64, shading=shading, frame=-1)
        with Image.open(tmp_path / "a.png") as image:
            picture = np.asarray(image)
        assert picture.shape == (64, 64, 3)
        assert (picture[0] == EMPTY).all() and (picture[:, 0] == EMPTY).all()  # the margin is free
        assert (picture != EMPTY).any() == (name != "all at one point")
    assert paint(sequence.read(0, 1)[0], sequence.faces).shape == (160, 160)


def test_same_input_same_bytes(tmp_path: Path) -> None:
    sequence = waving(12, 6)
    for suffix in (".png", ".gif", ".mp4"):
        for name in ("a", "b"):
            gvpipe.render(sequence, tmp_path / f"{name}{suffix}", size=64)
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    first = sequence.read(0, 1)[0]
    posters = {make_poster(first, sequence.faces, 24.0, 6) for _ in range(3)}
    assert len(posters) == 1 and len(posters.pop()) < 2500


def test_bands_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    sequence = waving(12, 1)
    positions, camera = sequence.read(0, 1)[0], framing(sequence)
    pictures = []
    for threads in (1, 2, 3):
        monkeypatch.setattr("gvpipe.rasterizer.renderer.THREADS", threads)
        pictures.append(Renderer(sequence.faces, positions, (90, 70)).draw(positions, camera))
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def test_a_triangle_behind_the_eye_is_left_out() -> None:
    positions = np.concatenate([sheet(0.0, 0.0), sheet(9.9999, 0.0, half=1e-4), sheet(12.0, 0.0), sheet(5.0, 20.0)])
    faces = np.concatenate([SQUARE + 4 * i for i in range(4)])
    seen = Renderer(faces, positions, (64, 64)).visible(positions, FRONT_VIEW)
    assert set(np.unique(seen)) <= {-1, 0, 1} and (seen >= 0).any()


def test_command_writes_every_kind(run: Run, video: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    ended = run("render", video, tmp_path / "a.png", "--frame", 4, "--size", "80x60", "--view", "front", "--shading", "flat")
    assert ended.status == 0 and "80x60" in ended.out and ended.err == "", ended
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (80, 60)
    assert run("render", video, tmp_path / "a.gif", "--size", 48, "--up", "z").status == 0
    with Image.open(tmp_path / "a.gif") as image:
        assert getattr(image, "n_frames", 0) == len(sequence) and image.size == (48, 48) and image.info["duration"] == 40
    assert run("render", video, tmp_path / "a.mp4", "--size", "64x48", "--view", "20,-10").status == 0
    with av.open(str(tmp_path / "a.mp4")) as film:
        pictures = [picture.to_ndarray(format="rgb24") for picture in film.decode(video=0)]
        assert film.streams.video[0].average_rate == 25
    assert len(pictures) == len(sequence) and pictures[0].shape == (48, 64, 3)
    assert np.abs(pictures[0][0, :8].astype(int) - EMPTY).max() <= 4
    gvpipe.write(sequence, tmp_path / "tube.npz")
    against = ("--error-of", tmp_path / "tube.npz", "--error-max", 2)
    assert run("render", video, tmp_path / "e.png", "--size", 200, *against).status == 0
    with Image.open(tmp_path / "e.png") as image:
        assert image.size == (200, 200)
    assert (
        run("render", tmp_path / "tube.npz", tmp_path / "t.gif", "--size", 32, "--turntable", "--follow", "--frame", 0).status
        == 0
    )
    with Image.open(tmp_path / "t.gif") as image:
        assert getattr(image, "n_frames", 0) == 100


def test_film_shows_what_the_painter_painted(tmp_path: Path) -> None:
    sequence = waving(10, 5)
    gvpipe.render(sequence, tmp_path / "a.mp4", size=(128, 96))
    renderer = Renderer(sequence.faces, sequence.read(0, 1)[0], (128, 96))
    camera = framing(sequence, aspect=128 / 96)
    with av.open(str(tmp_path / "a.mp4")) as film:
        for k, picture in enumerate(film.decode(video=0)):
            painted = renderer.draw(sequence.read(k, k + 1)[0], camera)
            assert np.abs(picture.to_ndarray(format="rgb24").astype(int) - painted).mean() < 3


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("a.jpg", (), ".png, .gif, .mp4"),
        ("a", (), ".png, .gif, .mp4"),
        ("a.png", ("--frame", 11), "frame 11 asked for; there are 11, 0 to 10"),
        ("a.gif", ("--frame", -12), "frame -12 asked for"),
        ("a.png", ("--size", "big"), "such as 512 or 640x480"),
        ("a.png", ("--size", "8"), "16 to 8192"),
        ("a.png", ("--size", "99999x20"), "16 to 8192"),
        ("a.mp4", ("--size", "33"), "even"),
        ("a.png", ("--view", "sideways"), "three-quarter, front"),
        ("a.png", ("--view", "1,nan"), "finite"),
        ("a.png", ("--turntable",), ".gif or .mp4"),
        ("a.png", ("--error-of", "OTHER"), "72"),
        ("a.png", ("--error-of", "tube.mp4", "--error-max", "0"), "above 0"),
        ("a.png", ("--error-of", "tube.mp4", "--size", "64"), "160x120"),
        ("tube.mp4", (), "choose another name"),
        ("missing/a.png", (), "create its folder"),
    ],
)
def test_command_says_what_is_wrong_and_writes_nothing(
    run: Run, video: Path, name: str, options: tuple[object, ...], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = video.parent
    monkeypatch.chdir(folder)
    given = [str(option).replace("OTHER", "other.npz") for option in options]
    if "other.npz" in given:
        gvpipe.write(waving(8, 11), "other.npz")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    ended = run("render", video, name, *given)
    assert ended.status == 1 and ended.out == "" and ended.err.count("\n") == 1 and words in ended.err, ended
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert run("render", video, "a.png", "--shading", "cubist").status == 2


def test_reference_that_does_not_fit_is_named_with_both_numbers(sequence: MeshSequence, tmp_path: Path) -> None:
    for other, words in (
        (waving(8, 11), "has 64 vertices.*has 72"),
        (replace(waving(8, 9), name="short"), "has 9 frames.*has 11"),
    ):
        with pytest.raises(InputError, match=words):
            gvpipe.render(sequence, tmp_path / "a.png", error_of=other)


def test_renderer_and_camera_refuse_what_cannot_be() -> None:
    square = sheet(0.0, 0.0)
    for wrong in ({"size": (0, 64)}, {"shading": "wet"}, {"samples": 0}, {"samples": 9}):
        with pytest.raises(InputError):
            Renderer(SQUARE, square, **wrong)
    for wrong in ({"distance": 0.0}, {"field_of_view": 170.0}, {"up": "w"}, {"azimuth": np.nan}, {"target": (0.0, 1.0)}):
        with pytest.raises(InputError):
            Camera(**wrong)
    with pytest.raises(InputError, match="positions of shape"):
        Renderer(SQUARE, square).draw(square[:3], FRONT_VIEW)
    assert parse_size("64") == (64, 64) and parse_size("64X48") == (64, 48)


def test_disk_errors_leave_nothing(sequence: MeshSequence, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(OutputError):
        gvpipe.render(sequence, tmp_path / "folder.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_poster_is_a_grey_picture_of_the_mesh_that_lasts(sequence: MeshSequence) -> None:
    first = sequence.read(0, 1)[0]
    data = make_poster(first, sequence.faces, 25.0, 11)
    with av.open(io.BytesIO(data)) as film:
        (picture,) = film.decode(video=0)
        assert film.streams.video[0].duration * film.streams.video[0].time_base == pytest.approx(11 / 25)
    luma = picture.to_ndarray()[:160].astype(int)  # the Y plane of yuv420p
    assert np.abs(luma - paint(first, sequence.faces)).mean() < 4
    camera = framing(sequence, [0])
    seen = Renderer(sequence.faces, first, (160, 160), samples=1).visible(first, camera) >= 0
    assert 0.1 < seen.mean() < 0.9
    assert np.abs(luma[~seen] - luma[0, 0]).mean() < 6 and (luma[seen] < luma[0, 0] - 15).mean() > 0.9
