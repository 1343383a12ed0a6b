"""Threads for compiled loops: each owns a contiguous range, so results do not depend on their number."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..common import OptionError

__all__ = ["parallel_ranges", "thread_count", "use_threads"]

_SMALLEST_RANGE = 2000
_GROUPS = Path("/sys/fs/cgroup")  # where Linux says what a container may use

_asked: list[int] = []


def use_threads(count: int | None) -> None:
    """Let loops take so many threads from now on, in this process; results do not depend on it.

    Parameters
    ----------
    count
        Number of threads; None for what ``HEXCONFORMAL_THREADS`` says, or else for all processors of the process.

    Raises
    ------
    OptionError
        If that is not a positive number.

    Examples
    --------
    >>> import hexconformal as hc
    >>> hc.use_threads(1)
    >>> hc.use_threads(None)
    """
    if count is not None and (isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1):
        raise OptionError(f"threads must be a positive number, or None for all processors, not {count!r}")
    _asked[:] = [] if count is None else [int(count)]


def thread_count() -> int:
    """Number of threads that loops take: see :func:`use_threads`."""
    return _asked[0] if _asked else _usual_count()


@cache
def _usual_count() -> int:
    requested = os.environ.get("HEXCONFORMAL_THREADS", "")
    if requested.isdigit() and int(requested) > 0:
        return int(requested)
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(count, max(_container_limit(), 1))


def _container_limit() -> int:
    """Processors' worth of time that a container may take, rounded up; huge where nothing is said."""
    for files in (("cpu.max",), ("cpu/cpu.cfs_quota_us", "cpu/cpu.cfs_period_us")):
        try:
            quota, period = " ".join((_GROUPS / file).read_text() for file in files).split()[:2]
            return -(-int(quota) // int(period)) if int(quota) > 0 else 1 << 30
        except (OSError, ValueError):  # no such file, or no limit: max
            continue
    return 1 << 30


@cache
def _pool(process: int, count: int) -> ThreadPoolExecutor:
    # Keyed by process: a pool does not survive a fork.
    return ThreadPoolExecutor(count, thread_name_prefix="hexconformal")


def parallel_ranges(function: Callable[..., None], count: int, *arguments: Any, smallest: int | None = None) -> None:
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
    smallest
        Items below which a range is not worth a thread of its own; default some thousand.
    """
    # One compiled version serves all callers: numba would compile again for read-only arrays.
    arguments = tuple(a.copy() if isinstance(a, np.ndarray) and not a.flags.writeable else a for a in arguments)
    threads = thread_count()
    parts = min(threads, max(count // (_SMALLEST_RANGE if smallest is None else smallest), 1))
    if parts == 1:
        function(0, count, *arguments)
        return
    bounds = [count * i // parts for i in range(parts + 1)]
    pool = _pool(os.getpid(), threads - 1)
    jobs = [pool.submit(function, a, b, *arguments) for a, b in pairwise(bounds[1:])]
    try:
        # A range of its own is a hand-over less, and nobody waits.
        function(0, bounds[1], *arguments)
    finally:
        for job in jobs:
            job.result()
