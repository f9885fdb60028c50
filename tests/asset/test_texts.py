"""Whatever texts a sequence is given, what is written can be opened, and shown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gvpipe
from gvpipe.asset.texts import Cleaner
from gvpipe.asset_coding.directory import Directory, ListedImage, pack_directory, unpack_directory
from gvpipe.cli.console import Output
from gvpipe.container.json_object import pack_json
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.foundation.text import cut_text, escaped, text_fault
from gvpipe.model.sequence import MeshSequence

STRANGE = (
    "\x1b]0;PWN\x07\x1b[2J",
    "\u202egnp.exe",
    "a\u2066b\u2069",
    "two\nlines",
    "\ud800 alone",
    "line\u2028separator",
    "\x00",
    "\x85",
)
LONG = "x" * 70_000, "\U0001f600" * 40_000
any_text = st.text(st.characters(), max_size=30) | st.sampled_from([*STRANGE, *LONG])


def sequence_of(text: str) -> MeshSequence:
    """A triangle with the same text wherever a sequence has one."""
    return MeshSequence(
        np.zeros((1, 3, 3), np.float32) + np.eye(3, dtype=np.float32),
        np.array([[0, 1, 2]]),
        attributes={text: gvpipe.Attribute(np.arange(3, dtype=np.float32), unit=text), "uv": [[0, 0], [1, 0], [0, 1.0]]},
        fields={text: gvpipe.Field(np.zeros((1, 3), np.float32), unit=text)},
        parts=(gvpipe.Part(text, (0, 3), (0, 1), 0, text),),
        materials=(gvpipe.Material(text),),
        metadata=gvpipe.Metadata(source=text, texts={text: text}),
    )


@given(any_text)
def test_what_is_written_is_opened(text: str) -> None:
    sequence = sequence_of(text)
    directory = Directory(
        parts=tuple(gvpipe.Part(part.name, part.vertices, (0, 0), part.material, part.parent) for part in sequence.parts),
        materials=sequence.materials,
        images=(ListedImage(sequence.parts[0].name, "image/png", "image.0"),),
        metadata=sequence.metadata,
    )
    assert unpack_directory(pack_directory(directory, 3), 3) == directory
    assert bool(sequence.notes) == bool(text_fault(text))


@given(any_text)
def test_clean_texts_have_no_faults(text: str) -> None:
    for has_lines in (False, True):
        clean = Cleaner("here").text(text, has_lines)
        assert not text_fault(clean, has_lines) and Cleaner("here").text(clean, has_lines) == clean
        assert (clean == text) == (not text_fault(text, has_lines))


@pytest.mark.parametrize("text", [*STRANGE, *LONG], ids=lambda text: ascii(text[:12]))
def test_strange_names_through_a_file(text: str, tmp_path: Path) -> None:
    report = gvpipe.encode(sequence_of(text), tmp_path / "a.mp4", codec="pca")
    assert any("written out" in note or "were cut to" in note for note in report.notes)
    video = gvpipe.open(tmp_path / "a.mp4")
    clean = cut_text(escaped(text))
    assert video.parts[0].name == video.parts[0].parent == video.materials[0].name == video.metadata.source == clean
    assert set(video.fields) == {clean} and set(video.attributes) == {clean, "uv"}
    assert video.attributes[clean].unit == video.fields[clean].unit == clean


def test_texts_may_have_lines() -> None:
    texts = sequence_of("a").metadata.texts
    assert Cleaner("here").metadata(gvpipe.Metadata(texts={"a": "one\n\ttwo\r"})).texts == {"a": "one\n\ttwo "} and texts


def test_two_names_that_become_one() -> None:
    uv = np.zeros((3, 1), np.float32)
    with pytest.raises(InputError, match="two attributes have one name"):
        MeshSequence(np.zeros((1, 3, 3)), np.array([[0, 1, 2]]), attributes={"a\x1b": uv, "a\\x1b": uv})


@pytest.mark.parametrize("text", [*STRANGE, *LONG], ids=lambda text: ascii(text[:12]))
@pytest.mark.parametrize("place", ["part", "material", "texture", "metadata", "text", "key"])
def test_files_with_strange_names_are_refused(place: str, text: str) -> None:
    if text == STRANGE[4]:
        pytest.skip("UTF-8 has no lone surrogates")
    if place == "text" and "\n" in text:
        pytest.skip("texts have lines")
    images = [{"name": "a", "media_type": "image/png", "section": "image.0"}]
    places: dict[str, dict[str, Any]] = {
        "part": {"parts": [{"name": text, "vertices": [0, 3], "material": None}]},
        "material": {"materials": [{"name": text}]},
        "texture": {"materials": [{"base_color_texture": {"image": 0, "uv": text}}], "images": images},
        "metadata": {"metadata": {"source": text}},
        "text": {"metadata": {"texts": {"a": text}}},
        "key": {"metadata": {"texts": {text: "a"}}},
    }
    values = places[place]
    plain = {"parts": [], "geometry": False, "attributes": [], "fields": [], "materials": [], "images": [], "metadata": {}}
    with pytest.raises(CorruptFile, match="which is not shown|more than 65535 characters"):
        unpack_directory(pack_json({"version": 1, **plain, **values}), 3)


def test_more_than_a_file_holds_is_not_written() -> None:
    with pytest.raises(InputError, match=r"cannot be written: .*'images' is .*a list of at most"):
        pack_directory(Directory(images=(ListedImage("a", "image/png", "image.0"),) * (1 << 17)), 3)


def test_nothing_strange_reaches_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    for text in STRANGE:
        Output().text(text)
        Output().note(text)
        Output(as_json=True).json({"name": text})
    out, err = capsys.readouterr()
    assert not text_fault((out + err).replace("\n", ""))
