"""Files that a file names beside itself: pieces, steps, arrays. They lie in its folder or below."""

from __future__ import annotations

from pathlib import Path

from gvpipe.io.fetching import fetch, mention


def side_file(path: Path, named: str, what: str, later: bool = False) -> Path:
    """Return the path of a file that ``path`` names.

    Args:
        path: the file that names it.
        named: as it stands there.
        what: what it is, for messages.
        later: whether it is read by itself later, so that one in a store need not be fetched.

    Raises:
        ValueError: it has no name, lies outside the folder, or is missing.
    """
    name = named.strip().replace("\\", "/")
    if not name or "\0" in name:
        raise ValueError(f"a {what} has no file name")
    folder = path.parent.resolve()
    target = (folder / name).resolve()
    if not target.is_relative_to(folder):
        raise ValueError(f"its {what} {named[:100]!r} lies outside the file's folder; move it beside the file")
    (mention if later else fetch)(target)
    if not target.is_file():
        raise ValueError(f"its {what} {named[:100]!r} is missing; put it beside the file")
    return path.parent / name
