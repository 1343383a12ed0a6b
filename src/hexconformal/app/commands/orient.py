"""The `orient` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ...common import check_writable
from ...io import WRITE_EXTENSIONS, write
from ...quality import orient
from .arguments import add_input, add_output, note_dropped, read_hexahedra
from .outputs import check_paths

__all__ = ["EXAMPLES", "SUMMARY", "add_arguments", "run"]


SUMMARY = "Put mirrored cells, or cells in a foreign node order, into VTK's order. No point moves."
EXAMPLES = "  hexconformal orient mirrored.msh sound.msh\n"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser)
    add_output(parser)


def run(arguments: Namespace) -> int:
    """Put cells into VTK's order."""
    check_paths([arguments.output], arguments.input, arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    mesh, report = orient(read_hexahedra(arguments))
    dropped = write(arguments.output, mesh)
    if report.changed:
        print(f"node order was {report.order}; {len(report.mirrored)} of {len(mesh.cells)} cells turned round")
    else:
        print("nothing to do: all cells are in VTK's order, none is mirrored")
    print(f"wrote {arguments.output}")
    note_dropped(arguments.output, dropped)
    return 0
