"""Python's side: sequences show and slice themselves, wrong types and names say what is needed."""

from __future__ import annotations

import base64
import copy
import io
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gvpipe
from gvpipe.errors import GvpipeError, InputError, SettingError
from gvpipe.registry import codec_class
from gvpipe.sequence import MeshSequence

untyped: Any = gvpipe  # where calls break the annotations on purpose

Run = Callable[..., Any]


@pytest.fixture(params=["sequence", "lazy", "player", "of player"])
def frames(request: pytest.FixtureRequest, sequence: MeshSequence, video: Path, tmp_path: Path) -> Any:
    """Things that slice by frame."""
    if request.param == "lazy":
        gvpipe.write(sequence, tmp_path / "f" / "%02d.obj")
        return gvpipe.read(tmp_path / "f", 25.0)
    if request.param == "sequence":
        return sequence
    return gvpipe.open(video) if request.param == "player" else gvpipe.open(video).sequence()


# showing


def test_repr(sequence: MeshSequence, video: Path) -> None:
    shape = "11 frames of 72 vertices, 128 triangles, 25 fps"
    assert repr(sequence) == f"<MeshSequence sequence: {shape}>"
    assert repr(gvpipe.open(video)) == f"<Player {video}: codec mcgv, {shape}>"
    far = MeshSequence(np.array([[[5e6, 0, 0], [5e6 + 0.3, 0, 1], [5e6 + 0.1, 1, 0]]]), np.array([[0, 1, 2]]), 30.0, name="far")
    assert repr(far) == "<MeshSequence far: 1 frames of 3 vertices, 1 triangles, 30 fps, origin (5000000, 0, 0)>"


def test_html(sequence: MeshSequence, video: Path, frames: Any) -> None:
    """A picture that shows something, and the numbers."""
    text = frames._repr_html_()
    (data,) = re.findall(r'src="data:image/png;base64,([^"]+)"', text)
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))))
    assert picture.shape == (240, 240, 3)
    drawn = (picture != picture[0, 0]).any(axis=2).mean()
    assert 0.05 < drawn < 0.9
    for words in ("<td", "72", "128", "11 at 25 per second, 0.44 s"):
        assert words in text
    size = f"{video.stat().st_size} bytes"
    assert (size in text and "mcgv version 4" in text) == isinstance(frames, gvpipe.Player)


def test_html_of_what_cannot_be_painted(video: Path) -> None:
    points = MeshSequence(np.zeros((2, 3, 3)), np.zeros((0, 3), np.int32), name="<b>points & co</b>")
    text = points._repr_html_()
    assert "<img" not in text and "&lt;b&gt;points &amp; co&lt;/b&gt;" in text and "<td" in text
    player = gvpipe.open(video)
    video.unlink()
    assert "<img" in player._repr_html_() and "bytes" not in player._repr_html_()


def test_showing_loads_no_renderer(sequence: MeshSequence) -> None:
    import subprocess
    import sys

    program = "import sys, gvpipe.sequence, gvpipe.player; print([m for m in sys.modules if 'rendering' in m or m == 'PIL'])"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "[]\n"


# slicing


def test_slices(frames: Any) -> None:
    whole = frames[:]
    assert whole.shape == frames.shape == (11, 72, 3) and whole.dtype == np.float32
    assert np.array_equal(frames[3], whole[3]) and np.array_equal(frames[-1], whole[10])
    assert np.array_equal(frames[np.int64(4)], whole[4])
    for key in (slice(2, 5), slice(None, None, 3), slice(8, 2, -2), slice(-3, None), slice(5, 5), slice(7, 3), slice(5, 2, 2)):
        assert np.array_equal(frames[key], whole[key]) and frames[key].shape == whole[key].shape
    assert np.array_equal(np.stack(list(frames)), whole)
    for index in (11, -12):
        with pytest.raises(IndexError, match=f"frame {index}"):
            frames[index]
    for wrong in (1.5, "a", None):
        with pytest.raises(TypeError):
            frames[wrong]


def test_sequences_are_values_that_move(sequence: MeshSequence) -> None:
    for same in (copy.copy(sequence), copy.deepcopy(sequence), pickle.loads(pickle.dumps(sequence))):
        assert np.array_equal(same[:], sequence[:]) and same != sequence and len({same, sequence}) == 2


def test_numbers_of_numpy_are_numbers(sequence: MeshSequence, tmp_path: Path) -> None:
    made = untyped.MeshSequence(sequence.positions, sequence.faces, np.float32(24))
    assert gvpipe.encode(made, tmp_path / "o.mp4", preset="ultrafast", clusters=3).fps == 24.0 and type(made.fps) is float


def test_a_list_is_an_array() -> None:
    assert untyped.MeshSequence([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], [[0, 1, 2]]).shape == (1, 3, 3)


# wrong types

