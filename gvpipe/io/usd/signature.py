"""Whether a file begins as USD files do; read before OpenUSD is, and without NumPy."""

from __future__ import annotations

import zipfile
from pathlib import Path

from gvpipe.foundation.errors import InputError

EXTRA = "USD files need the package usd-core; install it by: pip install 'gvpipe[usd]'"
SIGNATURES = {  # first bytes by extension; .usd is text or binary
    ".usda": (b"#usda", b"#sdf"),
    ".usdc": (b"PXR-USDC",),
    ".usd": (b"#usda", b"#sdf", b"PXR-USDC"),
    ".usdz": (b"PK\x03\x04",),
}


def check_signature(path: Path) -> None:
    """Raise `InputError` unless a file begins as its extension says, and a package ends as one."""
    try:
        with open(path, "rb") as file:
            head = file.read(16)
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror}; check the path") from exc
    if not head.startswith(SIGNATURES[path.suffix.lower()]):
        begins = f"it begins with {head[:8]!r}" if head else "it is empty"
        raise InputError(f"{path} is not a {path.suffix.lower()} file ({begins}); export it again")
    if path.suffix.lower() == ".usdz" and not zipfile.is_zipfile(path):
        raise InputError(f"{path} is cut short or damaged; get it again from its source")
