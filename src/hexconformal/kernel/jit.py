"""Compilation by numba: small algebra that also runs in numpy, and loops that run in threads."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core import config, event
from numba.core.caching import FunctionCache
from numba.extending import register_jitable

__all__ = ["algebra", "loop", "strict_loop"]

Function = TypeVar("Function", bound=Callable[..., Any])

# A file in the current folder may tell numba another place for machine code that is run without a look.
config.CACHE_DIR = os.environ.get("NUMBA_CACHE_DIR", "")  # type: ignore[attr-defined]

# Sums may be reordered and fused (the order is fixed once compiled); NaN and infinity keep their meaning.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}


def algebra(function: Function) -> Function:
    """Mark a function for use inside compiled loops; called from Python it stays as it is written.

    Inlined always: a loop with a call left in it is not vectorised. A loop is compiled anew when its own file changes,
    or that of a function or the value of a constant that it takes from another file.
    """
    _digest(function.__code__.co_filename)
    return register_jitable(forceinline=True, **_OPTIONS)(function)  # type: ignore[no-any-return]


def loop(function: Function) -> Function:
    """Compile a loop over a range, without the interpreter's lock and kept on disk for the next process."""
    return _compiled(function, **_OPTIONS)


def strict_loop(function: Function) -> Function:
    """The same, with every sum in the order in which it is written: what is proved of its rounding holds."""
    return _compiled(function)


def _compiled(function: Function, **options: Any) -> Function:
    _digest(function.__code__.co_filename)
    compiled: Any = njit(nogil=True, **options)(function)
    try:
        compiled._cache = _Cache(function)
    except RuntimeError:  # neither the package's folder nor the user's can be written to
        _ANNOUNCEMENT.kept = False
    _ANNOUNCEMENT.loops.add(compiled)
    return compiled  # type: ignore[no-any-return]


@cache
def _digest(file: str) -> bytes:
    """Hash of a source file, as it was when the first function in it was marked: what is compiled is of that state."""
    try:
        return sha256(Path(file).read_bytes()).digest()
    except OSError:  # inside an archive, all of which numba itself hashes
        return b""


def _ingredients(function: Any) -> str:
    """Hash of what a loop takes from other files: those of the functions that it calls, and values of constants."""
    functions, files, constants = [function], set(), set()
    for function in functions:  # grows in the loop
        files.add(_digest(function.__code__.co_filename))
        for name in function.__code__.co_names:
            value = function.__globals__.get(name)
            value = getattr(value, "py_func", value)
            if isinstance(value, FunctionType) and value not in functions:
                functions.append(value)
            elif isinstance(value, (bool, int, float, str, tuple, np.ndarray)):
                constants.add(f"{name} = {value.tolist() if isinstance(value, np.ndarray) else value!r}")
    return sha256(b"".join(sorted(files)) + "".join(sorted(constants)).encode()).hexdigest()


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's cache on disk, which sees a change of what is inlined, and for which a full disk ends no run."""

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (*super()._index_key(sig, codegen), _ingredients(self._py_func))

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
