"""The `orient` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ...common import check_writable
from ...io import WRITE_EXTENSIONS, write
from ...mesh import blocks_of
from ...quality import orient
from ..terminal import print_line
from .arguments import add_input, add_output, note_dropped, read_volume
from .results.outputs import check_paths, named_inputs

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = "  hexconformal orient mirrored.msh sound.msh\n"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser, "solid cells of higher order, polyhedra, ...")
    add_output(parser)


def run(arguments: Namespace) -> int:
    """Put cells into VTK's order."""
    check_paths([arguments.output], named_inputs(arguments.input), arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    mesh, report = orient(read_volume(arguments))
    dropped = write(arguments.output, mesh)
    if report.changed:
        count = sum(len(block.cells) for block in blocks_of(mesh))
        print_line(f"node order was {report.order}; {len(report.mirrored)} of {count} cells turned round")
    else:
        print_line("nothing to do: all cells are in VTK's order, none is mirrored")
    print_line(f"wrote {arguments.output}")
    note_dropped(arguments.output, dropped)
    return 0
