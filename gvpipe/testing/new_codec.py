"""``gvpipe new-codec``: a package with a codec that works and is tried, to be changed into one's own."""

from __future__ import annotations

import keyword
import os
import re
import sys
from pathlib import Path

from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError

TEMPLATE = Path(__file__).parent / "template"
NAME = re.compile(r"[a-z][a-z0-9]{1,30}")
SUFFIXES = (".py", ".toml", ".md")


def new_codec(name: str, folder: str | os.PathLike[str] | None = None) -> list[Path]:
    """Write a package with a codec, its tests and its entry point; return the files.

    Args:
        name: of the package, and the codec's id.
        folder: that is made for it; None: of that name, here.

    Raises:
        InputError: the name is no identifier of small letters and digits, or is taken; the folder is there already.
        OutputError: the folder cannot be written.
    """
    if not NAME.fullmatch(name) or keyword.iskeyword(name):
        raise InputError(f"a codec cannot be called {name!r}; 2 to 31 small letters and digits, a letter first, are needed")
    if name in codec_ids() or name in sys.stdlib_module_names or name in ("gvpipe", "gvcodecs"):
        raise InputError(f"{name!r} is the name of a codec or a module that is installed; choose another one")
    target = Path(folder or name)
    if target.exists():
        raise InputError(f"{target} is there already; give another folder, or move it away")
    class_name = name[0].upper() + name[1:]
    files = sorted(path for path in TEMPLATE.rglob("*") if path.suffix in SUFFIXES and path != TEMPLATE / "__init__.py")
    texts = {
        path.relative_to(TEMPLATE).as_posix().replace("mycodec", name): path.read_text(encoding="utf-8")
        .replace(f"{__package__}.template.mycodec", name)
        .replace("mycodec", name)
        .replace("MyCodec", class_name)
        .replace("MyReader", f"{class_name}Reader")
        for path in files
    }
    with atomic_files(target) as made:
        for path, text in texts.items():
            (made / path).parent.mkdir(parents=True, exist_ok=True)
            (made / path).write_text(text, encoding="utf-8")
    return [target / path for path in texts]
