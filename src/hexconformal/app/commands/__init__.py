"""The commands of the program, a module each.

To add a command, write a module with the four names of `Command` and enter it in `COMMANDS`.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Protocol

from . import check, demo, flow, move, orient, quality, regularize, remesh

__all__ = ["COMMANDS", "Command"]


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


# By name, in the order in which the help lists them.
COMMANDS: dict[str, Command] = {
    "regularize": regularize,
    "remesh": remesh,
    "flow": flow,
    "move": move,
    "quality": quality,
    "orient": orient,
    "check": check,
    "demo": demo,
}
