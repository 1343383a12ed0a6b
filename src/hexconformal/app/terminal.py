"""Standard streams: what is printed is text that every terminal shows and none obeys."""

from __future__ import annotations

import os
import re
import sys
from argparse import ArgumentParser
from contextlib import suppress
from difflib import get_close_matches
from typing import Any, NoReturn

__all__ = ["Parser", "flush_standard_streams", "open_standard_streams", "print_line", "print_text", "printable"]

# Control characters, those that turn the direction of writing, and halves of characters, but not the end of a line.
_UNPRINTABLE = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    r"""The text with an escape in the place of what a terminal would act on; names in files may hold anything.

    >>> printable("grün \x1b[2J")
    'grün \\x1b[2J'
    """
    return _UNPRINTABLE.sub(_escape, text)


def print_text(text: Any, error: bool = False) -> None:
    """Print lines on stdout, or on stderr, where nobody may be listening any more."""
    stream: Any = sys.stderr if error else sys.stdout
    try:
        print(_encodable(printable(str(text)), stream), file=stream)
    except (OSError, ValueError):
        if not error:
            raise


def print_line(text: str, error: bool = False) -> None:
    """Print one line; ends of lines within it, which a name may have, are escaped."""
    print_text(text.replace("\n", "\\n"), error)


def open_standard_streams() -> None:
    """Open streams that are closed, on nothing: otherwise the next file would be where libraries print to."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            with suppress(OSError):
                os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115 (kept open)


def flush_standard_streams() -> OSError | None:
    """Let out what was printed; returns what kept it from stdout. Python would complain of it at exit."""
    found = None
    for stream in (sys.stderr, sys.stdout):
        try:
            stream.flush()
        except OSError as problem:
            found = problem if stream is sys.stdout else None
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return found


def _escape(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


def _encodable(text: str, stream: Any) -> str:
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


class Parser(ArgumentParser):
    """A parser of arguments that prints in the same way, and tells what may have been meant."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and end with exit code 2."""
        found = re.search("invalid choice: '([^']+)'|unrecognized arguments: (--[a-z-]+)", message)
        similar = get_close_matches(found[1] or found[2], self._known_words(), 1) if found else []
        super().error(f"{message}; did you mean {similar[0]}?" if similar else message)

    def _known_words(self) -> list[str]:
        """Options, commands, and the options of commands."""
        words: list[str] = []
        for action in self._actions:
            words += action.option_strings
            for name in action.choices or ():
                words.append(str(name))
                command = action.choices[name] if isinstance(action.choices, dict) else None
                words += command._known_words() if isinstance(command, Parser) else []
        return words

    def _print_message(self, message: str, file: Any = None) -> None:
        with suppress(OSError, ValueError):
            (file or sys.stderr).write(_encodable(printable(message), file or sys.stderr))