TRIANGLE = np.zeros((1, 3, 3), np.float32)
FACES = np.array([[0, 1, 2]])
WRONG_TYPES: dict[str, tuple[Callable[[Path], object], str]] = {
    "encode": (lambda p: untyped.encode(5, p / "o.mp4"), "source is 5 (int); a MeshSequence or a path"),
    "encode path": (lambda p: untyped.encode(p / "a.npz", None), "path is None (NoneType); a path"),
    "encode bytes": (lambda p: untyped.encode(b"a.npz", p / "o.mp4"), "b'a.npz' (bytes)"),
    "encode codec": (lambda p: untyped.encode(p / "a.npz", p / "o.mp4", 7), "codec is 7 (int); an id such as"),
    "encode codec class": (
        lambda p: untyped.encode(p / "a.npz", p / "o.mp4", codec_class("mcgv")), "a settings object",
    ),
    "read": (lambda p: untyped.read(3), "3 (int); a list of frame files or a path"),
    "read list": (lambda p: untyped.read([1, 2]), "gvpipe.read's list is 1 (int); a path"),
    "open": (lambda p: untyped.open(3), "3 (int); a path (str or os.PathLike)"),
    "player": (lambda p: untyped.Player(3), "3 (int); a path"),
    "info": (lambda p: untyped.info(3.5), "3.5 (float); a path"),
    "decode": (lambda p: untyped.decode(None), "None (NoneType); a path"),
    "write": (lambda p: untyped.write("a.npz", p / "b.npz"), "'a.npz' (str); a MeshSequence"),
    "write path": (lambda p: untyped.write(MeshSequence(TRIANGLE, FACES), 3), "path is 3 (int)"),
    "compare": (lambda p: untyped.compare("a", "b"), "reference is 'a' (str); a MeshSequence"),
    "positions": (lambda p: untyped.MeshSequence("x", FACES), "positions are 'x' (str); an array"),
    "no positions": (lambda p: untyped.MeshSequence(None, FACES), "positions are None"),
    "fps": (lambda p: untyped.MeshSequence(TRIANGLE, FACES, "30"), "fps is '30' (str); a number"),
    "attributes": (lambda p: untyped.MeshSequence(TRIANGLE, FACES, 30.0, [1]), "attributes are [1] (list)"),
    "faces": (lambda p: untyped.MeshSequence(TRIANGLE, "x"), "faces are 'x' (str); an array of shape (triangles, 3)"),
    "encode fps": (
        lambda p: untyped.encode(MeshSequence(TRIANGLE, FACES), p / "o.mp4", fps="9"), "fps is '9' (str)",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG_TYPES.values(), ids=WRONG_TYPES.keys())
def test_wrong_types(call: Callable[[Path], object], words: str, tmp_path: Path) -> None:
    with pytest.raises(TypeError) as error:
        call(tmp_path)
    assert words in str(error.value) and "\n" not in str(error.value) and len(str(error.value)) < 160
    assert list(tmp_path.iterdir()) == []


def test_wrong_arrays_stay_input_errors() -> None:
    with pytest.raises(InputError, match="type <U1; numbers are needed"):
        MeshSequence(np.array([[["a", "b", "c"]]]), FACES)
    with pytest.raises(InputError, match="shape"):
        MeshSequence(np.zeros(3), FACES)


# misspelt names

MISSPELT = {
    "setting": ({"qualty": 80}, "no setting 'qualty'", "did you mean 'quality'?"),
    "setting far off": ({"xyzzy": 80}, "no setting 'xyzzy'", None),
    "argument": ({"target_rsme": 1e-4}, "no setting 'target_rsme'", "did you mean 'target_rmse'?"),
    "bound": ({"maxerror": 1e-4}, "no setting 'maxerror'", "did you mean 'max_error'?"),
    "codec": ({"codec": "mgcv"}, "no codec 'mgcv'", "did you mean 'mcgv'?"),
    "case": ({"codec": "PCA"}, "no codec 'PCA'", "did you mean 'pca'?"),
    "choice": ({"prediction": "blendet"}, "prediction is 'blendet'", "did you mean 'blended'?"),
    "choice far off": ({"prediction": 7}, "prediction is 7; one of", None),
    "auto": ({"codec": "auto", "qualty": 80}, "no setting 'qualty'", "did you mean 'quality'?"),
}


@pytest.mark.parametrize(("arguments", "words", "hint"), MISSPELT.values(), ids=MISSPELT.keys())
def test_misspelt(arguments: dict[str, Any], words: str, hint: str | None, sequence: MeshSequence, tmp_path: Path) -> None:
    with pytest.raises(SettingError) as error:
        gvpipe.encode(sequence, tmp_path / "o.mp4", **arguments)
    text = str(error.value)
    assert words in text and (hint or "did you mean") in text if hint else "did you mean" not in text
    assert isinstance(error.value, GvpipeError) and not isinstance(error.value, TypeError)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        (("--set", "qualty=80"), "did you mean 'quality'?"),
        (("--set", "prediction=blendet"), "did you mean 'blended'?"),
        (("--codec", "mgcv"), "did you mean 'mcgv'?"),
        (("--codec", "auto", "--set", "segmnt=9"), "did you mean 'segment'?"),
    ],
)
def test_misspelt_on_the_command_line(options: tuple[str, ...], hint: str, run: Run, samples: Path, tmp_path: Path) -> None:
    ended = run("encode", samples / "creature.npz", tmp_path / "o.mp4", *options)
    assert ended.status == 1 and ended.err.count("\n") == 1 and hint in ended.err


def test_settings_beside_a_settings_object(sequence: MeshSequence, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="quality beside a settings object"):
        gvpipe.encode(sequence, tmp_path / "o.mp4", codec_class("pca")(), quality=80)
