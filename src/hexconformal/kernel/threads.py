"""Threads for compiled loops: each owns a contiguous range, so results do not depend on their number."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np

__all__ = ["parallel_ranges", "thread_count"]

_SMALLEST_RANGE = 2000


@cache
def thread_count() -> int:
    """Number of processors this process may use, or ``HEXCONFORMAL_THREADS`` where it is set."""
    requested = os.environ.get("HEXCONFORMAL_THREADS", "")
    if requested.isdigit() and int(requested) > 0:
        return int(requested)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    # Keyed by process: a pool does not survive a fork.
    return ThreadPoolExecutor(thread_count(), thread_name_prefix="hexconformal")


def parallel_ranges(function: Callable[..., None], count: int, *arguments: Any) -> None:
    """Call ``function(first, last, *arguments)`` on ranges that cover ``range(count)``, in threads.

    The function must release the GIL (``numba.njit(nogil=True)``) and write only to entries its range
    owns; then the result is the same, bit for bit, whatever the number of threads.

    Parameters
    ----------
    function
        Compiled loop over ``range(first, last)``.
    count
        Number of items.
    arguments
        Passed on unchanged.
    """
    # One compiled version serves all callers: numba would compile again for read-only arrays.
    arguments = tuple(np.require(a, requirements="W") if isinstance(a, np.ndarray) else a for a in arguments)
    parts = min(thread_count(), max(count // _SMALLEST_RANGE, 1))
    if parts == 1:
        function(0, count, *arguments)
        return
    bounds = [count * i // parts for i in range(parts + 1)]
    pool = _pool(os.getpid())
    jobs = [pool.submit(function, a, b, *arguments) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
    for job in jobs:
        job.result()
