"""The `elevate` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ...common import check_writable
from ...io import WRITE_EXTENSIONS, elevated, write
from ..terminal import print_line
from .arguments import add_input, add_output, note_dropped, read_hexahedra
from .results.outputs import check_paths, named_inputs

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = "  hexconformal elevate part.vtu curved.vtu --to 27\n  hexconformal elevate part.inp curved.inp --to 20\n"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser)
    add_output(parser)
    parser.add_argument("--to", type=int, default=20, metavar="20|27", help="nodes of a cell (default %(default)s)")


def run(arguments: Namespace) -> int:
    """Write the mesh with nodes between its corners."""
    check_paths([arguments.output], named_inputs(arguments.input), arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    linear = read_hexahedra(arguments)
    mesh = elevated(linear, arguments.to)
    dropped = write(arguments.output, mesh)
    print_line(f"{len(mesh.blocks[0].cells)} hexahedra of {arguments.to} nodes, {len(mesh.points)} points")
    print_line(f"wrote {arguments.output}")
    note_dropped(arguments.output, dropped)
    return 0
