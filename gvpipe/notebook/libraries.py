"""Whether widgets can be shown: anywidget is there, and a notebook's kernel runs this code."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from gvpipe.foundation.errors import InputError

REMEDY = "interactive players need anywidget: pip install 'gvpipe[notebook]'"


def has_widgets() -> bool:
    """Whether anywidget is installed."""
    return find_spec("anywidget") is not None


def check_widgets() -> None:
    """Raise `InputError` without anywidget."""
    if not has_widgets():
        raise InputError(REMEDY)


def in_kernel() -> bool:
    """Whether this is a notebook's kernel, whose pages show more than text."""
    if "IPython" not in sys.modules:  # then nobody displays anything
        return False
    from IPython import get_ipython

    shell = get_ipython()
    return getattr(shell, "kernel", None) is not None or "google.colab" in sys.modules
