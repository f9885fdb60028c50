"""Properties of a file that its animations name by a pointer into its JSON: which of them move or hide meshes.

Source: Khronos, KHR_animation_pointer; KHR_node_visibility.
"""

from __future__ import annotations

import re

from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.json_fields import Json, child, extension, text

EXTENSION = "KHR_animation_pointer"
VISIBILITY = "KHR_node_visibility"
NODE = re.compile(r"/nodes/(0|[1-9]\d{0,8})/(translation|rotation|scale|weights)")
VISIBLE = re.compile(rf"/nodes/(0|[1-9]\d{{0,8}})/extensions/{VISIBILITY}/visible")
MESH = re.compile(r"/meshes/(0|[1-9]\d{0,8})/weights")
NUMBER = re.compile(r"/\d+")


def animated_property(document: Document, target: Json, where: str) -> list[tuple[int, str]]:
    """The nodes and properties that a channel moves: ``translation``, ``visible`` and others; none if it moves no mesh."""
    path = text(target, "path")
    if path != "pointer":
        node = target.get("node")
        return [(node, path)] if isinstance(node, int) and not isinstance(node, bool) else []
    pointer = pointer_of(target, where)
    if found := NODE.fullmatch(pointer):
        return [(int(found[1]), found[2])]
    if found := VISIBLE.fullmatch(pointer):
        return [(int(found[1]), "visible")]
    if found := MESH.fullmatch(pointer):
        nodes = enumerate(document.items("nodes"))
        return [(number, "weights") for number, node in nodes if node.get("mesh") == int(found[1]) and "weights" not in node]
    return []


def pointer_of(target: Json, where: str) -> str:
    """The pointer of a target, empty if it has none."""
    return text(extension(target, EXTENSION, where), "pointer")


def shown_pointer(pointer: str) -> str:
    """A pointer for people: which of several things it means does not matter.

    Examples:
        >>> shown_pointer("/materials/12/emissiveFactor")
        '/materials/*/emissiveFactor'
    """
    return NUMBER.sub("/*", pointer)


def is_visible(node: Json, where: str) -> bool:
    """Whether a node is visible at rest, and with it what hangs on it."""
    if VISIBILITY not in child(node, "extensions", where):
        return True
    return extension(node, VISIBILITY, where).get("visible", True) is not False
