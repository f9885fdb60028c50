"""Names of prims: USD allows letters, digits and underscores; any other name is kept as the prim's display name."""

from __future__ import annotations

from typing import Any

ADDED = "gvpipe:added"  # custom data of a root that was added because a stage needs one


def identifier(name: str) -> str:
    """The name of a prim for any name."""
    from pxr import Tf

    if not name:
        return "mesh"
    return str(Tf.MakeValidIdentifier(f"_{name}" if name[0].isdigit() else name))


def name_prim(prim: Any, name: str) -> None:
    """Keep a name that a prim cannot have."""
    if name and prim.GetName() != name:
        prim.SetDisplayName(name)


def name_of(prim: Any) -> str:
    """The name of a prim, or its display name where that is what the prim's name was made of."""
    shown = str(prim.GetDisplayName())
    made = identifier(shown) if shown else ""
    return shown if made and prim.GetName().startswith(made) else str(prim.GetName())


def parent_path(prim: Any) -> str:
    """The names of the nodes above a prim, with ``/`` between; without a root that was added."""
    names: list[str] = []
    above = prim.GetParent()
    while above and not above.IsPseudoRoot():
        if not above.GetCustomDataByKey(ADDED):
            names.append(name_of(above))
        above = above.GetParent()
    return "/".join(reversed(names))
