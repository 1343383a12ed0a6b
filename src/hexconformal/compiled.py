"""How this package compiles: small algebra that also runs in numpy, and loops that run in threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.extending import register_jitable

__all__ = ["algebra", "loop"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered and fused (the order is fixed once compiled); NaN and infinity keep their meaning.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}


def algebra(function: Function) -> Function:
    """Mark a function for use inside compiled loops; called from Python it stays as it is written.

    Inlined always: a loop with a call left in it is not vectorised.
    """
    return register_jitable(forceinline=True, **_OPTIONS)(function)  # type: ignore[no-any-return]


def loop(function: Function) -> Function:
    """Compile a loop over a range, without the interpreter's lock and kept on disk for the next process."""
    return njit(nogil=True, cache=True, **_OPTIONS)(function)  # type: ignore[no-any-return]
