"""What XDMF files refer to inside of themselves: XInclude's xpointer, and elements of ``Reference="XML"``.

Both name an element by a path, of which ElementTree's subset of XPath is read: ``/Xdmf/Domain/Grid[2]/Topology``,
``//Grid[@Name="mesh"]/*[self::Topology or self::Geometry]``. Other files are not opened.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree

XINCLUDE = re.compile(r"\{[^}]*XInclude\}include$")  # of 2001 as in the standard, of 2003 as meshio writes it
POINTER = re.compile(r"^\s*xpointer\((.*)\)\s*$", re.DOTALL)
CHOICE = re.compile(r"/\*(\[[^\[\]]*self::[^\[\]]*\])?$")  # some of the children
STEP = r"""(?:\w+|\*)(?:\[(?:@\w+=(?:"[^"\[\]]*"|'[^'\[\]]*')|\d+)\])*"""
PATH = re.compile(rf"//?{STEP}(?:/{STEP})*")  # the part of XPath that is read
LONGEST = 1000  # characters of a path
MOST = 20  # references from one to the next


class References:
    """Finds what elements of a file refer to.

    Args:
        root: of the file.
    """

    def __init__(self, root: ElementTree.Element) -> None:
        self._root = root
        self._found: dict[str, ElementTree.Element | None] = {}

    def child(self, parent: ElementTree.Element, tag: str) -> ElementTree.Element | None:
        """The child of a tag that has numbers, the parent's own or one that it includes; None if there is none.

        Raises:
            ValueError: references go round in a circle.
        """
        own = parent.find(tag)
        if own is not None and (own := self.target(own)).find("DataItem") is not None:
            return own
        for include in (each for each in parent if XINCLUDE.search(each.tag)):
            pointer = POINTER.match(include.get("xpointer", ""))
            named = self._at(pointer.group(1)) if pointer and not include.get("href") else None
            if named is not None and (found := named if named.tag == tag else named.find(tag)) is not None:
                return self.target(found)
        return None

    def pointers(self, parent: ElementTree.Element) -> list[str]:
        """What an element includes."""
        return [each.get("xpointer", "") for each in parent if XINCLUDE.search(each.tag)]

    def target(self, element: ElementTree.Element) -> ElementTree.Element:
        """The element itself, or the one that it refers to.

        Raises:
            ValueError: there is none, or references go round in a circle.
        """
        for _ in range(MOST):
            if not element.get("Reference"):
                return element
            path = (element.text or "").strip() if element.get("Reference") == "XML" else element.get("Reference", "")
            found = self._at(path)
            if found is None:
                raise ValueError(f"{element.tag} refers to {path[:60]!r}, which is not in the file")
            element = found
        raise ValueError(f"{element.tag} refers to others more than {MOST} times in a row")

    def _at(self, path: str) -> ElementTree.Element | None:
        if path not in self._found:
            self._found[path] = self._search(path.strip())
        return self._found[path]

    def _search(self, path: str) -> ElementTree.Element | None:
        path = CHOICE.sub("", path)
        if len(path) > LONGEST or not PATH.fullmatch(path):
            return None
        if path.startswith("//"):
            inside = f".{path}"
        elif path.startswith(f"/{self._root.tag}/"):
            inside = f".{path.removeprefix(f'/{self._root.tag}')}"
        else:
            return None
        return self._root.find(inside)
