"""Films and pictures as files: what they show, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from looks import UV, sheets
from PIL import Image
from sequences import awkward, waving
from shapes import EMPTY

import gvpipe
from gvpipe.asset.material import Image as AssetImage
from gvpipe.asset.material import Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Camera, framing
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.films import Film
from gvpipe.rendering.poster import make_poster, paint

Run = Callable[..., Any]


@pytest.mark.parametrize("turntable", [False, True])
def test_a_camera_that_follows_keeps_the_mesh_where_it_is(turntable: bool) -> None:
    """A mesh that only moves along gives the same picture in every frame, larger than in a picture of the whole way."""
    still = waving(10, 6)
    way = np.linspace(0, 40, 6, dtype=np.float32)[:, None, None] * np.array([1, 0.5, -1], np.float32)
    walking = replace(still, positions=np.repeat(still.positions[:1], 6, axis=0) + way)
    renderer = gvpipe.Renderer(walking.faces, walking.positions[:][0], (96, 96))
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

    def noted(self: Renderer, positions: Any, camera: Camera, values: Any = None, frame: int = 0) -> Any:
        azimuths.append(camera.azimuth)
        return draw(self, positions, camera, values, frame)

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
    assert paint(sequence.read(0, 1)[0], sequence.faces).shape == (96, 96)


def test_same_input_same_bytes(tmp_path: Path) -> None:
    sequence = waving(12, 6)
    for suffix in (".png", ".gif"):  # x264's decisions on films differ now and then
        for name in ("a", "b"):
            gvpipe.render(sequence, tmp_path / f"{name}{suffix}", size=64)
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    first = sequence.read(0, 1)[0]
    posters = {make_poster(first, sequence.faces, 24.0, 6) for _ in range(3)}
    assert len(posters) == 1 and len(posters.pop()) < 2500


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


def test_materials_show_by_default_and_images_left_out_are_named(tmp_path: Path) -> None:
    material = Material(double_sided=True, unlit=True, base_color=(0.0, 1.0, 0.0, 1.0), base_color_texture=Texture(0))
    lost = AssetImage("sky", "image/ktx2", b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80))
    sequence = sheets([0.0], [material], attributes={"uv": UV}, images=(lost,), metadata=Metadata(up_axis="z"))
    notes = gvpipe.render(sequence, tmp_path / "a.png", size=64, view="front")
    assert notes == ["image 'sky' (image/ktx2) cannot be decoded; its materials are drawn without it"]
    with Image.open(tmp_path / "a.png") as image:
        picture = np.asarray(image)
    assert (picture[32, 32] == EMPTY).all()  # the axis that is up is z, so from the front the sheet is a line
    assert gvpipe.render(sequence, tmp_path / "b.png", size=64, view="front", up="y", plain=True) == []
    with Image.open(tmp_path / "b.png") as image:
        plain = np.asarray(image)
    gvpipe.render(sequence, tmp_path / "c.gif", size=64, view="front", up="y")
    with Image.open(tmp_path / "c.gif") as image:
        shown = np.asarray(image.convert("RGB"))
    assert shown[32, 32].tolist() == [0, 255, 0] and plain[32, 32].tolist() != shown[32, 32].tolist()
    bare = MeshSequence(sequence.positions, sequence.faces)
    gvpipe.render(bare, tmp_path / "d.png", size=64, view="front")
    assert (tmp_path / "d.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_disk_errors_leave_nothing(sequence: MeshSequence, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(OutputError):
        gvpipe.render(sequence, tmp_path / "folder.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


@pytest.mark.parametrize("size", [(0, 0), (10, 0), (16, 9000)])
def test_a_size_that_no_picture_has_is_refused(size: tuple[int, int], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sides of 16 to 8192 pixels can be"):
        gvpipe.render(waving(4, 2), tmp_path / "a.png", size=size)
    assert not list(tmp_path.iterdir())
