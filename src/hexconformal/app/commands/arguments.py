"""Arguments that several commands share: inputs and outputs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from ...common import MeshError, OptionError, ReadError
from ...elements import HEXAHEDRON
from ...io import SURFACES_ONLY, as_volume_mesh, read
from ...mesh import HexMesh, MixedMesh
from ..terminal import print_line
from .kinds import VOLUMES, MeshKind

__all__ = [
    "STDOUT",
    "add_checkpoint",
    "add_html",
    "add_input",
    "add_mpi",
    "add_output",
    "add_outputs",
    "add_outside_references",
    "add_overwrite",
    "check_checkpoint",
    "note_dropped",
    "read_any_mesh",
    "read_hexahedra",
    "read_to_work_on",
    "read_volume",
]

STDOUT = "-"


def add_input(parser: ArgumentParser, others: str = "tetrahedra, wedges, ... beside the hexahedra") -> None:
    """Add the mesh to read; `others` are the solid cells in it that the command does not work on."""
    parser.add_argument("input", metavar="IN", help="mesh to read; the extension tells the format")
    add_outside_references(parser)
    parser.add_argument(
        "--other-cells", default="refuse", metavar="refuse|keep", help=f"{others}: refuse the mesh"
        " (default), or keep them, their nodes staying where they are",
    )  # fmt: skip
    parser.add_argument(
        "--linearize",
        "--linearise",
        action="store_true",
        help="take cells of second order by their corners, as linear ones; what is written has straight edges",
    )


def add_outside_references(parser: ArgumentParser) -> None:
    """Add the flag that lets files name others in any folder."""
    parser.add_argument(
        "--outside-references", action="store_true", help="let IN name files outside its folder (.xdmf, .pvtu, .inp)"
    )


def add_mpi(parser: ArgumentParser, output: str) -> None:
    """Add the flag that makes a command one of all ranks; `output` says what it writes then."""
    parser.add_argument(
        "--mpi", action="store_true", help=f"work on the ranks that mpiexec has started, each on its share; {output}"
    )


def add_output(parser: ArgumentParser) -> None:
    """Add the mesh to write."""
    parser.add_argument("output", metavar="OUT", help="mesh to write; the extension tells the format")
    add_overwrite(parser)


def add_overwrite(parser: ArgumentParser) -> None:
    """Add the flag that allows replacing the input."""
    parser.add_argument("--overwrite", action="store_true", help="allow OUT to be the input file itself")


def add_outputs(parser: ArgumentParser, picture: str) -> None:
    """Add the outputs of a run besides its mesh; `picture` is the help for its picture."""
    group = parser.add_argument_group("outputs")
    group.add_argument("--history", metavar="run.csv", help="a row per iteration, there as soon as it is known")
    group.add_argument("--frames", metavar="run.pvd", help="the iterations, as a series for ParaView")
    group.add_argument("--every", type=int, default=1, metavar="K", help="a frame every K iterations (default 1)")
    group.add_argument("--report", metavar="report.json", help="before and after as JSON; - for stdout")
    group.add_argument("--plot", metavar="quality.png", help="histograms of the quality before and after")
    group.add_argument("--picture", metavar="both.png", help=picture)
    group.add_argument("--worst-picture", metavar="worst.png", help="the worst cells before and after, in their place")
    add_html(group, "before and after")
    group.add_argument("--quiet", action="store_true", help="errors only")


def add_checkpoint(parser: ArgumentParser) -> None:
    """Add the file to go on from, and the flag to do so."""
    group = parser.add_argument_group("going on later")
    group.add_argument(
        "--checkpoint", metavar="run.npz", help="what the run has reached, from time to time, at its end, and where it"
        " is interrupted",
    )  # fmt: skip
    group.add_argument("--resume", action="store_true", help="go on from the checkpoint, if it is there")


def check_checkpoint(arguments: Namespace) -> None:
    """Raise an OptionError where a run would be lost, or there is nothing to go on from."""
    if arguments.resume and arguments.checkpoint is None:
        raise OptionError("--resume must go with --checkpoint, the file to go on from")
    there = arguments.checkpoint is not None and Path(arguments.checkpoint).exists()
    if there and not (arguments.resume or arguments.overwrite):
        raise OptionError(f"{arguments.checkpoint} holds a run: --resume goes on with it, --overwrite starts anew")


def add_html(group: Any, what: str) -> None:
    """Add the page; `what` tells what it shows."""
    group.add_argument(
        "--html",
        metavar="report.html",
        help=f"{what} as a page to look at in a browser, one file that needs no network",
    )


def read_hexahedra(arguments: Namespace) -> HexMesh:
    """Read the input of a command."""
    return read(arguments.input, other_cells=arguments.other_cells, linearize=arguments.linearize)


def read_to_work_on(arguments: Namespace) -> HexMesh | MixedMesh:
    """Read the input of a command that works on linear cells, or on the hexahedra beside others that it keeps."""
    mesh = read_volume(arguments)
    alone = not isinstance(mesh, MixedMesh) or all(block.cell_type is not HEXAHEDRON for block in mesh.blocks)
    return mesh if alone or arguments.other_cells != "keep" else read_hexahedra(arguments)


def read_volume(arguments: Namespace) -> HexMesh | MixedMesh:
    """Read the input of a command for which other linear cells will do."""
    return as_volume_mesh(Path(arguments.input), other_cells=arguments.other_cells, linearize=arguments.linearize)


def note_dropped(path: str, dropped: list[str]) -> None:
    """Print what a format could not store, if anything."""
    if dropped:
        print_line(f"note: {path} does not keep {', '.join(dropped)}", error=True)


def read_any_mesh(arguments: Namespace) -> tuple[MeshKind, Any]:
    """Read a mesh of solid cells, or of triangles and quadrilaterals if there are none."""
    path = Path(arguments.input)
    if path.suffix.lower() in SURFACES_ONLY:
        return _surface(path)
    try:
        return VOLUMES, read_volume(arguments)
    except ReadError:
        raise
    except MeshError:
        try:
            return _surface(path)
        except MeshError:
            # The file holds no surface either, so the error of the volume is the one to tell.
            pass
        raise


def _surface(path: Path) -> tuple[MeshKind, Any]:
    from .surface_kind import SURFACES

    return SURFACES, SURFACES.read_like(path, None)
