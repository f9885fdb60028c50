"""Which form kernels have. All give the same bits.

========  =========================================  ==================================  ==============================
form      compiler                                   kept by                             rows of numbers (`lanes`)
========  =========================================  ==================================  ==============================
quick     numba's, arguments borrowed (`borrowing`)  `machine_code`                      vectors (`vector_rows`)
plain     numba's                                    numba's own cache                   arrays (`plain_rows`)
Python    none: ``NUMBA_DISABLE_JIT=1``                                                  arrays (`plain_rows`)
========  =========================================  ==================================  ==============================

The quick form needs private parts of numba and llvmlite, which any version may change. So a kernel is compiled, stored, loaded
and called before others are (`gvpipe.runtime.self_test`); where that fails, all are plain, and a warning says so once.
``GVPIPE_KERNELS=plain`` asks for that form. This module and what it loads are all of gvpipe that imports numba.
"""

from __future__ import annotations

import enum
import functools
import logging
import os

import numba

from gvpipe.foundation.errors import InputError

LOGGER = logging.getLogger(__name__)
VARIABLE = "GVPIPE_KERNELS"
FAILED = "numba {} and llvmlite {} lack what quick kernels need ({}); plain ones give the same results, and take longer"


class Form(enum.Enum):
    """The forms of kernels, as the table above says."""

    QUICK = "quick"
    PLAIN = "plain"
    PYTHON = "Python"


@functools.cache
def kernel_form() -> Form:
    """The form of all kernels of this process.

    Raises:
        InputError: ``GVPIPE_KERNELS`` names none.
    """
    wanted = os.environ.get(VARIABLE, "")
    if wanted not in ("", Form.QUICK.value, Form.PLAIN.value):
        raise InputError(f"{VARIABLE} is {wanted!r}; quick or plain is needed")
    if numba.config.DISABLE_JIT:
        return Form.PYTHON
    if wanted == Form.PLAIN.value:
        return Form.PLAIN
    try:
        from gvpipe.runtime.self_test import check_quick_kernels

        check_quick_kernels()
    except Exception as exc:  # numba and LLVM raise any
        import llvmlite

        reason = f"{type(exc).__name__}: {' '.join(str(exc).split())[:200]}"
        LOGGER.warning(FAILED.format(numba.__version__, llvmlite.__version__, reason))
        return Form.PLAIN
    return Form.QUICK
