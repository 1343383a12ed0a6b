"""MPI and PETSc, which are there where they are installed, and what all ranks must have the same."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from ..common import OptionError, agreed

__all__ = ["mpi", "petsc", "require_alike", "without_petsc"]

_SHORT = 100  # characters of two values that are shown
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


def _told(value: Any) -> str:
    if isinstance(value, np.ndarray | list | tuple):
        return "an array"
    return repr(value.item() if isinstance(value, np.generic) else value)
