"""The `elevate` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

import numpy as np

from ...common import check_writable, first_ids
from ...io import WRITE_EXTENSIONS, elevated, write
from ...mesh import counts_by_type
from ...quality import check, quality
from ..terminal import print_line
from .arguments import add_input, add_output, note_dropped, read_to_work_on
from .results.outputs import check_paths, named_inputs

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal elevate part.vtu curved.vtu --to 27
  hexconformal elevate part.inp curved.inp --to 20 --surface part.stl
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser)
    add_output(parser)
    parser.add_argument(
        "--to", type=int, default=20, metavar="20|27", help="nodes of a hexahedron (default %(default)s)"
    )
    parser.add_argument(
        "--surface", metavar="part.stl", help="put nodes between corners of the boundary on this surface and its curves"
    )


def run(arguments: Namespace) -> int:
    """Write the mesh with nodes between its corners."""
    check_paths([arguments.output], named_inputs(arguments.input, surface=arguments.surface), arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    linear = read_to_work_on(arguments)
    far = ""
    if arguments.surface is None:
        mesh, notes = elevated(linear, arguments.to), list[str]()
    else:
        from ...regularization import curved  # not loaded where edges stay straight

        mesh, (before, after), told = curved(linear, arguments.surface, arguments.to)
        far, notes = f"{after:.3g} away from the surface; with straight edges {before:.3g}", list(told)
    invalid = np.flatnonzero(~quality(mesh).valid)
    if len(invalid):
        wrong = [finding.message for finding in check(linear) if finding.severity == "error"]
        notes += [f"cells that are not valid: {first_ids(invalid, mesh.cell_labels)}", *wrong]
    dropped = write(arguments.output, mesh)
    print_line(f"{counts_by_type(mesh.blocks)}, {len(mesh.points)} points")
    if far:
        print_line(f"the boundary is up to {far}")
    for note in (*mesh.notes, *notes):
        print_line(f"note: {note}")
    print_line(f"wrote {arguments.output}")
    note_dropped(arguments.output, dropped)
    return 0
