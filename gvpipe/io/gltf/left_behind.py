"""What of a file does not become part of the sequence, by name: whatever is not known to be taken is met here.

Source: Khronos, glTF 2.0 specification, and its registry of extensions.
"""

from __future__ import annotations

from typing import Any

from gvpipe.io.gltf.attribute_names import is_taken
from gvpipe.io.gltf.clips import FPS, moving_nodes
from gvpipe.io.gltf.document import LOOKS, TAKEN, Document
from gvpipe.io.gltf.geometry import TRIANGLES, is_matrix
from gvpipe.io.gltf.instances import DEFAULTS, EXTENSION
from gvpipe.io.gltf.json_fields import Json, child, extension, integer, objects
from gvpipe.io.gltf.looks import TAKEN_LOOKS
from gvpipe.io.gltf.pointers import animated_property, pointer_of, shown_pointer
from gvpipe.io.left_behind import LeftBehind

MOST = 1_000_000  # values of the JSON that are looked at
MORPHED = ("POSITION", "NORMAL")  # of morph targets


def left_behind(document: Document, in_scene: set[int]) -> tuple[str, ...]:
    """Names of what is not taken; ``in_scene`` are the nodes of the scene that is read."""
    left = LeftBehind()
    left.add("other scenes", len(document.items("scenes")) - 1)
    for number, node in enumerate(document.items("nodes")):
        left.add("meshes outside of the scene", "mesh" in node and number not in in_scene)
        given = child(extension(node, EXTENSION, "a node"), "attributes", "a node")
        left.add_all(f"attribute {name} of instances" for name in given if name not in DEFAULTS)
    if any("camera" in node for node in document.items("nodes")):
        left.add("cameras", len(document.items("cameras")))
    met, extras = _met(document.tree)
    for key, count in extras.items():
        left.add(f"extras {key!r}" if key else "extras", count)
    for name, count in met.items():
        if name not in TAKEN and name not in TAKEN_LOOKS:
            left.add(f"material extension {name}" if name.startswith(LOOKS) else f"extension {name}", count)
    for mesh in document.items("meshes"):
        for primitive in objects(mesh, "primitives", "a mesh"):
            left.add("points and lines", integer(primitive, "mode", "a primitive", TRIANGLES) < TRIANGLES)
            names = child(primitive, "attributes", "a primitive")
            lost = [name for name, number in names.items() if not is_taken(name) or is_matrix(document, number)]
            left.add_all(f"vertex attribute {name}" for name in lost)
            targets = objects(primitive, "targets", "a primitive")
            left.add_all({f"{name} of morph targets" for target in targets for name in target if name not in MORPHED})
    moving = moving_nodes(document)
    for animation in document.items("animations"):  # of clips that are not read, too: no other note names what they lose
        for channel in objects(animation, "channels", "an animation"):
            target = child(channel, "target", "a channel")
            moved = animated_property(document, target, "a channel")
            if not moved:
                left.add(f"animation of {shown_pointer(pointer_of(target, 'a channel')) or 'nothing that is known'}")
            elif not any(node in moving for node, _ in moved):
                left.add("animation of nodes without a mesh")
    return left.names


def _met(tree: Json) -> tuple[dict[str, int], dict[str, int]]:
    """How often each extension is used, wherever in the file, and each key of extras.

    What the file itself has of an extension, such as a list of lights, counts where nothing else has it.
    """
    found: dict[str, int] = {}
    extras: dict[str, int] = {}
    pending: list[Any] = [{**tree, "extensions": {}}]
    n_met = 0
    while pending and n_met < MOST:
        value = pending.pop()
        n_met += 1
        if isinstance(value, dict):
            given = value.get("extras")
            for key in given if isinstance(given, dict) else ("",) if given else ():
                extras[str(key)] = extras.get(str(key), 0) + (key != FPS)
            extensions = value.get("extensions")
            for name in extensions if isinstance(extensions, dict) else ():
                found[str(name)] = found.get(str(name), 0) + 1
            pending += [each for each in value.values() if isinstance(each, dict | list)]
        elif isinstance(value, list):
            pending += [each for each in value if isinstance(each, dict | list)]
    own = tree.get("extensions")
    found |= {str(name): 1 for name in (own if isinstance(own, dict) else ()) if name not in found}
    return found, extras
