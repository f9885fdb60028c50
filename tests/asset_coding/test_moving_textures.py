"""Moving textures: what goes in comes out, frame by frame, in every layout, and damage costs the texture alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving import colour, is_of, pictures, sheet

import gvpipe
from gvpipe.asset.material import MOVING, Image, Material, Texture
from gvpipe.asset_coding.moving_textures import MovingCoding
from gvpipe.asset_coding.used_texels import used_texels
from gvpipe.container.mp4 import read_bytes
from gvpipe.container.stream_layout import StoredSections
from gvpipe.errors import CorruptFile, InputError, SettingError
from gvpipe.model.moving_texture import with_pictures

FRAMES = 40  # more than a group of pictures
HALF = Texture(0, tiling=(0.5, 1.0))  # the left half of the image


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moving") / "a.mp4"
    gvpipe.encode(with_pictures(sheet(FRAMES), pictures(FRAMES, (47, 32)), "skin"), path, "pca")
    return path


def test_each_frame_has_its_picture_in_any_order(file: Path) -> None:
    with gvpipe.open(file) as video:
        [image] = video.images
        assert image.pictures is not None and image.media_type == MOVING and len(image.pictures) == FRAMES
        for frame in (39, 0, 1, 31, 32, 5, 33):
            pixels = image.pictures.pixels(frame)
            assert pixels.shape == (32, 47, 3) and is_of(pixels, frame), frame
        assert video.materials[0].base_color_texture == Texture(0)
        assert image.frame(3).media_type == "image/png" and image.frame(3).size == (47, 32)
        with pytest.raises(IndexError):
            image.pictures.pixels(FRAMES)


@pytest.mark.parametrize("layout", [{"stream": True}, {"bare": True}])
def test_other_layouts_hold_it(layout: dict[str, bool], tmp_path: Path) -> None:
    gvpipe.encode(with_pictures(sheet(), pictures()), tmp_path / "a.mp4", "pca", **layout)  # type: ignore[arg-type]
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert all(is_of(video.images[0].pictures.pixels(frame), frame) for frame in range(6))  # type: ignore[union-attr]
    gvpipe.restream(tmp_path / "a.mp4", tmp_path / "b.mp4")
    with gvpipe.open(tmp_path / "b.mp4") as video:
        assert is_of(video.images[0].pictures.pixels(4), 4)  # type: ignore[union-attr]


def test_a_jump_fetches_a_group_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    rows = np.kron(rng.integers(0, 256, (FRAMES, 4, 6, 3)).astype(np.uint8), np.ones((1, 8, 8, 1), np.uint8))
    gvpipe.encode(with_pictures(sheet(FRAMES), rows), tmp_path / "a.mp4", "pca", stream=True)
    read: list[int] = []
    own = StoredSections.part

    def noted(self: StoredSections, name: str, start: int, stop: int) -> bytes:
        read.append(stop - start)
        return own(self, name, start, stop)

    monkeypatch.setattr(StoredSections, "part", noted)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        pictures = video.images[0].pictures
        assert pictures is not None and np.abs(pictures.pixels(38).astype(int) - rows[38]).mean() < 12
        assert len(read) == 1 and read[0] < 0.8 * video.bitstream.companions[0].n_bytes
        place = (tmp_path / "a.mp4").read_bytes().find(video.bitstream.companions[0].data())
    data = bytearray((tmp_path / "a.mp4").read_bytes())
    data[place + 50] ^= 0xFF
    damaged = gvpipe.Player("a", data=bytes(data)).images[0].pictures
    assert damaged is not None and np.array_equal(damaged.pixels(38), pictures.pixels(38))
    with pytest.raises(CorruptFile, match="damaged"):
        damaged.pixels(3)


def test_info_lists_it(file: Path) -> None:
    [image] = gvpipe.info(file).to_json()["images"]
    assert image["frames"] == FRAMES and image["size"] == [47, 32] and image["codec"] == "h264"
    assert image["bytes"] == gvpipe.info(file).sections["texture"] > 0


def test_quality_orders_bytes_and_errors() -> None:
    rng = np.random.default_rng(5)
    noise = rng.integers(0, 256, (4, 4, 6, 3)).astype(np.uint8)
    rows = np.stack([np.kron(each, np.ones((12, 12, 1), np.uint8)) for each in noise])
    sequence, sizes, errors = with_pictures(sheet(4), rows), [], []
    for quality in (10, 50, 90):
        data, video = _encoded(sequence, texture_quality=quality)
        sizes.append(len(data))
        shown = np.stack([video.images[0].pictures.pixels(frame) for frame in range(4)])  # type: ignore[union-attr]
        errors.append(float(np.abs(shown.astype(float) - rows).mean()))
    assert sizes == sorted(sizes) and errors == sorted(errors, reverse=True)


def test_a_video_is_copied_with_the_bytes_of_its_pictures(file: Path, tmp_path: Path) -> None:
    with gvpipe.open(file) as video:
        before = video.bitstream.companions[0].data()
        gvpipe.encode(video.sequence(), tmp_path / "b.mp4", "pca")
        gvpipe.encode(video.sequence(), tmp_path / "c.mp4", "pca", texture_quality=20)
    with gvpipe.open(tmp_path / "b.mp4") as copied, gvpipe.open(tmp_path / "c.mp4") as coded:
        assert copied.bitstream.companions[0].data() == before
        assert coded.bitstream.companions[0].data() != before


def test_the_same_input_gives_the_same_bytes() -> None:
    sequence = with_pictures(sheet(), pictures())
    assert _encoded(sequence)[0] == _encoded(sequence)[0]


@pytest.mark.parametrize("codec", ["hevc", "av1"])
def test_other_codecs(codec: str, tmp_path: Path) -> None:
    gvpipe.encode(with_pictures(sheet(), pictures(size=(64, 64))), tmp_path / "a.mp4", "pca", texture_codec=codec)
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert is_of(video.images[0].pictures.pixels(3), 3)  # type: ignore[union-attr]


def test_what_no_triangle_shows_is_filled() -> None:
    rows = np.zeros((3, 32, 64, 3), np.uint8)
    rows[:, :, :32] = colour(2)
    whole = with_pictures(sheet(3), rows)
    half = whole.with_looks((replace(whole.materials[0], base_color_texture=HALF),), whole.images)
    used = used_texels(half, 0, (64, 32))
    assert used[:, :32].all() and not used[:, 32:].any()
    _, video = _encoded(half)
    shown = video.images[0].pictures.pixels(1)  # type: ignore[union-attr]
    assert is_of(shown[:, 30:36], 2)  # no edge beside what is seen


def test_wraps_find_texels_beyond_the_image() -> None:
    sequence = with_pictures(sheet(2), pictures(2, (64, 32)))

    def used(texture: Texture) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        return used_texels(sequence.with_looks((Material(base_color_texture=texture),), sequence.images), 0, (64, 32))

    shifted = replace(HALF, offset=(1.25, 0.0))
    assert used(shifted)[0, [20, 40]].tolist() == [True, True] and not used(shifted)[0, [5, 60]].any()
    assert used(replace(shifted, wrap=("clamp", "clamp")))[0].nonzero()[0].tolist() == [63]
    mirrored = used(replace(shifted, wrap=("mirror", "clamp")))
    assert mirrored[0, [20, 40]].all() and not mirrored[0, [5, 60]].any()
    assert used(replace(HALF, tiling=(50.0, 1.0))).all()


def test_damage_costs_the_texture_alone(file: Path) -> None:
    data = bytearray(file.read_bytes())
    track = read_bytes(bytes(data), "a").companions[0].data()
    data[data.find(track) + len(track) // 2] ^= 0xFF
    video = gvpipe.Player("a", data=bytes(data))
    assert video.images == () and video.materials[0].base_color_texture is None
    assert any("texture" in note for note in video.notes)
    with gvpipe.open(file) as whole:
        assert np.array_equal(video[7], whole[7])
        assert np.array_equal(video.attributes["uv"].values, whole.attributes["uv"].values)


def test_a_track_of_another_size_or_length_is_damaged(file: Path) -> None:
    with gvpipe.open(file) as video:
        [companion] = video.bitstream.companions
        for key, value, said in (("width", 64, "47x32|48x32"), ("image", 9, "")):
            changed = replace(companion, about={**companion.about, key: value})
            wrong = replace(video.bitstream, companions=(changed,))
            from gvpipe.asset_coding.directory import read_directory, read_images

            [image] = read_images(read_directory(wrong), wrong)
            if key == "image":
                assert image is None
                continue
            assert image is not None and image.pictures is not None
            with pytest.raises(CorruptFile, match=said):
                image.pictures.pixels(0)


def test_bad_input_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has 5 pictures, the sequence has 6 frames"):
        with_pictures(sheet(), pictures(5))
    with pytest.raises(InputError, match="no texture coordinates"):
        with_pictures(replace(sheet(), attributes={}), pictures())
    with pytest.raises(InputError, match=r"\(frames, height, width, 3\) uint8"):
        Image("skin", pictures=np.zeros((3, 4, 4)))  # type: ignore[arg-type]
    for codec, quality, said in (("mpeg2", None, "mpeg2"), ("h264", 101, "101"), ("copy", 50, "leave out their quality")):
        with pytest.raises(SettingError, match=said):
            MovingCoding(codec, quality)
    with pytest.raises(SettingError, match="no video"):
        gvpipe.encode(with_pictures(sheet(), pictures()), tmp_path / "a.mp4", "pca", texture_codec="copy")
    assert not (tmp_path / "a.mp4").exists()


def test_smaller_pictures() -> None:
    _, video = _encoded(with_pictures(sheet(), pictures()), textures=24)
    assert video.images[0].size == (24, 16) and is_of(video.images[0].pictures.pixels(2), 2)  # type: ignore[union-attr]


def test_frames_of_a_film_keep_their_pictures(file: Path) -> None:
    part = gvpipe.decode(file, 33, 36)
    assert part.images[0].pictures is not None and len(part.images[0].pictures) == 3
    assert is_of(part.images[0].pictures.pixels(1), 34)


def test_renders_draw_each_frame_with_its_picture(file: Path, tmp_path: Path) -> None:
    from PIL import Image as Pillow

    gvpipe.render(file, tmp_path / "a.png", frame=9, size=(64, 64), view="front")
    before = np.asarray(Pillow.open(tmp_path / "a.png"))[32, 32].astype(int)
    gvpipe.render(file, tmp_path / "b.png", frame=2, size=(64, 64), view="front")
    after = np.asarray(Pillow.open(tmp_path / "b.png"))[32, 32].astype(int)
    assert before[0] > after[0] + 40 and before[1] < after[1] - 40  # redder, less green


def _encoded(sequence: gvpipe.MeshSequence, **options: object) -> tuple[bytes, gvpipe.Player]:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mp4"
        gvpipe.encode(sequence, path, "pca", **options)  # type: ignore[arg-type]
        data = path.read_bytes()
    return data, gvpipe.Player("a", data=data)
