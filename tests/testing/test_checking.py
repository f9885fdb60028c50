"""Codecs that break a promise are told which; one that keeps all passes."""

from __future__ import annotations

import dataclasses
import json
import zlib
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from gvpipe.codec import Bitstream, Encoded, Memo
from gvpipe.coding import registry
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.testing import PROMISES, BrokenPromise, check_codec, new_codec
from gvpipe.testing.template.mycodec import MyCodec, MyReader


@dataclasses.dataclass(frozen=True)
class Shuffling(MyCodec):
    """Turns triangles around, and sees more frames of a part than of all."""

    id: ClassVar[str] = "shuffling"

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        turned = dataclasses.replace(sequence, faces=np.ascontiguousarray(sequence.faces[:, ::-1]))
        return super()._encode(turned, report, memo)

    @classmethod
    def reader(cls, bitstream: Bitstream) -> MyReader:
        return Drifting(bitstream)


class Drifting(MyReader):
    def read(self, start: int, stop: int) -> Float32:
        return super().read(start, stop) + np.float32(1e-4 * (stop - start))


@dataclasses.dataclass(frozen=True)
class Trusting(MyCodec):
    """Takes any value of a setting, and believes its sections."""

    id: ClassVar[str] = "trusting"

    def __post_init__(self) -> None:
        pass

    @classmethod
    def reader(cls, bitstream: Bitstream) -> MyReader:
        zlib.decompress(bitstream.sections["faces"])
        return MyReader(bitstream)


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The template's codec and those above, as if their packages were installed."""
    found = {**registry._entries()}
    home = "gvpipe.testing.template.mycodec:MyCodec"
    found["mycodec"] = EntryPoint("mycodec", home, registry.GROUP)
    classes: dict[str, type[Any]] = {"shuffling": Shuffling, "trusting": Trusting}
    found |= {name: EntryPoint(name, f"{__name__}:{kind.__name__}", registry.GROUP) for name, kind in classes.items()}
    monkeypatch.setattr(registry, "_entries", lambda: found)
    load = EntryPoint.load
    monkeypatch.setattr(EntryPoint, "load", lambda entry: classes.get(entry.name) or load(entry))
    registry.codec_class.cache_clear()
    yield
    registry.codec_class.cache_clear()


def test_the_template_keeps_all_promises() -> None:
    assert check_codec("mycodec") == [promise.name for promise in PROMISES]


def test_each_broken_promise_has_a_line() -> None:
    with pytest.raises(BrokenPromise) as caught:
        check_codec("shuffling", promises=["round trip", "random access", "settings"])
    first, *lines = str(caught.value).splitlines()
    assert first == "codec 'shuffling' breaks 2 of 3 promises:"
    assert "winding, are not those of the source" in lines[0]
    assert "alone" in lines[1]


def test_what_a_codec_trusts() -> None:
    with pytest.raises(BrokenPromise, match=r"settings .* quality=101 is not refused(.|\n)*raised error"):
        check_codec("trusting", promises=["settings", "hostile input"])


def test_wrong_names() -> None:
    with pytest.raises(SettingError, match="did you mean 'stillness'"):
        check_codec("mycodec", promises=["stilness"])
    with pytest.raises(SettingError, match="pip install -e"):
        check_codec(dataclasses.make_dataclass("Absent", [], bases=(MyCodec,), frozen=True, namespace={"id": "absent"})())


def test_a_new_package(tmp_path: Path) -> None:
    files = new_codec("wavelets", tmp_path / "wavelets")
    assert sorted(path.relative_to(tmp_path / "wavelets").as_posix() for path in files) == [
        "README.md",
        "pyproject.toml",
        "test_wavelets.py",
        "wavelets/__init__.py",
    ]
    text = (tmp_path / "wavelets" / "wavelets" / "__init__.py").read_text()
    assert 'id: ClassVar[str] = "wavelets"' in text and "class Wavelets(BaseCodec)" in text
    assert not any("mycodec" in path.read_text().lower() for path in files)
    with pytest.raises(InputError, match="is there already"):
        new_codec("wavelets", tmp_path / "wavelets")


@pytest.mark.parametrize("name", ["My", "a", "two words", "../up", "pca", "json", "class", "gvpipe", "x" * 40])
def test_names_that_a_codec_cannot_have(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="another one|letters and digits"):
        new_codec(name, tmp_path / "a")
    assert not any(tmp_path.iterdir())


def test_the_command(tmp_path: Path, run: Callable[..., Any]) -> None:
    done = run("new-codec", "wavelets", str(tmp_path / "own"), "--json")
    assert done.status == 0
    assert sorted(json.loads(done.out)["files"]) == sorted(map(str, (tmp_path / "own").rglob("*.*")))
    assert "already" in run("new-codec", "wavelets", str(tmp_path / "own")).err
