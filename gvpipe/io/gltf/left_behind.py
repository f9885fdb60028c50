"""What of a file does not become part of the sequence, by name: whatever is not known to be taken is met here.

Source: Khronos, glTF 2.0 specification, and its registry of extensions.
"""

from __future__ import annotations

from typing import Any

from gvpipe.io.gltf.attribute_names import is_taken
from gvpipe.io.gltf.document import LOOKS, TAKEN, Document
from gvpipe.io.gltf.json_fields import child, objects
from gvpipe.io.gltf.looks import TAKEN_LOOKS
from gvpipe.io.gltf.pointers import animated_property, pointer_of, shown_pointer
from gvpipe.io.left_behind import LeftBehind

MOST = 1_000_000  # values of the JSON that are looked at
MORPHED = ("POSITION", "NORMAL")  # of morph targets


def left_behind(document: Document) -> tuple[str, ...]:
    """Names of what is not taken."""
    left = LeftBehind()
    if any("camera" in node for node in document.items("nodes")):
        left.add("cameras", len(document.items("cameras")))
    for name, count in _extensions(document.tree).items():
        if name not in TAKEN and name not in TAKEN_LOOKS:
            left.add(f"material extension {name}" if name.startswith(LOOKS) else f"extension {name}", count)
    for mesh in document.items("meshes"):
        for primitive in objects(mesh, "primitives", "a mesh"):
            names = child(primitive, "attributes", "a primitive")
            left.add_all(f"vertex attribute {name}" for name in names if not is_taken(name))
            targets = objects(primitive, "targets", "a primitive")
            left.add_all({f"{name} of morph targets" for target in targets for name in target if name not in MORPHED})
    for animation in document.items("animations"):  # of clips that are not read, too: no other note names what they lose
        for channel in objects(animation, "channels", "an animation"):
            target = child(channel, "target", "a channel")
            if not animated_property(document, target, "a channel"):
                left.add(f"animation of {shown_pointer(pointer_of(target, 'a channel')) or 'nothing that is known'}")
    return left.names


def _extensions(tree: Any) -> dict[str, int]:
    """How often each extension is used, wherever in the file."""
    found: dict[str, int] = {}
    pending, n_met = [tree], 0
    while pending and n_met < MOST:
        value = pending.pop()
        n_met += 1
        if isinstance(value, dict):
            extensions = value.get("extensions")
            for name in extensions if isinstance(extensions, dict) else ():
                found[str(name)] = found.get(str(name), 0) + 1
            pending += [each for each in value.values() if isinstance(each, dict | list)]
        elif isinstance(value, list):
            pending += [each for each in value if isinstance(each, dict | list)]
    return found
