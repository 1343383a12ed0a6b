"""The `remesh` command: hooked into the command line of the package."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from .options import Options

__all__ = ["add_remesh"]


def add_remesh(subparsers: Any) -> None:
    """Add the command `remesh` to a parser's subcommands; it sets `run`, which returns the exit code."""
    parser: ArgumentParser = subparsers.add_parser(
        "remesh",
        help="make the cells of a surface regular",
        description="Make the cells of a triangle or quad surface regular; its shape is kept and no cell turns over.",
        epilog="example: hexconformal remesh statue.ply better.vtu --reference flat --iterations 20 --frames run.pvd",
        allow_abbrev=False,
    )
    parser.set_defaults(run=_remesh)
    parser.add_argument("input", metavar="IN", help="surface to read (.ply .obj .stl .off .msh .vtp .vtu .vtk)")
    parser.add_argument("output", metavar="OUT", help="surface to write")
    parser.add_argument("--reference", default=Options.reference, metavar="equilateral|flat|input")
    parser.add_argument("--energy", default=Options.energy, metavar="barrier|quaternionic")
    parser.add_argument("--normal", default=Options.normal, metavar="middle|simpson|linear")
    parser.add_argument("--boundary", default=Options.boundary, metavar="slide|fixed")
    parser.add_argument("--iterations", type=int, default=Options.iterations, metavar="N", help="default %(default)d")
    parser.add_argument("--tolerance", type=float, default=Options.tolerance, metavar="X", help="default %(default)g")
    parser.add_argument("--eps", type=float, default=Options.eps, metavar="X", help="default %(default)g")
    parser.add_argument("--hausdorff", type=float, default=Options.hausdorff, metavar="X", help="default %(default)g")
    parser.add_argument(
        "--features", type=float, default=Options.features, metavar="DEGREES", help="default %(default)g"
    )
    parser.add_argument("--no-projection", dest="project", action="store_false", help="let the surface go")
    parser.add_argument("--frames", metavar="run.pvd", help="the iterations, as a series for ParaView")
    parser.add_argument("--report", metavar="report.json", help="before and after as JSON")
    parser.add_argument("--quiet", action="store_true", help="errors only")


def _remesh(arguments: Namespace) -> int:
    from dataclasses import fields

    from hexconformal.io import check_writable
    from hexconformal.job import check_places, write_text
    from hexconformal.series import Series

    from .io import EXTENSIONS, read, to_pyvista, write
    from .remesh import Remeshing

    check_places([arguments.output, arguments.report, arguments.frames], arguments.input)
    check_writable(arguments.output, EXTENSIONS)
    chosen = {field.name: getattr(arguments, field.name) for field in fields(Options) if hasattr(arguments, field.name)}
    options = Options(**chosen)
    mesh = read(arguments.input)
    series = None if arguments.frames is None else Series(arguments.frames)
    run = Remeshing(mesh, options)
    for record in run:
        if series is not None:
            series.add(record.iteration, to_pyvista(mesh.replaced(run.points)))
    result = run.result()
    write(arguments.output, result.mesh)
    if arguments.report is not None:
        write_text(arguments.report, result.report.to_json() + "\n")
    if not arguments.quiet:
        print(result.report)
    return 0
