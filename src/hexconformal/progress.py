"""What is seen of a run while it goes on: a live line in the terminal."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import Any

from numba.core import event

__all__ = ["Progress"]


class Progress:
    """A line on stderr that says what is going on, where stderr is a terminal; nothing anywhere else.

    Parameters
    ----------
    quiet
        Say nothing at all.

    Examples
    --------
    >>> with Progress(quiet=True) as progress:
    ...     progress.say("reading part.vtu")
    """

    def __init__(self, quiet: bool = False) -> None:
        self._status: Any = None
        self._stack = ExitStack()
        self._wanted = not quiet and sys.stderr.isatty()

    def __enter__(self) -> Progress:
        if self._wanted:
            from rich.console import Console

            self._status = self._stack.enter_context(Console(stderr=True).status("", spinner="line"))
            self._stack.enter_context(event.install_listener("numba:compile", _Compiling(self)))
        return self

    def __exit__(self, *problem: Any) -> None:
        self._stack.close()
        self._status = None

    def say(self, text: str) -> None:
        """Show a text in the place of the last one."""
        if self._status is not None:
            from rich.text import Text

            self._status.update(Text(text, no_wrap=True, overflow="ellipsis"))


class _Compiling(event.Listener):  # type: ignore[misc]
    """Tells of machine code that is not on disk yet, so that the wait is understood."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def on_start(self, event: Any) -> None:
        self._progress.say("compiling (first run only)")

    def on_end(self, event: Any) -> None:
        pass
