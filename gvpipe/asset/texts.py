"""Names, units and texts: what a file may hold of them, for all that writes and all that reads.

A text has at most `MAX_TEXT` code units of UTF-16 (as JavaScript counts), and no character that a terminal or a page should not
be sent: control characters, lone surrogates, separators of lines, marks that turn the direction of writing round
(`gvpipe.foundation.text`). Texts of `gvpipe.Metadata` may have several lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.text import MAX_TEXT, cut_text, escaped, text_fault

Value = TypeVar("Value")
Kind = TypeVar("Kind", Part, Material, Texture, Metadata, Image, Attribute, Field)
Numbers = TypeVar("Numbers", Attribute, Field)


class Cleaner:
    """Makes texts such as files may hold; what it changed becomes notes.

    Args:
        where: whose texts they are, for messages.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._n_escaped = self._n_cut = 0

    def text(self, given: str, has_lines: bool = False) -> str:
        """A text with what it may not hold escaped, cut where it is too long."""
        if not text_fault(given, has_lines):
            return given
        shown = escaped(given, has_lines)
        self._n_escaped += shown != given
        result = cut_text(shown)
        self._n_cut += result != shown
        return result

    def by_name(self, given: Mapping[str, Value], what: str) -> dict[str, Value]:
        """Values by name, with clean names; raises `InputError` where two become one."""
        result = {self.text(name): value for name, value in given.items()}
        if len(result) != len(given):
            raise InputError(f"{self._where}: two {what} have one name once control characters are written out; rename one")
        return result

    def part(self, given: Any) -> Any:
        """A part with clean names."""
        if not isinstance(given, Part) or not isinstance(given.name, str) or not isinstance(given.parent, str):
            return given  # which the caller refuses
        return _changed(given, name=self.text(given.name), parent=self.text(given.parent))

    def material(self, given: Any) -> Any:
        """A material with clean names, its own and those of coordinates."""
        if not isinstance(given, Material):
            return given  # which the caller refuses
        textures = {role: _changed(texture, uv=self.text(texture.uv)) for role, texture in given.textures.items()}
        return _changed(given, name=self.text(given.name), **textures)

    def metadata(self, given: Metadata) -> Metadata:
        """Metadata with clean texts."""
        texts = {name: self.text(text, has_lines=True) for name, text in self.by_name(given.texts, "texts").items()}
        return _changed(given, source=self.text(given.source), texts=texts)

    def image(self, given: Image) -> Image:
        """An image with a clean name."""
        return _changed(given, name=self.text(given.name), media_type=self.text(given.media_type))

    def unit(self, given: Numbers) -> Numbers:
        """An attribute or a field with a clean unit."""
        return _changed(given, unit=self.text(given.unit))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was changed, a line each."""
        notes = []
        if self._n_escaped:
            notes.append(f"{self._n_escaped} names or texts held characters that are not shown; they are written out, as \\x1b")
        if self._n_cut:
            notes.append(f"{self._n_cut} names or texts were cut to {MAX_TEXT} characters")
        return tuple(notes)


def _changed(given: Kind, **values: Any) -> Kind:
    """The same object if nothing changes."""
    return given if all(getattr(given, name) == value for name, value in values.items()) else replace(given, **values)
