"""Rows of pictures from folders, patterns, videos and the material files of OBJ frames, and what is said of bad ones."""

from __future__ import annotations

import json
from pathlib import Path

import av
import numpy as np
import pytest
from click.testing import CliRunner
from moving import is_of, pictures, save, sheet
from PIL import Image

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.errors import InputError
from gvpipe.io.picture_files import FilePictures
from gvpipe.io.picture_rows import open_pictures
from gvpipe.media.picture_video import encode_pictures
from gvpipe.model.moving_texture import with_pictures

FRAMES = 6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(pictures(FRAMES), tmp_path_factory.mktemp("rows") / "tex")


@pytest.fixture(scope="module")
def objs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """OBJ frames with a material file and a picture each."""
    path = tmp_path_factory.mktemp("objs")
    gvpipe.write(with_pictures(sheet(FRAMES), pictures(FRAMES), "skin"), path / "f_%02d.obj", 1)
    return path


@pytest.mark.parametrize("named", ["", "p_%03d.png", "p_###.png", "p_*.png"])
def test_folders_and_patterns(folder: Path, named: str) -> None:
    row = open_pictures(folder / named if named else folder, FRAMES)
    assert len(row) == FRAMES and row.size == (48, 32)
    assert all(is_of(row.pixels(frame), frame) for frame in range(FRAMES))
    assert row.file(2) == ("image/png", (folder / "p_002.png").read_bytes())


def test_some_frames_of_a_film(folder: Path) -> None:
    assert is_of(open_pictures(folder, 2, (3, 5)).pixels(0), 3)
    assert len(open_pictures(folder, FRAMES, (3, None))) == FRAMES


def test_obj_frames_have_material_files_of_their_own(objs: Path, tmp_path: Path) -> None:
    assert sorted(path.suffix for path in objs.iterdir()).count(".png") == FRAMES
    sequence = gvpipe.read(objs)
    [image] = sequence.images
    assert image.pictures is not None and sequence.not_carried == ()
    assert all(is_of(image.pictures.pixels(frame), frame) for frame in range(FRAMES))
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca")
    gvpipe.write(gvpipe.decode(tmp_path / "a.mp4"), tmp_path / "back" / "%d.obj")
    again = gvpipe.read(tmp_path / "back")
    assert again.images[0].pictures is not None and is_of(again.images[0].pictures.pixels(5), 5)


def test_one_picture_in_all_frames_stands_still(objs: Path, tmp_path: Path) -> None:
    for path in objs.iterdir():
        name = path.name
        data = (objs / "skin_01.png").read_bytes() if path.suffix == ".png" else path.read_bytes()
        (tmp_path / name).write_bytes(data)
    [image] = gvpipe.read(tmp_path).images
    assert not image.is_moving and image.data == (objs / "skin_01.png").read_bytes()


def test_a_missing_picture_is_named(objs: Path, tmp_path: Path) -> None:
    for path in objs.iterdir():
        if path.name != "skin_04.png":
            (tmp_path / path.name).write_bytes(path.read_bytes())
    sequence = gvpipe.read(tmp_path)
    [note] = [note for note in sequence.notes if "frame 3" in note]
    assert "skin_04.png" in note and sequence.images[0].pictures is not None
    assert is_of(sequence.images[0].pictures.pixels(3), 2)


def test_materials_that_change_otherwise_are_not_carried(objs: Path, tmp_path: Path) -> None:
    for path in objs.iterdir():
        data = path.read_bytes()
        (tmp_path / path.name).write_bytes(data.replace(b"Pr 1.0", b"Pr 0.5") if path.name == "f_03.mtl" else data)
    sequence = gvpipe.read(tmp_path)
    assert not sequence.images[0].is_moving and sequence.not_carried == ("materials and textures of later frames",)


def test_pictures_of_other_sizes(folder: Path, tmp_path: Path) -> None:
    save(pictures(3), tmp_path)
    Image.new("RGB", (20, 20)).save(tmp_path / "p_001.png")
    with pytest.raises(InputError, match=r"p_001.png \(frame 1\) has 20x20 pixels, p_000.png has 48x32"):
        open_pictures(tmp_path, 3)
    (tmp_path / "p_001.png").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"frame 1\) is no picture"):
        open_pictures(tmp_path, 3)
    (tmp_path / "p_001.png").unlink()
    (tmp_path / "p_003.png").write_bytes((folder / "p_003.png").read_bytes())
    with pytest.raises(InputError, match="frame 001 missing between"):
        open_pictures(tmp_path, 3)


