"""The commands of the program, a module each.

To add a command, write a module with the three names of `Command` and enter it in `COMMANDS`.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from importlib import import_module
from typing import Protocol, cast

__all__ = ["COMMANDS", "Command", "load"]

# With the texts of their help; the first sentences stand in the list of commands, in this order.
COMMANDS = {
    "regularize": "Make the cells of a mesh of hexahedra, linear or quadratic, wedges, pyramids or tetrahedra regular."
    " Inverted cells are unfolded, valid ones stay valid.",
    "remesh": "Make the cells of a triangle or quad surface regular. The shape is kept, no cell turns over.",
    "flow": "Let a surface flow to lower area or bending energy, remeshing on the way."
    " Writes frames, a history and a checkpoint after every step into a folder.",
    "move": "Move a mesh with its boundary, step after step."
    " Writes frames with the mesh velocity, a history and a checkpoint after every step into a folder;"
    " ends with exit code 1 where the boundary asks for the impossible.",
    "quality": "Measure every cell of a mesh (validity, det J > 0 everywhere, is certified) or of a surface."
    " Wedges, pyramids, tetrahedra and quadratic cells are measured like hexahedra.",
    "view": "Look at a mesh, a surface or a series in a browser."
    " Writes one page, which needs no network and no server, and opens it.",
    "orient": "Put mirrored cells, or cells in a foreign node order, into VTK's order. No point moves.",
    "elevate": "Make quadratic cells from linear ones. The shape stays, arrays and sets too.",
    "check": "Tell whether a mesh, or a surface, can be worked on, and what is doubtful about it."
    " Exit code 1 if it cannot.",
    "demo": "Make a cube of skewed cells regular."
    " Leaves meshes, a ParaView series, a picture and a report in a folder.",
}


class Command(Protocol):
    """The names that a module of this package provides.

    Attributes
    ----------
    EXAMPLES
        Lines that stand below the help.
    """

    EXAMPLES: str

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the arguments of the command."""

    def run(self, arguments: Namespace) -> int:
        """Run the command and return its exit code."""


def load(name: str) -> Command:
    """The command of that name: no other is loaded for it, with all that it needs."""
    return cast(Command, import_module(f".{name}", __name__))
