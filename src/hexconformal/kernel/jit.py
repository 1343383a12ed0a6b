"""Marks of what is compiled: small algebra that also runs in numpy, and loops that run in threads."""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from threading import RLock
from typing import Any, TypeVar

from .source_digest import digest

__all__ = ["Loop", "algebra", "loop", "strict_loop"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered and fused (the order is fixed once compiled); NaN and infinity keep their meaning.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}

_marked: list[Callable[..., Any]] = []  # algebra that numba does not know of yet
_lock = RLock()


class Loop:
    """A function that is compiled when it is first called: numba is loaded then, not by what only defines loops.

    Attributes
    ----------
    py_func
        The function, for the interpreter.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        digest(function.__code__.co_filename)
        self.py_func = function
        self._options = options
        self._compiled: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return (self._compiled or self.compiled)(*arguments)

    @property
    def compiled(self) -> Any:
        """The dispatcher of numba, which compiles for each new combination of types."""
        with _lock:
            if self._compiled is None:
                from .numba_compiler import dispatcher_of, make_known

                while _marked:
                    make_known(_marked.pop(), **_OPTIONS)
                self._compiled = dispatcher_of(self.py_func, **self._options)
            return self._compiled

    @property
    def _numba_type_(self) -> Any:
        # What numba asks for where another loop calls this one.
        return self.compiled._numba_type_


def algebra(function: Function) -> Function:
    """Mark a function for use inside compiled loops; called from Python it stays as it is written.

    Inlined always: a loop with a call left in it is not vectorised. A loop is compiled anew when its own file changes,
    or that of a function or the value of a constant that it takes from another file.
    """
    digest(function.__code__.co_filename)
    _marked.append(function)
    return function


def loop(function: Function) -> Function:
    """Compile a loop over a range, without the interpreter's lock and kept on disk for the next process."""
    return Loop(function, **_OPTIONS)  # type: ignore[return-value]


def strict_loop(function: Function) -> Function:
    """The same, with every sum in the order in which it is written: what is proved of its rounding holds."""
    return Loop(function)  # type: ignore[return-value]
