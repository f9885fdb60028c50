"""Names and types of vertex attributes in a glTF file, and gvpipe's names for them."""

from __future__ import annotations

import re
from collections.abc import Callable

from gvpipe.foundation.arrays import Array

SET = re.compile(r"(TEXCOORD|COLOR|JOINTS|WEIGHTS)_(\d{1,3})")
VECTORS = ("VEC2", "VEC3", "VEC4")
KINDS = {"POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TANGENT": ("VEC4",), "TEXCOORD": ("VEC2",), "COLOR": ("VEC3", "VEC4")}
ANY = ("SCALAR", *VECTORS)

FLOATS, STORED, MEANT = "floats", "as stored", "fractions as float32, others as stored"

Read = Callable[[str, tuple[str, ...], str], Array]  # name in the file, types, one of the three above -> (V, components)


def is_taken(name: str) -> bool:
    """Whether an attribute of that name is read."""
    return name == "POSITION" or bool(own_name(name)) or SET.fullmatch(name) is not None


def own_name(name: str) -> str:
    """gvpipe's name of a glTF attribute: ``TEXCOORD_1`` is ``uv1``, ``_HEAT`` is ``HEAT``; ``""`` for joints and weights.

    Examples:
        >>> [own_name(name) for name in ("TEXCOORD_0", "COLOR_2", "NORMAL", "_HEAT", "JOINTS_0")]
        ['uv', 'color2', 'normal', 'HEAT', '']
    """
    if name in ("NORMAL", "TANGENT"):
        return name.lower()
    match = SET.fullmatch(name)
    if match:
        base = {"TEXCOORD": "uv", "COLOR": "color"}.get(match[1], "")
        return base and (base if int(match[2]) == 0 else f"{base}{int(match[2])}")
    if not name.startswith("_"):
        return ""
    # a name that means something else without its underscore keeps it
    return name if name[1:].lower().startswith(("uv", "normal", "tangent", "color")) else name[1:]
