"""The root element of an XML file, without what XML can do to a reader."""

from __future__ import annotations

from xml.etree import ElementTree


def parse_xml(data: bytes, tag: str) -> ElementTree.Element:
    """Return the root of XML whose root element is ``tag``.

    Raises:
        ValueError: it is empty, no XML, cut short, has another root, or declares entities, which may grow without end.
    """
    if not data.strip():
        raise ValueError("the file is empty")
    if b"<!ENTITY" in data:
        raise ValueError("it declares XML entities, which are not read")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as exc:
        raise ValueError(f"it is not XML, or is cut short ({exc})") from exc
    if root.tag != tag:
        raise ValueError(f"its XML is {root.tag[:40]!r}, not {tag}")
    return root
