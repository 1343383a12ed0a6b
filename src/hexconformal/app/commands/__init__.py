"""The commands of the program, a module each.

To add a command, write a module with the four names of `Command` and enter its name in `COMMANDS`.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from importlib import import_module
from typing import Protocol, cast

__all__ = ["COMMANDS", "Command", "load"]

# In the order in which the help lists them.
COMMANDS = ("regularize", "remesh", "flow", "move", "quality", "orient", "check", "demo")


class Command(Protocol):
    """The names that a module of this package provides.

    Attributes
    ----------
    SUMMARY
        Help text; its first sentence stands in the list of commands.
    EXAMPLES
        Lines that stand below the help.
    """

    SUMMARY: str
    EXAMPLES: str

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the arguments of the command."""

    def run(self, arguments: Namespace) -> int:
        """Run the command and return its exit code."""


def load(name: str) -> Command:
    """The command of that name: no other is loaded for it, with all that it needs."""
    return cast(Command, import_module(f".{name}", __name__))
