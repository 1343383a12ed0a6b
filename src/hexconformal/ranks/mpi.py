"""MPI and PETSc, which are there where they are installed, and errors that all ranks raise together."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..common import MeshError, OptionError, ReadError, WriteError

__all__ = ["agreed", "is_agreed", "mpi", "petsc", "require_alike", "without_petsc"]

_SHORT = 100  # characters of two values that are shown
_OF_ALL = "of_all_ranks"  # attribute of errors that all ranks have raised
_ADVICE = "see 'More than one machine' in docs/install.md"


def mpi() -> Any:
    """The module mpi4py.MPI.

    Raises
    ------
    OptionError
        If it is not installed, or finds no MPI library.
    """
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as problem:
        raise OptionError(f"runs on ranks need mpi4py and an MPI library ({problem}): {_ADVICE}") from problem
    return MPI


def without_petsc(comm: Any) -> Any:
    """The ranks that have no PETSc yet, for :func:`petsc`; None on those that have it. All must call it.

    PETSc begins on all of its ranks together: others, which may do something else meanwhile, must not be waited for.
    """
    has_it = "petsc4py.PETSc" in sys.modules
    together = comm.Split(int(has_it))
    if has_it or together.size == mpi().COMM_WORLD.size:
        together.Free()
        return None
    return together


def petsc(beginning: Any = None) -> Any:
    """The module petsc4py.PETSc, which leaves signals alone.

    Where it is called first the ranks that begin to use it say so, see :func:`without_petsc`; None: all there are.

    Raises
    ------
    OptionError
        If it is not installed, or was built for another MPI, or for complex numbers.
    """
    try:
        import petsc4py

        petsc4py.init(["hexconformal", "-no_signal_handler"], comm=beginning)
        from petsc4py import PETSc
    except (ImportError, RuntimeError) as problem:
        raise OptionError(f"runs on ranks need petsc4py ({problem}): {_ADVICE}") from problem
    if np.dtype(PETSc.ScalarType) != np.float64:
        raise OptionError(f"runs on ranks need PETSc with real numbers in double precision: {_ADVICE}")
    return PETSc


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


def require_alike(comm: Any, **values: Any) -> None:
    """Raise an OptionError on all ranks unless each has the same values, by name; all must call it.

    Arrays are those of a rank's own nodes or cells: any will do, but all must have one.
    """
    if comm is None:
        return
    own = {name: _told(value) for name, value in values.items()}
    first = comm.bcast(own)
    with agreed(comm):
        for name, value in own.items():
            if value != first[name]:
                pair = f", not {value}, and {first[name]} on rank 0" if len(value + first[name]) < _SHORT else ""
                raise OptionError(f"{name} must be the same on all ranks{pair}")


def is_agreed(problem: BaseException) -> bool:
    """True of an error that all ranks have raised by :func:`agreed`."""
    return hasattr(problem, _OF_ALL)


_ERRORS: tuple[type[Exception], ...] = (ReadError, MeshError, OptionError, WriteError, RuntimeError)
_KINDS = {kind.__name__: kind for kind in _ERRORS}


def _told(value: Any) -> str:
    if isinstance(value, np.ndarray | list | tuple):
        return "an array"
    return repr(value.item() if isinstance(value, np.generic) else value)


def _kind(problem: Exception) -> str:
    """The name of what is raised everywhere: other than our own errors are those of files, or of memory."""
    name = type(problem).__name__
    if isinstance(problem, OSError):
        return "WriteError"
    return name if name in _KINDS else "MeshError" if isinstance(problem, MemoryError) else "RuntimeError"
