"""The `quality` command: of solid cells, and of surfaces where there are none."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ...common import MeshError, OptionError, check_writable, unusable_points, write_text
from ..progress import Progress
from ..terminal import print_line, print_text
from .arguments import STDOUT, add_html, add_input, add_mpi, add_overwrite, note_dropped, read_any_mesh
from .results.outputs import check_page, check_paths, check_pictures, named_inputs, print_summary

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal quality part.vtu
  hexconformal quality part.vtu --plot quality.png
  hexconformal quality part.vtu --worst 20 --picture worst.png
  hexconformal quality part.vtu --json - | jq .scaled_jacobian.min
  hexconformal quality part.vtu --html quality.html
  hexconformal quality part.msh --out measured.vtu
  hexconformal quality statue.ply --plot quality.png
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser, "solid cells of higher order, polyhedra, ...")
    parser.add_argument("--json", metavar="FILE", help="write the summary as JSON; - for stdout")
    parser.add_argument("--plot", metavar="quality.png", help="draw histograms")
    parser.add_argument("--picture", metavar="worst.png", help="draw the worst cells in their place")
    add_html(parser, "the mesh, its worst cells, histograms and figures")
    parser.add_argument("--worst", type=int, default=5, metavar="N", help="name the N worst cells (default 5)")
    parser.add_argument("--out", dest="output", metavar="FILE", help="write the mesh with the measures as cell arrays")
    add_overwrite(parser)
    add_mpi(parser, "--out is a .pvtu file and a piece of each rank")


def run(arguments: Namespace) -> int:
    """Measure a mesh, or a surface where there are no solid cells."""

    def check() -> None:
        if arguments.worst < 0:
            raise OptionError(f"worst must be 0 or more, not {arguments.worst}")

    if arguments.mpi:
        from ..on_ranks import quality_on_ranks  # with all that ranks need, which others do not

        return quality_on_ranks(arguments, check)
    check()
    to_file = None if arguments.json == STDOUT else arguments.json
    files = [arguments.output, to_file, arguments.plot, arguments.picture, arguments.html]
    check_paths(files, named_inputs(arguments.input), arguments.overwrite)
    check_pictures(arguments.plot, arguments.picture)
    check_page(arguments.html)
    with Progress() as progress:
        progress.show(f"measuring {arguments.input}")
        kind, mesh = read_any_mesh(arguments)
        odd, text = unusable_points(mesh.points, mesh.node_labels)
        if len(odd):
            raise MeshError(f"{arguments.input}: {text}")
        if arguments.output is not None:
            check_writable(arguments.output, kind.extensions)
        measured = kind.measure(mesh)
        summary = measured.summary(arguments.worst)
        if arguments.plot is not None:
            kind.histogram(arguments.plot, measured)
        if arguments.picture is not None:
            kind.worst_cells(arguments.picture, measured, count=arguments.worst)
        if arguments.html is not None:
            from ...page import ReportText  # not loaded where no page is written

            kind.page(mesh, report=ReportText(str(summary), mesh.notes)).write(arguments.html)
        dropped = []
        if arguments.output is not None:
            dropped = kind.write(arguments.output, mesh.replaced(cell_data=kind.arrays(measured)))
        if to_file is not None:
            write_text(to_file, summary.to_json() + "\n")
    if arguments.json == STDOUT:
        print_text(summary.to_json())
    else:
        print_summary(summary, kind.worst_measure)
        if any(files):
            print_line(f"wrote {', '.join(filter(None, files))}")
    note_dropped(arguments.output, dropped)
    return 0
