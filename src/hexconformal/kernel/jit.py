"""How this package compiles: small algebra that also runs in numpy, and loops that run in threads."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from numba import njit
from numba.core import event
from numba.core.caching import FunctionCache
from numba.extending import register_jitable

__all__ = ["algebra", "loop", "strict_loop"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered and fused (the order is fixed once compiled); NaN and infinity keep their meaning.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}


def algebra(function: Function) -> Function:
    """Mark a function for use inside compiled loops; called from Python it stays as it is written.

    Inlined always: a loop with a call left in it is not vectorised. Numba compiles a loop anew when its own file
    changes, not when such a function in another file does: then remove ``*.nb?`` from ``__pycache__``.
    """
    return register_jitable(forceinline=True, **_OPTIONS)(function)  # type: ignore[no-any-return]


def loop(function: Function) -> Function:
    """Compile a loop over a range, without the interpreter's lock and kept on disk for the next process."""
    return _compiled(function, **_OPTIONS)


def strict_loop(function: Function) -> Function:
    """The same, with every sum in the order in which it is written: what is proved of its rounding holds."""
    return _compiled(function)


def _compiled(function: Function, **options: Any) -> Function:
    compiled: Any = njit(nogil=True, **options)(function)
    try:
        compiled._cache = _Cache(function)
    except RuntimeError:  # neither the package's folder nor the user's can be written to
        _ANNOUNCEMENT.kept = False
    _ANNOUNCEMENT.loops.add(compiled)
    return compiled  # type: ignore[no-any-return]


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's, but that a full disk costs the next process its time, and not this one its run."""

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):
            super().save_overload(sig, data)


class _Announcement(event.Listener):  # type: ignore[misc]
    """Says, once, that machine code is not on disk yet, so that the wait is understood."""

    def __init__(self) -> None:
        self.loops: set[Any] = set()
        self.kept = True
        self._said = False

    def on_start(self, event: Any) -> None:
        # Other programs' functions are not ours to speak of.
        if not self._said and event.data["dispatcher"] in self.loops:
            self._said = True
            logging.getLogger("hexconformal").warning(
                "hexconformal: compiling, at the first run only; this takes some twenty seconds"
                if self.kept
                else "hexconformal: compiling, which takes some twenty seconds at every run, as there is no folder to "
                "keep the result in: set NUMBA_CACHE_DIR to one that can be written to"
            )

    def on_end(self, event: Any) -> None:
        pass


_ANNOUNCEMENT = _Announcement()
event.register("numba:compile", _ANNOUNCEMENT)
