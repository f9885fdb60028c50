"""Recordings hold what was added, whatever its arrays are, and leave nothing half written."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError, OutputError, SettingError
from gvpipe.recording.arrays import as_array

N_FRAMES = 33
FRAMES = waving(8, N_FRAMES)


class Tensor:
    """Numbers behind the methods by which tensors on a GPU, with gradients, lead to numpy."""

    def __init__(self, values: Any, steps: tuple[str, ...] = ("detach", "cpu")) -> None:
        self._values, self._steps = values, steps

    def __array__(self, *_: object, **__: object) -> Any:
        raise TypeError("can't convert device tensor that requires grad to numpy")

    def detach(self) -> Tensor:
        return Tensor(self._values, self._steps[1:])

    def cpu(self) -> Tensor:
        assert self._steps == ("cpu",)
        return Tensor(self._values, ())

    def numpy(self) -> Any:
        assert self._steps == ()
        return self._values


class OnGpu:
    """What CuPy's arrays are."""

    def __init__(self, values: Any) -> None:
        self._values = values

    def get(self) -> Any:
        return self._values


def _record(path: Path, **options: Any) -> None:
    height = FRAMES[:][:, :, 2]
    with gvpipe.record(path, FRAMES.faces, fps=24, segment=10, **options) as film:
        for frame, values in zip(FRAMES, height, strict=True):
            film.add(frame, height=values, label=np.arange(len(FRAMES.faces)) % 5, way=frame)


def test_a_recording_is_a_geometry_video_of_all_frames_and_fields(tmp_path: Path) -> None:
    _record(tmp_path / "run.mp4")
    assert [each.name for each in tmp_path.iterdir()] == ["run.mp4"]
    with gvpipe.open(tmp_path / "run.mp4") as video:
        assert (video.fps, len(video), video.bitstream.layout) == (24, N_FRAMES, "stream")
        assert gvpipe.compare(FRAMES, video).rmse_diag == pytest.approx(0.0, abs=1e-3)
        height = FRAMES[:][:, :, 2]
        assert np.abs(video.fields["height"][:] - height).max() <= 1.001e-3 * np.ptp(height)
        assert video.fields["way"].shape == (N_FRAMES, FRAMES.n_vertices, 3)
        labels = video.fields["label"] if "label" in video.fields else video.attributes["label"]
        assert labels.domain == "triangle"
    bounded = {"fields": {"height": 0.5}}
    _record(tmp_path / "coarse.mp4", **bounded)
    assert (tmp_path / "coarse.mp4").stat().st_size < (tmp_path / "run.mp4").stat().st_size


def test_it_takes_the_place_of_an_older_file_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "run.mp4"
    path.write_bytes(b"older")
    (tmp_path / "run.growing.mp4").write_bytes(b"of a run that was killed")
    with gvpipe.record(path, FRAMES.faces, segment=10) as film:
        for frame in FRAMES:
            film.add(frame)
        assert film.n_frames == N_FRAMES and film.growing.name == "run.growing-2.mp4"
        assert len(gvpipe.open(film.growing)) == 30 and path.read_bytes() == b"older"
    assert len(gvpipe.open(path)) == N_FRAMES and not film.growing.exists()
    film.close()
    with pytest.raises(InputError, match="is finished; start another recording"):
        film.add(FRAMES[0])


def test_what_a_loop_recorded_before_it_failed_is_kept(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), gvpipe.record(tmp_path / "run.mp4", FRAMES.faces) as film:
        for frame in FRAMES[:3]:
            film.add(frame)
        _ = 1 / 0
    assert len(gvpipe.open(tmp_path / "run.mp4")) == 3
    with gvpipe.record(tmp_path / "none.mp4", FRAMES.faces):
        pass
    assert [each.name for each in tmp_path.iterdir()] == ["run.mp4"]


def test_a_page(tmp_path: Path) -> None:
    _record(tmp_path / "run.html", page={"field": "height", "colormap": "magma", "up": "z"})
    text = (tmp_path / "run.html").read_text("utf-8")
    assert 'field="height" colormap="magma"' in text and 'up="z"' in text
    assert [each.name for each in tmp_path.iterdir()] == ["run.html"]


