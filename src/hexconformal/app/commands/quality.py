"""The `quality` command: of hexahedra, and of surfaces where there are none."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import surface

from ...common import MeshError, OptionError, ReadError, check_writable, unusable_points, write_text
from ...io import READ_EXTENSIONS
from ..progress import Progress
from .arguments import STDOUT, add_input, add_overwrite, command, mesh_of, tell_lost
from .kind import VOLUMES, Kind
from .outputs import check_pictures, check_places
from .surface_kind import SURFACES

__all__ = ["add_quality", "any_mesh"]


def add_quality(added: Any) -> None:
    """Add the command to those of the program."""
    parser = command(
        added,
        "quality",
        _quality,
        "Measure every cell of a hexahedral mesh (its validity, det J > 0 everywhere, is certified) or of a surface.",
        """  hexconformal quality part.vtu
  hexconformal quality part.vtu --plot quality.png
  hexconformal quality part.vtu --worst 20 --picture worst.png
  hexconformal quality part.vtu --json - | jq .scaled_jacobian.min
  hexconformal quality part.msh --out measured.vtu
  hexconformal quality statue.ply --plot quality.png
""",
    )
    add_input(parser)
    parser.add_argument("--json", metavar="FILE", help="write the summary as JSON; - for stdout")
    parser.add_argument("--plot", metavar="quality.png", help="draw histograms")
    parser.add_argument("--picture", metavar="worst.png", help="draw the worst cells in their place")
    parser.add_argument("--worst", type=int, default=5, metavar="N", help="name the N worst cells (default 5)")
    parser.add_argument("--out", dest="output", metavar="FILE", help="write the mesh with the measures as cell arrays")
    add_overwrite(parser)


def _quality(arguments: Namespace) -> int:
    """Measure a mesh, or a surface where there are no hexahedra."""
    if arguments.worst < 0:
        raise OptionError(f"worst must be 0 or more, not {arguments.worst}")
    to_file = None if arguments.json == STDOUT else arguments.json
    check_places([arguments.output, to_file, arguments.plot, arguments.picture], arguments.input, arguments.overwrite)
    check_pictures(arguments.plot, arguments.picture)
    with Progress() as progress:
        progress.say(f"measuring {arguments.input}")
        kind, mesh = any_mesh(arguments)
        odd, text = unusable_points(mesh.points)
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
        lost = []
        if arguments.output is not None:
            lost = kind.write(arguments.output, mesh.replaced(cell_data=kind.arrays(measured)))
        if to_file is not None:
            write_text(to_file, summary.to_json() + "\n")
    if arguments.json == STDOUT:
        print(summary.to_json())
    else:
        print(summary)
        if summary.worst:
            print(f"worst cells (id, {kind.worst_by.replace('_', ' ')}, centre)")
        for cell in summary.worst:
            centre = ", ".join(f"{x:.6g}" for x in cell.centre)
            print(f"{cell.id:>10d} {getattr(cell, kind.worst_by):>10.5f}  ({centre})")
    tell_lost(arguments.output, lost)
    return 0


def any_mesh(arguments: Namespace) -> tuple[Kind, Any]:
    """A mesh of hexahedra, or of triangles and quadrilaterals if there are none."""
    extension = Path(arguments.input).suffix.lower()
    is_surface_file = extension in SURFACES.extensions
    if is_surface_file and extension not in READ_EXTENSIONS:
        return SURFACES, surface.read(arguments.input)
    try:
        return VOLUMES, mesh_of(arguments)
    except ReadError:
        raise
    except MeshError:
        if not is_surface_file:
            raise
        try:
            return SURFACES, surface.read(arguments.input)
        except MeshError:
            # No surface either: what was said of the volume stands.
            pass
        raise