def test_another_number_of_pictures(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has 6 pictures, the mesh has 8 frames.*none of frame 6"):
        open_pictures(folder, 8)
    video = tmp_path / "v.mp4"
    video.write_bytes(encode_pictures(pictures(4), (48, 32), 24))
    for n_frames, said in ((6, "fewer"), (3, "more")):
        with pytest.raises(InputError, match=f"has 4 pictures, {said} than the {n_frames} frames"):
            open_pictures(video, n_frames)
    video.write_bytes(video.read_bytes()[:600])
    with pytest.raises(InputError, match="v.mp4 cannot be read as a video"):
        open_pictures(video, 4)
    with pytest.raises(InputError, match="no such file"):
        open_pictures(tmp_path / "none.mp4", 4)


def test_16_bits_and_alpha_become_rgb(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4), 200 << 8, np.uint16)).save(tmp_path / "a.png")
    assert FilePictures([tmp_path / "a.png"]).pixels(0).tolist() == [[[200] * 3] * 4] * 4
    Image.new("RGBA", (4, 4), (9, 8, 7, 0)).save(tmp_path / "b.png")
    row = FilePictures([tmp_path / "b.png"])
    assert row.pixels(0)[0, 0].tolist() == [9, 8, 7]
    report = gvpipe.encode(with_pictures(sheet(1), row, "skin"), tmp_path / "a.mp4", "pca")
    assert any("'skin' moves, and loses its alpha" in note for note in report.notes)


def test_a_video_of_another_program_is_taken_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", 25, options={"x264-params": "keyint=4:bframes=2:open-gop=1:log-level=0"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        for pixels in pictures(FRAMES):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
        container.mux(stream.encode(None))
    given = open_pictures(path, FRAMES)
    gvpipe.encode(sheet(FRAMES), tmp_path / "a.mp4", "pca", texture=path)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        shown = video.images[0].pictures
        assert shown is not None
        for frame in (5, 0, 3):
            assert np.abs(shown.pixels(frame).astype(int) - given.pixels(frame)).max() <= 6, frame
        with av.open(path) as container, av.open(_file(video)) as own:
            before = [bytes(packet) for packet in container.demux(video=0) if packet.size]
            assert sum(map(len, before)) <= sum(packet.size for packet in own.demux(video=0)) + 8 * FRAMES


def test_the_command_line(folder: Path, tmp_path: Path) -> None:
    gvpipe.write(sheet(FRAMES), tmp_path / "in.npz")
    out, film = str(tmp_path / "a.mp4"), str(tmp_path / "t.mp4")
    run = CliRunner().invoke
    done = run(cli, ["encode", str(tmp_path / "in.npz"), out, "--codec", "pca", "--texture", str(folder), "--json"])
    assert done.exit_code == 0, done.output
    done = run(cli, ["decode", out, str(tmp_path / "o.glb"), "--texture-out", film, "--json"])
    values = json.loads(done.stdout)
    assert values["textures"] == [film] and any("no textures that move" in note for note in values["notes"])
    assert is_of(open_pictures(film, FRAMES).pixels(4), 4)
    assert "image tex: 6 pictures, h264, 48x32" in run(cli, ["info", out]).output
    done = run(cli, ["encode", str(tmp_path / "in.npz"), out, "--codec", "pca", "--texture-video", film, "--json"])
    assert done.exit_code == 0, done.output
    done = run(cli, ["convert", str(tmp_path / "in.npz"), str(tmp_path / "c" / "%d.obj"), "--texture", str(folder)])
    assert done.exit_code == 0 and (tmp_path / "c" / "tex_3.png").read_bytes() == (folder / "p_003.png").read_bytes()
    both = ["encode", str(tmp_path / "in.npz"), out, "--texture", str(folder), "--texture-video", film]
    assert run(cli, both).exit_code == 2


def _file(video: gvpipe.Player) -> str:
    path = Path(video.path).with_name("own.mp4")
    path.write_bytes(video.bitstream.companions[0].file())
    return str(path)
