"""Captures: vertices and triangles change, and one file carries all frames."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import moving
import numpy as np
import pytest
from changing import SIZES, SPANS, sheet, write_objs
from file_server import serving
from folders import SAMPLES
from sequences import grid

import gvpipe
from gvpipe.container.mp4 import read_index
from gvpipe.errors import CorruptFile, FormatError, InputError, SettingError, SeveralShots, StrippedFile, TopologyChange
from gvpipe.model.moving_texture import with_pictures
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]


def sheets(textures: bool = False) -> gvpipe.Capture:
    """Six sheets in three shots; with textures, all show one picture."""
    shots = []
    for start, stop in SPANS:
        points = np.stack([sheet(SIZES[frame], frame)[0] for frame in range(start, stop)])
        faces = sheet(SIZES[start], start)[1]
        beside: dict[str, Any] = {}
        if textures:
            picture = np.random.default_rng(0).bytes(4000)
            beside["images"] = (gvpipe.Image("noise", "image/png", b"\x89PNG\r\n\x1a\n" + picture),)
        shots.append(MeshSequence(points, faces, 25.0, **beside))
    return gvpipe.Capture(shots, "sheets")


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("capture") / "sheets.mp4"
    gvpipe.encode(sheets(), path, max_error="0.01%")
    return path


def test_a_row_of_shots() -> None:
    capture = sheets()
    assert (len(capture), capture.starts, capture.lengths, capture.fps) == (6, (0, 3, 5), (3, 2, 1), 25.0)
    assert [capture.locate(k) for k in (0, 2, 3, 5, -1)] == [(0, 0), (0, 2), (1, 0), (2, 0), (2, 0)]
    assert capture.frame(4).n_vertices == 49 and np.allclose(capture.frame(4)[0], sheet(7, 4)[0])
    part = capture.part(2, 4)
    assert part.lengths == (1, 1) and np.allclose(part.shots[1][0], sheet(7, 3)[0])
    assert capture.with_fps(10).shots[2].fps == 10
    with pytest.raises(IndexError, match="frame 6 of sheets: there are 6"):
        capture.locate(6)
    with pytest.raises(InputError, match="frames 4:4 asked for"):
        capture.part(4, 4)
    with pytest.raises(InputError, match="no shots"):
        gvpipe.Capture([])
    with pytest.raises(InputError, match="25 and 30 fps"):
        gvpipe.Capture([capture.shots[0], capture.shots[1].with_fps(30)])
    with pytest.raises(TypeError, match="a MeshSequence is needed"):
        gvpipe.Capture([capture.shots[0], 3])  # type: ignore[list-item]


def test_frames_come_back(video: Path) -> None:
    with gvpipe.open_capture(video) as found:
        assert (len(found), found.lengths, found.starts, found.fps) == (6, (3, 2, 1), (0, 3, 5), 25.0)
        diagonal = np.linalg.norm(np.ptp(sheet(5, 0)[0], axis=0))
        for number, (start, _) in enumerate(SPANS):
            assert found.shots[number].bitstream.layout == "bare"
            for own in range(found.lengths[number]):
                reference = sheets().frame(start + own)
                decoded = found.frame(start + own)
                assert len(decoded.faces) == len(reference.faces)
                assert found[start + own].shape == (reference.n_vertices, 3)
                if found.lengths[number] > 1:  # one frame alone comes in another order
                    assert np.linalg.norm(decoded[0] - reference[0], axis=1).max() <= 1.001e-4 * diagonal
        again = pickle.loads(pickle.dumps(found))
        assert np.array_equal(again[4], found[4])
        assert repr(found) == f"<CapturePlayer {video}: 6 frames in 3 shots, 25 fps>"
        with pytest.raises(IndexError):
            found.shots[3]


def test_one_mesh_is_a_capture_of_one_shot(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    shot = sheets().shots[0]
    report = gvpipe.encode(shot, path, "pca")
    assert not report.shots
    with gvpipe.open_capture(path) as found:
        assert len(found.shots) == 1 and np.array_equal(found[1], gvpipe.open(path)[1])
    whole = gvpipe.encode(gvpipe.Capture([shot]), tmp_path / "b.mp4")
    assert len(whole.shots) == 1 and "capture" not in "".join(whole.notes)


def test_readers_of_sequences_say_what_it_is(video: Path) -> None:
    with pytest.raises(SeveralShots, match=r"sheets.mp4: it is a capture of 3 shots.*open_capture"):
        gvpipe.open(video)
    with pytest.raises(TopologyChange, match="change at frame 3") as caught:
        gvpipe.read(video)
    assert caught.value.frame == 3
    assert gvpipe.read(video, frames=(3, 5)).shape == (2, 49, 3)
    assert [(shot.n_frames, shot.n_vertices) for shot in gvpipe.read_capture(video, frames=(2, 4)).shots] == [(1, 25), (1, 49)]


def test_info_and_report(video: Path, tmp_path: Path) -> None:
    found = gvpipe.info(video)
    assert (found.layout, found.frames, found.vertices, found.fps) == ("shots", 6, 49, 25.0)
    assert [(row["start"], row["frames"], row["vertices"]) for row in found.shots] == [(0, 3, 25), (3, 2, 49), (5, 1, 16)]
    assert sum(found.sections.values()) == found.bytes == video.stat().st_size
    report = gvpipe.encode(sheets(), tmp_path / "a.mp4")
    assert report.shots[1]["bytes"] == gvpipe.info(tmp_path / "a.mp4").shots[1]["bytes"]
    assert sum(report.sections.values()) == report.bytes and report.codec == "pca" and report.frames == 6
    assert any("first at frame 3" in note for note in report.notes)


def test_what_shots_share_is_stored_once(tmp_path: Path) -> None:
    report = gvpipe.encode(sheets(textures=True), tmp_path / "a.mp4")
    assert 4000 < report.bytes < 8000
    with gvpipe.open_capture(tmp_path / "a.mp4") as found:
        assert len({shot.images[0].data for shot in found.shots}) == 1
    index = read_index(tmp_path / "a.mp4")
    assert index is not None and max(length for _, length in index.shared.values()) > 4000


def test_over_http(video: Path) -> None:
    with serving(video.read_bytes()) as (address, _), gvpipe.open_capture(address) as found:
        assert np.array_equal(found[4], gvpipe.open_capture(video)[4])


@pytest.mark.parametrize("cut", [40, 700, -1])
def test_cut_files(video: Path, tmp_path: Path, cut: int) -> None:
    path = tmp_path / "cut.mp4"
    path.write_bytes(video.read_bytes()[:cut])
    with pytest.raises(FormatError, match=r"cut\.mp4"):
        gvpipe.open_capture(path)


def test_damage_is_found(video: Path, tmp_path: Path) -> None:
    data, path = video.read_bytes(), tmp_path / "bad.mp4"
    index = read_index(video)
    assert index is not None
    for at in (len(index.head) - 3, len(index.head) + 60, index.offsets[1] + index.n_bytes[1] // 2, index.offsets[2] + 70):
        path.write_bytes(data[:at] + bytes([data[at] ^ 255]) + data[at + 1 :])
        with pytest.raises(FormatError, match=r"bad\.mp4"):
            found = gvpipe.open_capture(path)
            for frame in range(6):
                found.frame(frame)
    path.write_bytes(data + b"stray")
    with pytest.raises(CorruptFile, match="5 stray bytes"):
        gvpipe.open_capture(path)
    path.write_bytes(data[: index.offsets[0] - 40 - index.poster[1]][: len(index.head)])
    with pytest.raises((StrippedFile, FormatError)):
        gvpipe.open_capture(path)


def test_command_line(run: Run, tmp_path: Path) -> None:
    source = tmp_path / "in"
    source.mkdir()
    write_objs(source)
    ended = run("encode", source, tmp_path / "a.mp4", "--json")
    values = json.loads(ended.out)
    assert ended.status == 0 and [row["start"] for row in values["shots"]] == [0, 3, 5]
    ended = run("decode", tmp_path / "a.mp4", tmp_path / "out" / "%02d.obj", "--frames", "1:6")
    assert ended.status == 0 and sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        f"{k:02d}.obj" for k in range(1, 6)
    ]
    assert gvpipe.read(tmp_path / "out" / "04.obj").n_vertices == 49
    ended = run("decode", tmp_path / "a.mp4", tmp_path / "n.npz", "--json")
    found = json.loads(ended.out)
    assert [Path(name).name for name in found["outputs"]] == ["n-000.npz", "n-001.npz", "n-002.npz"]
    assert found["shots"][1] == {"start": 3, "frames": 2, "vertices": 49, "triangles": 72}
    ended = run("decode", tmp_path / "a.mp4", tmp_path / "one.npz", "--frames", "3:5", "--json")
    assert json.loads(ended.out)["vertices"] == 49 and json.loads(ended.out)["start"] == 3
    assert run("decode", tmp_path / "a.mp4", tmp_path / "b.npz", "--lod", "1").status == 2
    assert "frames 0:7 asked for" in run("decode", tmp_path / "a.mp4", tmp_path / "b.npz", "--frames", "0:7").err
    assert "shot of frames 3:5: 49 vertices, 72 triangles" in run("info", tmp_path / "a.mp4").out
    ended = run("convert", source, tmp_path / "c.pvd")
    assert ended.status == 0 and (tmp_path / "c.pvd").is_file()


def test_pictures(video: Path, tmp_path: Path) -> None:
    """One camera for all shots, as for one mesh that has them all; a colour means the same in all."""
    from PIL import Image

    def painted(frame: int, **options: Any) -> Any:
        gvpipe.render(sheets(), tmp_path / "a.png", frame=frame, size=96, **options)
        return np.asarray(Image.open(tmp_path / "a.png").convert("RGB"), int)

    with gvpipe.open_capture(video) as found:
        gvpipe.render(found.capture(), tmp_path / "b.gif", size=96)
    with Image.open(tmp_path / "b.gif") as film:
        assert getattr(film, "n_frames", 0) == 6
    spans = [np.ptp(np.argwhere(np.ptp(painted(frame, view="top"), axis=2) > 9), axis=0) for frame in (0, 4, 5)]
    assert np.abs(np.diff(spans, axis=0)).max() <= 6  # the same sheet in other triangles, a little nearer each time
    gvpipe.render(video, tmp_path / "c.png", frame=-1, size=64)
    assert (tmp_path / "c.png").is_file()
    with pytest.raises(InputError, match="frame 6 asked for"):
        gvpipe.render(video, tmp_path / "d.png", frame=6)


def test_colours_of_a_field_in_all_shots(tmp_path: Path) -> None:
    shots = [
        shot.reading_from(shot.positions, None, fields={"heat": np.full((len(shot), shot.n_vertices), float(number))})
        for number, shot in enumerate(sheets().shots)
    ]
    from PIL import Image

    pictures = []
    for frame in (0, 3, 5):
        gvpipe.render(gvpipe.Capture(shots), tmp_path / "a.gif", size=160, field="heat", view="front")
        with Image.open(tmp_path / "a.gif") as film:
            film.seek(frame)
            pictures.append(np.asarray(film.convert("RGB"), int))
    colours = [picture[80, 115] for picture in pictures]  # of the sheet's middle
    assert len({tuple(colour) for colour in colours}) == 3


def test_decode_and_restream(video: Path, tmp_path: Path) -> None:
    assert gvpipe.decode(video, 3, 5).shape == (2, 49, 3) and gvpipe.decode(video, 4, 5)[0].shape == (49, 3)
    with pytest.raises(SeveralShots):
        gvpipe.decode(video)
    with pytest.raises(InputError, match="needs no other layout"):
        gvpipe.restream(video, tmp_path / "a.mp4")


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="leave out bare"):
        gvpipe.encode(sheets(), tmp_path / "a.mp4", bare=True)
    with pytest.raises(InputError, match=r"shot 0 \(frames 0 to 2\): "):
        gvpipe.encode(sheets(), tmp_path / "a.mp4", target_bpvf=0.001)
    assert not list(tmp_path.iterdir())


def test_sound_of_the_whole_film(run: Run, video: Path, tmp_path: Path) -> None:
    voice = str(SAMPLES / "voice.wav")
    report = gvpipe.encode(sheets(), tmp_path / "a.mp4", audio=voice, audio_trim=True)
    assert report.audio is not None and report.audio["seconds"] == pytest.approx(6 / 25, abs=0.03)
    found = gvpipe.info(tmp_path / "a.mp4")
    assert found.audio == report.audio and sum(found.sections.values()) == found.bytes
    assert found.sections["sound"] == report.sections["sound"] > 0
    with gvpipe.open_capture(tmp_path / "a.mp4") as opened:
        assert opened.sound is not None and np.array_equal(opened[4], gvpipe.open_capture(video)[4]) is not None
        later = opened.capture().part(3, 5).sound
        assert later is not None and later.seconds == pytest.approx(2 / 25, abs=0.05)
    ended = run("decode", tmp_path / "a.mp4", tmp_path / "out" / "%d.ply", "--json")
    assert ended.status == 0 and Path(json.loads(ended.out)["audio"]["output"]).is_file()
    ended = run("restream", video, tmp_path / "b.mp4", "--audio", voice)
    assert ended.status == 0 and gvpipe.info(tmp_path / "b.mp4").audio is not None
    assert np.array_equal(gvpipe.open_capture(tmp_path / "b.mp4")[4], gvpipe.open_capture(video)[4])
    ended = run("restream", tmp_path / "b.mp4", tmp_path / "c.mp4", "--no-audio")
    assert ended.status == 0 and (tmp_path / "c.mp4").read_bytes() == video.read_bytes()
    data, index = (tmp_path / "a.mp4").read_bytes(), read_index(tmp_path / "a.mp4")
    assert index is not None
    (tmp_path / "d.mp4").write_bytes(data[:-9] + b"silenced!")
    with gvpipe.open_capture(tmp_path / "d.mp4") as opened:  # the mesh stays as it is
        assert opened[4].shape == (49, 3)
    ended = run("decode", tmp_path / "d.mp4", tmp_path / "out" / "%d.ply")
    assert ended.status == 0 and "sound is left out" in ended.err.replace("sound of the file", "sound")


def test_each_frame_keeps_its_picture(tmp_path: Path) -> None:
    """OBJ files with a material file and a picture for each frame, whose mesh changes now and then."""
    shots = [with_pictures(moving.sheet(2), moving.pictures(5)[:2]), with_pictures(moving.sheet(3), moving.pictures(5)[2:])]
    faces = shots[1].faces[:-1]
    parts = (gvpipe.Part("", (0, shots[1].n_vertices), (0, len(faces)), 0),)
    shots[1] = replace(shots[1], faces=faces, parts=parts)
    gvpipe.write(gvpipe.Capture(shots, "sheets"), tmp_path / "in" / "%d.obj")
    gvpipe.encode(tmp_path / "in", tmp_path / "a.mp4")
    with gvpipe.open_capture(tmp_path / "a.mp4") as video:
        assert video.lengths == (2, 3)
        for frame in range(5):
            pictures = video.frame(frame).images[0].pictures
            assert pictures is not None and moving.is_of(pictures.pixels(0), frame)


def test_meshes_of_a_glb_take_turns(run: Run, tmp_path: Path) -> None:
    """All commands see the shots of a .glb whose meshes are shown one after the other."""
    gvpipe.write(sheets(), tmp_path / "a.glb")
    with pytest.raises(TopologyChange, match="meshes take turns, and at frame 3 others are shown"):
        gvpipe.read(tmp_path / "a.glb")
    assert gvpipe.read(tmp_path / "a.glb", frames=(3, 5)).shape == (2, 49, 3)
    report = gvpipe.encode(tmp_path / "a.glb", tmp_path / "a.mp4")
    assert [(row["frames"], row["vertices"]) for row in report.shots] == [(3, 25), (2, 49), (1, 16)]
    assert "3:5" in run("info", tmp_path / "a.glb").out
    assert run("convert", tmp_path / "a.glb", tmp_path / "out" / "%d.obj").status == 0
    assert len(list((tmp_path / "out").iterdir())) == 6


def test_a_surface_is_followed(tmp_path: Path) -> None:
    """A box that grows, with other vertices and triangles in each frame, becomes one shot."""
    boxes = []
    for frame in range(4):
        points, faces = box(6 + frame, 1 + 0.02 * frame)
        boxes.append(MeshSequence(points[None], faces, 25.0))
    capture = gvpipe.Capture(boxes, "box")
    report = gvpipe.encode(capture, tmp_path / "a.mp4")
    assert len(report.shots) == 1 and report.shots[0]["key"] in range(4)
    assert any("4 frames follow 1 key mesh: rms" in note for note in report.notes)
    left = gvpipe.compare(capture, tmp_path / "a.mp4").surface
    assert left is not None and left.max_diag is not None and left.max_diag <= 0.01
    found = gvpipe.open_capture(tmp_path / "a.mp4").capture()
    for frame in range(4):
        reach = np.abs(found.frame(frame)[0]).max(axis=1)
        assert np.abs(reach - (0.5 + 0.01 * frame)).max() < 0.02
    as_it_came = gvpipe.encode(capture, tmp_path / "b.mp4", track=False)
    assert [row["key"] for row in as_it_came.shots] == [None] * 4
    two = gvpipe.Capture(boxes[:2], "box")
    bounded = gvpipe.encode(two, tmp_path / "c.mp4", track=True, max_error="2%")
    errors = gvpipe.compare(two, tmp_path / "c.mp4").surface
    assert errors is not None and errors.max_diag is not None and errors.max_diag <= 0.02 and len(bounded.shots) == 1


def box(n: int, side: float) -> tuple[Any, Any]:
    """A cube whose faces have n x n squares, each of two triangles."""
    points, faces = grid(n + 1)
    flat = (points - points.min(axis=0)) / np.ptp(points, axis=0).max() * side - side / 2
    flat[:, 2] = side / 2
    turns = [np.roll(np.eye(3), k, axis=0) for k in range(3)]
    sides = [flat @ turn * sign for turn in turns for sign in (1, -1)]
    wound = [faces if sign > 0 else faces[:, ::-1] for _ in turns for sign in (1, -1)]
    triangles = [each + k * len(points) for k, each in enumerate(wound)]
    return np.concatenate(sides).astype(np.float32), np.concatenate(triangles).astype(np.int32)


def test_among_many(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "many" / "sheets"
    folder.mkdir(parents=True)
    write_objs(folder)
    ended = run("encode-all", tmp_path / "many", tmp_path / "out", "--json")
    assert ended.status == 0 and json.loads(ended.out)["encoded"] == 1
    ended = run("pack", tmp_path / "out", tmp_path / "s-%05d.tar")
    assert ended.status == 1 and "encode --split makes a file of each shot" in ended.err