def test_what_lies_beside_positions(tmp_path: Path) -> None:
    uv = np.random.default_rng(1).random((FRAMES.n_vertices, 2)).astype(np.float32)
    parts = (gvpipe.Part("sheet", (0, FRAMES.n_vertices), (0, len(FRAMES.faces)), material=0),)
    beside: dict[str, Any] = {"attributes": {"uv": uv}, "parts": parts, "materials": (gvpipe.Material("cloth"),)}
    _record(tmp_path / "run.mp4", metadata=gvpipe.Metadata(up_axis="z", metres_per_unit=0.01), **beside)
    with gvpipe.open(tmp_path / "run.mp4") as video:
        assert np.abs(video.attributes["uv"].values - uv).max() < 1e-3
        assert [part.name for part in video.parts] == ["sheet"] and video.materials[0].name == "cloth"
        assert (video.metadata.up_axis, video.metadata.metres_per_unit) == ("z", 0.01)


@pytest.mark.parametrize("wrapped", [Tensor, OnGpu, list], ids=str)
def test_arrays_of_other_libraries(wrapped: Any, tmp_path: Path) -> None:
    for name, wrap in (("plain", np.asarray), ("wrapped", wrapped)):
        with gvpipe.record(tmp_path / f"{name}.mp4", FRAMES.faces) as film:
            for frame in FRAMES[:4]:
                film.add(wrap(frame), size=wrap(np.linalg.norm(frame, axis=1)))
    assert (tmp_path / "plain.mp4").read_bytes() == (tmp_path / "wrapped.mp4").read_bytes()


def test_arrays_that_are_none() -> None:
    with pytest.raises(InputError, match="stress has type <U1; an array of numbers is needed"):
        as_array(["a"], "stress")
    with pytest.raises(InputError, match="stress cannot be made an array"):
        as_array([[1], [1, 2]], "stress")


def test_holes_are_kept(tmp_path: Path) -> None:
    values = np.arange(FRAMES.n_vertices, dtype=np.float64) / 7
    holed = values.copy()
    holed[5] = np.nan
    with gvpipe.record(tmp_path / "run.mp4", FRAMES.faces) as film:
        film.add(FRAMES[0], stress=values)
        film.add(FRAMES[1], stress=holed)
    with gvpipe.open(tmp_path / "run.mp4") as video:
        assert np.array_equal(np.isnan(video.fields["stress"][:]), np.isnan([values, holed]))


@pytest.mark.parametrize(
    ("positions", "fields", "message"),
    [
        (
            FRAMES[0][:5],
            {"size": 0},
            r"frame 1 has shape (5, 3), frame 0 has (64, 3); the mesh must not change: go on in another file",
        ),
        (FRAMES[0] + np.nan, {"size": 0}, "vertex 0 is [nan, nan, nan]"),
        (FRAMES[0], {}, "frame 1 has no fields; frame 0 has size, and all must have the same"),
        (FRAMES[0], {"size": 0, "other": 0}, "frame 1 has other, size; frame 0 has size"),
        (FRAMES[0], {"size": np.inf}, "field 'size' is inf in frame 1, row 0; a number that float32 holds is needed"),
        (FRAMES[0], {"size": np.zeros((64, 2))}, "field 'size' has shape (64, 2) in frame 1, and had (64,)"),
    ],
)
def test_a_frame_that_does_not_fit_is_not_taken(positions: Any, fields: Any, message: str, tmp_path: Path) -> None:
    n_vertices = FRAMES.n_vertices
    given = {name: np.full(n_vertices, value, float) if np.ndim(value) == 0 else value for name, value in fields.items()}
    with gvpipe.record(tmp_path / "run.mp4", FRAMES.faces) as film:
        film.add(FRAMES[0], size=np.arange(n_vertices) + 0.5)
        with pytest.raises(InputError) as error:
            film.add(positions, **given)
        film.add(FRAMES[2], size=np.arange(n_vertices) - 0.5)
    assert message in str(error.value)
    with gvpipe.open(tmp_path / "run.mp4") as video:
        assert len(video) == 2 and np.allclose(video[1], FRAMES[2], atol=0.05)
        assert np.allclose(video.fields["size"][1], np.arange(n_vertices) - 0.5, atol=0.1)


