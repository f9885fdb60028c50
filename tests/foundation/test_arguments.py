"""Wrong types and misspelt names say what is needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.coding.registry import codec_class
from gvpipe.foundation.errors import GvpipeError, InputError, SettingError
from gvpipe.model.sequence import MeshSequence

untyped: Any = gvpipe  # where calls break the annotations on purpose
Run = Callable[..., Any]
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
    "compare": (lambda p: untyped.compare(1, 2), "reference is 1 (int); a MeshSequence"),
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
