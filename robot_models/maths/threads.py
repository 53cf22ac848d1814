"""How many cores this process may use, and how many threads its linear algebra shall."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_BLAS = threading.Lock()  # the limit is the whole process's
_limited = 0  # blocks that are open
_limits: Any = None  # what the first of them set, and the last takes back


def available_threads() -> int:
    """Cores that this process may use, which in a container are fewer than the machine's."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Linear algebra on one thread for as long as the block lasts; a decorator too.

    The solver's matrices are too small to share: on busy cores threads of the BLAS libraries spend a hundred times the
    work's own time waiting for one another. Blocks of several Python threads may overlap.
    """
    global _limited, _limits
    import scipy.linalg  # noqa: F401 - NumPy and SciPy have a BLAS each: both must be there to be told
    from threadpoolctl import threadpool_limits

    with _BLAS:
        if _limited == 0:
            _limits = threadpool_limits(limits=1, user_api="blas")
        _limited += 1
    try:
        yield
    finally:
        with _BLAS:
            _limited -= 1
            if _limited == 0:
                _limits.restore_original_limits()
