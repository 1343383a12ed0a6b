"""What knows numba: loops are compiled by it, announced, and kept on disk. Loaded when the first loop is called."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit
from numba.core import config, event
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys
from numba.extending import register_jitable

from .source_digest import digest

__all__ = ["dispatcher_of", "make_known"]

# A file in the current folder may tell numba another place for machine code that is run without a look.
config.CACHE_DIR = os.environ.get("NUMBA_CACHE_DIR", "")  # type: ignore[attr-defined]


def make_known(function: Callable[..., Any], **options: Any) -> None:
    """Let loops call a function, which becomes a part of them."""
    register_jitable(forceinline=True, **options)(function)


def dispatcher_of(function: Callable[..., Any], **options: Any) -> Any:
    """The dispatcher that compiles a loop, or takes it from disk."""
    dispatcher: Any = njit(nogil=True, **options)(function)
    try:
        dispatcher._cache = _Cache(function)
    except RuntimeError:  # neither the package's folder nor the user's can be written to
        _ANNOUNCEMENT.kept = False
    _ANNOUNCEMENT.loops.add(dispatcher)
    return dispatcher


def _ingredients(function: Any) -> str:
    """Hash of what a loop takes from other files: those of the functions that it calls, and values of constants."""
    functions, files, constants = [function], set(), set()
    for function in functions:  # grows in the loop
        files.add(digest(function.__code__.co_filename))
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

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        # Numba fills its tables for compiling first, which takes longer than most commands; compiling does so, too.
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

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
                "hexconformal: compiling, once for each kind of work; this takes half a minute, on a busy machine more"
                if self.kept
                else "hexconformal: compiling, which takes half a minute at every run, as there is no folder to "
                "keep the result in: set NUMBA_CACHE_DIR to one that can be written to"
            )

    def on_end(self, event: Any) -> None:
        pass


_ANNOUNCEMENT = _Announcement()
event.register("numba:compile", _ANNOUNCEMENT)
