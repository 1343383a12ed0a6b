"""A live line in the terminal that shows what a run is doing."""

from __future__ import annotations

import logging
import sys
from contextlib import ExitStack
from typing import Any

from .terminal import printable

__all__ = ["Progress"]


class Progress:
    """A line on stderr that says what is going on, where stderr is a terminal; nothing anywhere else.

    Parameters
    ----------
    quiet
        Show nothing at all, and log errors only.

    Examples
    --------
    >>> with Progress(quiet=True) as progress:
    ...     progress.show("reading part.vtu")
    """

    def __init__(self, quiet: bool = False) -> None:
        self._status: Any = None
        self._stack = ExitStack()
        self._quiet = quiet
        self._visible = not quiet and sys.stderr is not None and sys.stderr.isatty()

    def __enter__(self) -> Progress:
        if self._quiet:
            log = logging.getLogger("hexconformal")
            self._stack.callback(log.setLevel, log.level)
            log.setLevel(logging.ERROR)
        if self._visible:
            from rich.console import Console

            self._status = self._stack.enter_context(Console(stderr=True).status("", spinner="line"))
        return self

    def __exit__(self, *problem: Any) -> None:
        self._stack.close()
        self._status = None

    def show(self, text: str) -> None:
        """Show a text in place of the last one."""
        if self._status is not None:
            from rich.text import Text

            self._status.update(Text(printable(text), no_wrap=True, overflow="ellipsis"))
