"""The `demo` command: a cube of skewed cells made perfectly regular, Figure 3 of Gruber & Aulisa."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np

from ...common import OptionError, WriteError, write_text
from ...generate import box, sheared_cube
from ...io import read, write
from ...mesh import HexMesh
from ...plots import require_rendering
from ...regularization import Options
from ..progress import Progress
from ..terminal import print_text
from .regularize import RegularizeJob
from .results.job import FinishedJob, exit_code_of, run_job
from .results.outputs import Outputs

__all__ = ["EXAMPLES", "add_arguments", "run"]

_TOLERANCE = 1e-12
_LARGEST = 1000

EXAMPLES = "  hexconformal demo\n  hexconformal demo /tmp/cube --size 30\n"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("folder", nargs="?", default="hexconformal-demo", metavar="FOLDER", help="default %(default)s")
    parser.add_argument("--size", type=int, default=15, metavar="N", help="cells along an edge (default %(default)d)")


def run(arguments: Namespace) -> int:
    """Make a sheared cube regular and print what was done."""
    with Progress() as progress:
        finished, lines = _run_demo(arguments.folder, arguments.size, progress)
    print_text(finished.result.report)
    print_text("\n".join(["", *lines]))
    return exit_code_of(finished, arguments.folder)


def _run_demo(folder: str | os.PathLike[str], size: int, progress: Progress) -> tuple[FinishedJob, list[str]]:
    """Regularize a sheared cube and leave meshes, a series for ParaView, pictures and reports in a folder.

    Parameters
    ----------
    folder
        The folder, made if it is missing. Files of an earlier demo are replaced.
    size
        Cells along an edge.
    progress
        Shows what goes on.

    Returns
    -------
    finished
        The run.
    lines
        A text that says what was done and which files there are.

    Raises
    ------
    OptionError
        If there is nothing to see: fewer than two cells along an edge; or too many for any machine.
    WriteError
        If the folder cannot be made or written to.
    """
    if not 2 <= size <= _LARGEST:
        raise OptionError(f"size must be 2 to {_LARGEST} cells along an edge, not {size}")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise WriteError(f"cannot make the folder {folder}: {problem}") from problem
    missing = _missing_picture()
    outputs = Outputs(
        mesh=str(folder / "regular_cube.vtu"),
        extensions=(".vtu",),
        history=str(folder / "history.csv"),
        frames=str(folder / "run.pvd"),
        report=str(folder / "report.json"),
        plot=str(folder / "quality.png"),
        picture=None if missing else str(folder / "figure3.png"),
    )
    outputs.check()
    source = folder / "sheared_cube.vtu"
    write(source, HexMesh(*sheared_cube(size)))
    finished = run_job(RegularizeJob(read(source), Options(gradient_tolerance=_TOLERANCE)), outputs, progress)
    write_text(folder / "report.txt", f"{finished.result.report}\n")
    distance = np.abs(finished.result.points - box((size, size, size))[0]).max()
    lines = [
        f"A cube of {size}^3 skewed cells; its nodes slid in the faces. Largest distance from the regular grid: "
        f"{distance:.1e}",
        f"{folder}:",
        "  sheared_cube.vtu, regular_cube.vtu  the mesh before and after",
        "  run.pvd                             all iterations, for ParaView",
        missing or "  figure3.png                         cut open, before and after",
        "  quality.png, history.csv            histograms, a row per iteration",
        "  report.txt, report.json             what became better",
        "The same by hand:",
        f"  hexconformal regularize {source} regular.vtu --gradient-tolerance {_TOLERANCE:g}",
    ]
    return finished, lines


def _missing_picture() -> str:
    try:
        require_rendering()
    except WriteError as problem:
        return f"  (no figure3.png: {problem})"
    return ""
