"""The `regularize` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from ...elements import corner_scaled_jacobian
from ...mesh import HexMesh, MixedMesh, blocks_of, collapsed_mesh, find_regions, region_arrays
from ...quality import quality
from ...regularization import Checkpoint, Options, run_on
from .arguments import (
    add_checkpoint,
    add_input,
    add_mpi,
    add_output,
    add_outputs,
    check_checkpoint,
    read_to_work_on,
)
from .choices import add_choice, add_interfaces
from .kinds import VOLUMES, MeshKind
from .results.job import run_command

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal regularize part.vtu better.vtu
  hexconformal regularize part.vtu better.vtu --hausdorff 0.01 --features keep
  hexconformal regularize part.vtu better.vtu --surface part.stl
  hexconformal regularize part.msh better.msh --boundary fixed --history run.csv --frames run.pvd
  hexconformal regularize layers.vtu better.vtu --target input --fixed wall
  hexconformal regularize part.vtu better.vtu --html report.html
  mpiexec -n 4 hexconformal regularize part.vtu better.pvtu --mpi --boundary fixed
  hexconformal regularize part.vtu better.vtu --checkpoint run.npz --resume
  hexconformal regularize part.vtu better.vtu --report report.json --plot quality.png --worst-picture worst.png
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser, "solid cells that are not linear, with keep all beside hexahedra")
    add_output(parser)
    add_mpi(parser, "OUT is a .pvtu file and a piece of each rank")
    shape = parser.add_argument_group("how the shape is kept")
    add_choice(shape, "boundary", "boundary nodes slide along the surface, stay, or go where they like")
    shape.add_argument(
        "--hausdorff", type=float, default=Options.hausdorff, metavar="X", help="how far a curved boundary may move,"
        " as a share of the bounding box's diagonal; 0: curved parts stay (default %(default)g)",
    )  # fmt: skip
    add_choice(shape, "constraint", "curved parts keep a distance, or move orthogonally to their normals")
    shape.add_argument(
        "--eps", type=float, default=Options.eps, metavar="X", help="relaxation of the compatible constraint, in"
        " squares of the mean edge (default %(default)g)",
    )  # fmt: skip
    add_choice(shape, "features", "sharp edges and corners: auto keeps them unless they are noise or stair steps")
    shape.add_argument(
        "--feature-band", type=float, default=Options.feature_band, metavar="X", help="how far sharp edges and corners"
        " that are kept may move, as a share of --hausdorff (default a fifth)",
    )  # fmt: skip
    shape.add_argument(
        "--surface", metavar="FILE", help="slide on this surface (.stl, .ply, ...), on its sharp edges and corners"
    )
    add_interfaces(shape, "faces between regions are kept")
    shape.add_argument(
        "--couplings", choices=("auto", "ignore"), default=Options.couplings, help="nodes that move together, as on"
        " periodic faces: those that the file couples, and those of parts at the same place, or none (default"
        " %(default)s)",
    )  # fmt: skip
    shape.add_argument(
        "--conserve-volume",
        action="store_true",
        help="give the result, and each of its regions, the volume of the input",
    )
    shape.add_argument(
        "--fixed", metavar="NAME", help="set or group of the file whose nodes stay, or a point array where it is not 0"
        " (three components hold x, y, z)",
    )  # fmt: skip
    what = parser.add_argument_group("what is minimized")
    what.add_argument(
        "--target", default=Options.target, metavar="auto|cube|input|A:B:C", help="perfect cell: cube, each cell's own"
        " shape in the input, a box, or cubes where the input is not stretched on purpose (default %(default)s)",
    )  # fmt: skip
    what.add_argument(
        "--sizes", default=Options.sizes, metavar="input|free|NAME", help="volumes of cells: those of the input where"
        " it is valid, any, or those in a cell array (default %(default)s)",
    )  # fmt: skip
    add_choice(what, "weight", "cells count the same, or by their volume in the input")
    add_choice(what, "energy", "conformally invariant distortion, or the quaternionic one itself")
    add_choice(what, "quadrature", "where distortion is measured")
    add_choice(what, "method", "solver; majorize is the one with frozen normals")
    add_choice(what, "emphasis", "the worst cells raised once the distortion is low, or good cells on the whole")
    what.add_argument(
        "--gradient-tolerance", type=float, default=Options.gradient_tolerance, metavar="X",
        help="stop where the gradient is this much smaller than at the start (default %(default)g)",
    )  # fmt: skip
    what.add_argument(
        "--max-iterations",
        type=int,
        default=Options.max_iterations,
        metavar="N",
        help="stop after so many (default %(default)d)",
    )
    add_outputs(parser, "the mesh before and after, cut open")
    add_checkpoint(parser)


@dataclass(frozen=True)
class RegularizeJob:
    """Regularizes a mesh, as a :class:`hexconformal.app.commands.job.Job`."""

    mesh: HexMesh | MixedMesh
    options: Options
    checkpoint: Checkpoint | None = None
    resume: bool = False

    @property
    def kind(self) -> MeshKind:
        """Volumes, drawn with the regions that the options mean."""
        return replace(VOLUMES, before_after=partial(VOLUMES.before_after, interfaces=self.options.interfaces))

    def start(self) -> Any:
        kept = self.checkpoint if self.resume else None
        return run_on(self.mesh, self.options, None if kept is None or not kept.path.exists() else kept.load())

    def keep(self, run: Any, result: Any = None) -> None:
        if self.checkpoint is not None and result is None:
            self.checkpoint.offer(run)
        elif self.checkpoint is not None:
            self.checkpoint.save(run.reached(result))

    def placeholder(self) -> HexMesh | MixedMesh:
        mesh = collapsed_mesh(self.mesh)
        zero = np.zeros(len(mesh.cells))
        of_regions = region_arrays(mesh, find_regions(mesh, self.options.interfaces))
        return self.mesh.replaced(
            point_data={"moved_by": np.zeros_like(self.mesh.points)},
            cell_data={"scaled_jacobian": zero, "scaled_jacobian_change": zero, **of_regions},
        )

    def snapshot(self, run: Any) -> HexMesh | MixedMesh:
        points = run.points
        curved = any(block.cell_type.straight for block in blocks_of(run.mesh))
        if curved:
            measured = quality(run.mesh.replaced(points)).scaled_jacobian
        else:
            measured = corner_scaled_jacobian(points, collapsed_mesh(run.mesh).cells)
        data = {"scaled_jacobian": measured}
        return run.mesh.replaced(points=points, cell_data=data)


def _options(arguments: Namespace) -> Options:
    return Options(**{field.name: getattr(arguments, field.name) for field in fields(Options)})


def run(arguments: Namespace) -> int:
    """Regularize a mesh; an interruption leaves the mesh reached so far."""
    if arguments.mpi:
        from ..on_ranks import regularize_on_ranks  # with all that ranks need, which others do not

        return regularize_on_ranks(arguments, _options)
    options = _options(arguments)

    def prepare() -> RegularizeJob:
        check_checkpoint(arguments)  # after the names of files: what is the input, or another output, is no checkpoint
        mesh, path = read_to_work_on(arguments), arguments.checkpoint
        return RegularizeJob(mesh, options, None if path is None else Checkpoint(path, mesh, options), arguments.resume)

    return run_command(arguments, VOLUMES, prepare)
