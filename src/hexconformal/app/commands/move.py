"""The `move` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from typing import Any

from ...common import OptionError, agreed
from ...motion import BoundaryMotion, MeshMotion, MotionRun, read_motion
from ...page import ReportText
from ...ranks import are_nodes_numbered, on_every_machine, read_piece
from ...runs import RunFolder
from ..progress import Progress
from ..terminal import print_line
from .arguments import add_html, add_input, add_mpi, read_to_work_on
from .choices import add_interfaces
from .kinds import VOLUMES
from .results.outputs import check_page, named_inputs
from .results.pages import page_of_series

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal move box.vtu run/ --motion motion.csv
  hexconformal move box.vtu run/ --motion motion.csv --fixed wall --operator elastic
  hexconformal move box.vtu run/ --motion longer.csv --resume
  hexconformal move box.vtu run/ --motion motion.csv --html motion.html
  mpiexec -n 4 hexconformal move box.vtu run/ --motion motion.csv --mpi

motion.csv: a header, then a row per step (or time, from 0) and node; displacements from the initial place;
nodes by the labels that the file gives them, or from 0
  time,node,dx,dy,dz
  0.1,17,0.0,0.02,0.0
in the folder: run.pvd (frames for ParaView), history.csv, last.vtu, checkpoint.npz
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser, "solid cells that are not linear, with keep all beside hexahedra")
    parser.add_argument("folder", metavar="FOLDER", help="where to write; it is made if it is not there")
    parser.add_argument("--motion", metavar="motion.csv", required=True, help="table of where the moving nodes go")
    parser.add_argument(
        "--moving", metavar="NAME", help="set or group of the file, or point array, whose nodes all go as the table"
        " says, which has no column node then",
    )  # fmt: skip
    parser.add_argument(
        "--fixed", metavar="NAME", help="set or group of the file, or point array, whose nodes stay; others slide on"
        " walls",
    )  # fmt: skip
    parser.add_argument(
        "--operator",
        default="conformal",
        metavar="conformal|harmonic|elastic",
        help="how the displacement of the boundary is extended into the mesh (default %(default)s)",
    )
    parser.add_argument(
        "--target", default="input", metavar="input|current", help="perfect shape of the cells (default %(default)s)"
    )
    parser.add_argument(
        "--energy-tolerance", type=float, default=1e-6, metavar="X", help="a step is done where an iteration lowers the"
        " energy by less than this, relatively (default %(default)g)",
    )  # fmt: skip
    add_interfaces(parser, "faces between regions move as the displacement is extended, not to where cells are best")
    parser.add_argument("--frames", metavar="run.pvd", help="the series, if not FOLDER/run.pvd")
    parser.add_argument("--every", type=int, default=1, metavar="K", help="a frame every K steps (default 1)")
    parser.add_argument("--resume", action="store_true", help="go on with the run in FOLDER")
    parser.add_argument("--overwrite", action="store_true", help="start anew in FOLDER, whatever is in it")
    add_html(parser, "the frames with the quality of each step")
    parser.add_argument("--quiet", action="store_true", help="errors only")
    add_mpi(parser, "frames and last.pvtu are .pvtu files and a piece of each rank")


def run(arguments: Namespace) -> int:
    """Move a mesh with its boundary."""
    if arguments.mpi:
        from ..on_ranks import on_all_ranks  # with all that ranks need, which others do not

        return on_all_ranks(arguments, partial(_move_on_ranks, arguments))
    return _move(arguments)


def _move_on_ranks(arguments: Namespace, comm: Any) -> int:
    from ..on_ranks import finished_first, refuse

    refuse(arguments.html is not None, "--html")
    refuse(arguments.other_cells != "refuse", "--other-cells keep")
    refuse(arguments.linearize, "--linearize")
    with finished_first():
        return _move(arguments, comm)


def _read_boundary(arguments: Namespace, comm: Any) -> BoundaryMotion:
    """The table; on ranks the first reads it, and it is in memory once for each machine."""
    if comm is None:
        return read_motion(arguments.motion)
    boundary = None
    with agreed(comm, named=False):
        if comm.rank == 0:
            boundary = read_motion(arguments.motion)
            if boundary.nodes is not None and not are_nodes_numbered(arguments.input):
                raise OptionError(
                    "on ranks a table that names nodes must go with a .vtu file, or a .pvtu file with the array "
                    f"GlobalNodeId, not {arguments.input}: name the nodes by --moving, or write the mesh as .vtu"
                )
    return on_every_machine(comm, boundary)


def _move(arguments: Namespace, comm: Any = None) -> int:
    with agreed(comm, named=False):
        if arguments.every < 1:
            raise OptionError(f"every must be 1 or more, not {arguments.every}")
        inputs = named_inputs(arguments.input) | {Path(arguments.motion): "the table of the motion"}
    boundary = _read_boundary(arguments, comm)
    series = None if arguments.frames is None else Path(arguments.frames)
    folder = RunFolder(Path(arguments.folder), series, comm)
    folder.prepare(arguments.resume, arguments.overwrite, inputs)
    check_page(arguments.html, inputs)
    last: list[str] = []
    speaks = comm is None or comm.rank == 0
    with Progress(arguments.quiet or not speaks) as progress:

        def show(line: str) -> None:
            last[:] = [line]
            progress.show(line)

        progress.show(f"reading {arguments.input}")
        mesh = read_to_work_on(arguments) if comm is None else read_piece(arguments.input, comm)
        boundary = boundary.on_mesh(mesh, arguments.moving, comm)
        motion = MeshMotion(
            mesh,
            boundary.nodes,
            arguments.fixed,
            arguments.target,
            arguments.operator,
            arguments.energy_tolerance,
            arguments.interfaces,
            comm=comm,
        )
        motion_run = MotionRun(motion, boundary)
        stopped = folder.follow(motion_run, arguments.resume, arguments.every, show)
        if arguments.html is not None:
            progress.show(f"writing {arguments.html}")
            told = ReportText("\n".join([*last, *([motion_run.refusal] if motion_run.refusal else [])]), motion.notes)
            title = Path(arguments.input).name
            page = page_of_series(folder.frames, VOLUMES, folder.history, told, title, arguments.interfaces)
            page.write(arguments.html)
    if speaks and not arguments.quiet:
        for line in [*(f"note: {note}" for note in motion.notes), *last]:
            print_line(line)
        names = [folder.history.name, folder.last.name]
        print_line(f"wrote {', '.join([str(folder.frames), *names, *filter(None, [arguments.html])])}")
    if stopped is not None:
        if speaks:
            print_line(f"interrupted after step {motion_run.step}: --resume goes on from there", error=True)
        return 130
    if motion_run.refusal:
        if speaks:
            print_line(f"error: step {motion_run.step + 1} was refused: {motion_run.refusal}", error=True)
        return 1
    return 0