def test_frame_0_says_what_does_not_fit(tmp_path: Path) -> None:
    film = gvpipe.record(tmp_path / "run.mp4", FRAMES.faces, fields={"strain": "exact"})
    with pytest.raises(InputError, match="fields has a bound of 'strain', which frame 0 has not; it has size"):
        film.add(FRAMES[0], size=np.zeros(FRAMES.n_vertices))
    with pytest.raises(InputError, match="64 rows, one per vertex or 98 rows, one per triangle, are needed"):
        film.add(FRAMES[0], strain=np.zeros(7))
    film.add(FRAMES[0], strain=np.zeros(FRAMES.n_vertices))
    film.close()
    assert len(gvpipe.open(tmp_path / "run.mp4")) == 1


def test_targets_and_settings_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="end its name in .mp4 or .html"):
        gvpipe.record(tmp_path / "run.gif", FRAMES.faces)
    with pytest.raises(InputError, match="is no page, and page says how one opens"):
        gvpipe.record(tmp_path / "run.mp4", FRAMES.faces, page={"up": "z"})
    with pytest.raises(OutputError, match="create it first"):
        gvpipe.record(tmp_path / "none" / "run.mp4", FRAMES.faces)
    with pytest.raises(SettingError, match="keeps the order of vertices"):
        gvpipe.record(tmp_path / "run.mp4", FRAMES.faces, reorder=True)
    with pytest.raises(SettingError, match="qualty"):
        gvpipe.record(tmp_path / "run.mp4", FRAMES.faces, qualty=3)
    assert list(tmp_path.iterdir()) == []


def test_rigid_parts_move_by_their_transforms(tmp_path: Path) -> None:
    trimesh: Any = pytest.importorskip("trimesh")
    robot = gvpipe.RigidParts({"base": trimesh.creation.box(), "arm": trimesh.creation.cylinder(0.1, 2, sections=12)})
    with gvpipe.record(tmp_path / "robot.mp4", robot.faces, parts=robot.parts) as film:
        for angle in np.linspace(0, 1, 5):
            film.add(robot.positions({"arm": trimesh.transformations.rotation_matrix(angle, [1, 0, 0])}))
    with gvpipe.open(tmp_path / "robot.mp4") as video:
        assert [part.name for part in video.parts] == ["base", "arm"]
        base, arm = (slice(*part.vertices) for part in video.parts)
        moved = np.linalg.norm(video[4] - video[0], axis=1)
        assert moved[base].max() < 0.02 and moved[arm].max() == pytest.approx(2 * np.sin(0.5), abs=0.05)


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ({}, "there are no bodies"),
        ({"a": ([[0, 0]], [[0, 0, 0]])}, "body 'a' has shapes (1, 2) and (1, 3)"),
        ({"a": ([[0, 0, 0]], [[0, 0, 1]])}, "body 'a' has a triangle with a vertex outside of 0..0"),
    ],
)
def test_bodies_that_are_none(bodies: Any, message: str) -> None:
    with pytest.raises(InputError) as error:
        gvpipe.RigidParts(bodies)
    assert message in str(error.value)


def test_transforms_that_are_none() -> None:
    body = gvpipe.RigidParts({"a": ([[0, 0, 0]], [[0, 0, 0]])})
    with pytest.raises(InputError, match="there is no body 'b'; there are 'a'"):
        body.positions({"b": np.eye(4)})
    with pytest.raises(InputError, match=r"has shape \(3, 3\); \(4, 4\) is needed"):
        body.positions({"a": np.eye(3)})


@pytest.fixture
def _garbage_as_usual() -> Iterator[None]:
    """Python searches for garbage as often as outside of the tests."""
    before = gc.get_threshold()
    gc.set_threshold(700, 10, 10)
    yield
    gc.set_threshold(*before)


@pytest.mark.usefixtures("_garbage_as_usual")
def test_memory_does_not_grow_with_frames(tmp_path: Path) -> None:
    """Of many frames with a field no more is held than of one clip, until the file is made whole."""
    import tracemalloc

    sheet = waving(12, 10)
    bytes_frame = sheet[0].nbytes
    peaks = []
    for count in (10, 60):
        film = gvpipe.record(tmp_path / "run.mp4", sheet.faces, segment=5)
        tracemalloc.start()
        for k in range(count):
            film.add(sheet[k % 10], size=sheet[k % 10][:, 2])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        film.close()
    assert peaks[1] < peaks[0] + 10 * bytes_frame
