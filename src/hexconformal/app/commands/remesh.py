"""The `remesh` command."""

from __future__ import annotations

import os
from argparse import ArgumentParser, BooleanOptionalAction, Namespace
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from surface.constraint import NORMALS
from surface.energy import ENERGIES, TARGETS
from surface.io import EXTENSIONS, as_pyvista, read
from surface.mesh import SurfaceMesh
from surface.quality import smallest_angles
from surface.remeshing import EMPHASES, Options, Remeshing

from ...common import OptionError
from .arguments import add_output, add_outputs, add_outside_references
from .choices import add_choice, add_interfaces
from .results.job import run_command
from .surface_kind import SURFACES

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = f"""  hexconformal remesh statue.ply better.vtu
  hexconformal remesh statue.ply better.vtu --target flat --max-iterations 20 --frames run.pvd
  hexconformal remesh part.stl better.stl --hausdorff 0.002 --feature-angle 30 --history run.csv
  hexconformal remesh sheet.vtp better.vtp --boundary fixed --plot quality.png --picture both.png
  hexconformal remesh statue.ply better.vtu --html report.html

formats: {" ".join(EXTENSIONS)}
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("input", metavar="IN", help="surface to read; the extension tells the format")
    add_outside_references(parser)
    add_output(parser)
    shape = parser.add_argument_group("how the shape is kept")
    shape.add_argument(
        "--hausdorff", type=float, default=Options.hausdorff, metavar="X", help="how far the surface may move, as a"
        " share of the bounding box's diagonal, where nodes are put back onto it (default %(default)g)",
    )  # fmt: skip
    shape.add_argument(
        "--feature-angle", default=Options.feature_angle, metavar="DEGREES|none", help="edges whose cells meet at more"
        " than this are sharp: their nodes stay on them (default %(default)g)",
    )  # fmt: skip
    add_interfaces(shape, "lines between regions are kept")
    add_choice(shape, "boundary", "nodes of open boundaries", ("slide", "fixed"), Options)
    shape.add_argument(
        "--fixed", metavar="NAME", help="set or group of the file whose nodes stay, or a point array where it is not 0"
    )
    shape.add_argument(
        "--project", action=BooleanOptionalAction, default=Options.project, help="put the nodes back onto the input"
        " surface; without, the constraint alone keeps the shape (default: yes)",
    )  # fmt: skip
    what = parser.add_argument_group("what is minimized")
    what.add_argument(
        "--target", default=Options.target, metavar="|".join([*TARGETS, "FILE"]), help="perfect shape of the cells;"
        " a file is a mesh with the same cells (default %(default)s)",
    )  # fmt: skip
    add_choice(what, "energy", "conformally invariant distortion, or the quaternionic one itself", ENERGIES, Options)
    add_choice(what, "emphasis", "good cells on the whole, or the smallest angles raised", EMPHASES, Options)
    add_choice(what, "normal", "where the normal of the constraint is taken", NORMALS, Options)
    what.add_argument(
        "--eps", type=float, default=Options.eps, metavar="X", help="relaxation of the constraint, in squares of the"
        " mean edge length (default %(default)g)",
    )  # fmt: skip
    what.add_argument(
        "--energy-tolerance", type=float, default=Options.energy_tolerance, metavar="X", help="stop where an iteration"
        " lowers the energy by less than this, relatively (default %(default)g)",
    )  # fmt: skip
    what.add_argument(
        "--max-iterations", type=int, default=Options.max_iterations, metavar="N", help="stop after so many (default"
        " %(default)d)",
    )  # fmt: skip
    add_outputs(parser, "the surface before and after")


def run(arguments: Namespace) -> int:
    """Remesh a surface; an interruption leaves the surface reached so far."""
    known = {
        name: value for name, value in vars(arguments).items() if name in {field.name for field in fields(Options)}
    }
    options = Options(
        **{**known, "feature_angle": _angle(arguments.feature_angle), "target": _target(arguments.target)}
    )

    return run_command(arguments, SURFACES, lambda: RemeshJob(read(arguments.input), options))


@dataclass(frozen=True)
class RemeshJob:
    """Remeshes a surface, as a :class:`hexconformal.app.commands.job.Job`."""

    mesh: SurfaceMesh
    options: Options
    kind = SURFACES

    def start(self) -> Remeshing:
        return Remeshing(self.mesh, self.options)

    def placeholder(self) -> SurfaceMesh:
        zero = np.zeros(len(self.mesh.cells))
        return self.mesh.replaced(cell_data={"min_angle": zero, "min_angle_change": zero})

    def snapshot(self, run: Any) -> Any:
        points = run.points
        return as_pyvista(self.mesh.replaced(points, cell_data={"min_angle": smallest_angles(points, self.mesh.cells)}))

    def keep(self, run: Remeshing, result: Any = None) -> None:
        """Nothing: a run begins with any surface, as with this one."""


def _angle(given: Any) -> float | None:
    if given == "none":
        return None
    try:
        return float(given)
    except ValueError as problem:
        raise OptionError(f"feature_angle must be an angle in degrees, or none, not {given!r}") from problem


def _target(given: str) -> Any:
    """A name, or the points of a mesh in a file."""
    return given if given in TARGETS or not os.path.splitext(given)[1] else read(given).points
