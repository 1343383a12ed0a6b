"""The `orient` command."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from ...common import check_writable
from ...io import WRITE_EXTENSIONS, write
from ...quality import orient
from .arguments import add_input, add_output, command, mesh_of, tell_lost
from .outputs import check_places

__all__ = ["add_orient"]


def add_orient(added: Any) -> None:
    """Add the command to those of the program."""
    parser = command(
        added,
        "orient",
        _orient,
        "Put mirrored cells, or cells in a foreign node order, into VTK's order. No point moves.",
        "  hexconformal orient mirrored.msh sound.msh\n",
    )
    add_input(parser)
    add_output(parser)


def _orient(arguments: Namespace) -> int:
    """Put cells into VTK's order."""
    check_places([arguments.output], arguments.input, arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    mesh, report = orient(mesh_of(arguments))
    lost = write(arguments.output, mesh)
    if report.changed:
        print(f"node order was {report.order}; {len(report.mirrored)} of {len(mesh.cells)} cells turned round")
    else:
        print("nothing to do: all cells are in VTK's order, none is mirrored")
    print(f"wrote {arguments.output}")
    tell_lost(arguments.output, lost)
    return 0
