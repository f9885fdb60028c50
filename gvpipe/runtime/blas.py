"""Matrix products on one thread.

Why: codecs make many small products, and the threads of a BLAS then wait for one another longer than they compute. Where other
programs kept the cores busy, samba took 51 s instead of 23 s.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def one_blas_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Let ``function`` run with one BLAS thread; afterwards there are as many as before."""

    @functools.wraps(function)
    def limited(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        import scipy.linalg  # noqa: F401  # SciPy has a BLAS of its own, which is limited once it is loaded
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
