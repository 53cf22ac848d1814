"""How many cores this process may use, and how many threads its linear algebra shall."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager


def available_threads() -> int:
    """Cores that this process may use, which in a container are fewer than the machine's."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Linear algebra on one thread for as long as the block lasts; a decorator too.

    The solver's matrices are too small to share: on busy cores threads of the BLAS libraries spend a hundred times the
    work's own time waiting for one another.
    """
    import scipy.linalg  # noqa: F401 - NumPy and SciPy have a BLAS each: both must be there to be told
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
