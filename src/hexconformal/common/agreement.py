"""Errors that all ranks of MPI raise together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .errors import MeshError, OptionError, ReadError, WriteError

__all__ = ["agreed", "is_agreed"]

_OF_ALL = "of_all_ranks"  # attribute of errors that all ranks have raised


@contextmanager
def agreed(comm: Any, named: bool = True) -> Iterator[None]:
    """An error that a rank raises inside is raised by all of them afterwards: none waits for one that has given up.

    What no user is to blame for comes as a RuntimeError on the others.

    Inside nothing may be exchanged between ranks. The message names the rank, where that is wanted. Where
    `comm` is None, in one process, it is raised as it is.
    """
    if comm is None:
        yield
        return
    problem: Exception | None = None
    try:
        yield
    except Exception as raised:
        problem = raised
    told = None if problem is None else (_kind(problem), str(problem))
    found = [(rank, one) for rank, one in enumerate(comm.allgather(told)) if one is not None]
    if found:
        rank, (kind, text) = found[0]
        where = f"on rank {rank}: " if named and len(found) < comm.size else ""
        error = _KINDS[kind](where + (text or "not enough memory"))
        setattr(error, _OF_ALL, True)
        raise error from problem


def is_agreed(problem: BaseException) -> bool:
    """True of an error that all ranks have raised by :func:`agreed`."""
    return hasattr(problem, _OF_ALL)


_ERRORS: tuple[type[Exception], ...] = (ReadError, MeshError, OptionError, WriteError, RuntimeError)
_KINDS = {kind.__name__: kind for kind in _ERRORS}


def _kind(problem: Exception) -> str:
    """The name of what is raised everywhere: other than our own errors are those of files, or of memory."""
    name = type(problem).__name__
    if isinstance(problem, OSError):
        return "WriteError"
    return name if name in _KINDS else "MeshError" if isinstance(problem, MemoryError) else "RuntimeError"
