"""The `demo` command: a cube of skewed cells made regular, Figure 3 of Gruber & Aulisa; round bodies of other cells."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common import OptionError, WriteError, require_choice, write_text
from ...generate import box, curved_ball, jittered, sheared_cube, swept_cylinder
from ...io import as_volume_mesh, write
from ...mesh import HexMesh, MixedMesh, blocks_of, counts_by_type
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

EXAMPLES = """  hexconformal demo
  hexconformal demo /tmp/cube --size 30
  hexconformal demo /tmp/cylinder --mesh swept
"""


@dataclass(frozen=True)
class _Demo:
    """A mesh, and what is done with it.

    Attributes
    ----------
    make
        The mesh of a size.
    size
        Its default, cells along an edge or through the middle.
    body, before, picture
        Names of files: that of the body, which the result has after "regular_", of the input, and of the picture.
    options, words
        Those of the run, and the same on the command line.
    told
        What came of it, from the result and the size.
    """

    make: Callable[[int], HexMesh | MixedMesh]
    size: int
    body: str
    before: str
    picture: str
    options: Options
    words: str
    told: Callable[[Any, int], str]


def _shaken_cylinder(size: int) -> MixedMesh:
    mesh = swept_cylinder(core=size, layers=(size + 1) // 2, axial=2 * size)
    return MixedMesh.of_types(*jittered(*mesh, 0.8, valid=False))


def _shaken_ball(size: int) -> MixedMesh:
    points, cells = curved_ball(core=size, layers=size)
    inside = np.linalg.norm(points, axis=1) < 1.0 - 1e-9
    moves = np.random.default_rng(0).uniform(-0.12, 0.12, points.shape) / size
    return MixedMesh.of_types(points + moves * inside[:, None], cells)


def _told_of_cube(result: Any, size: int) -> str:
    distance = np.abs(result.points - box((size, size, size))[0]).max()
    return (
        f"A cube of {size}^3 skewed cells; its nodes slid in the faces. Largest distance from the regular grid: "
        f"{distance:.1e}"
    )


def _told_of_body(result: Any, what: str) -> str:
    counts = counts_by_type(blocks_of(as_volume_mesh(result.mesh)))
    before, after = result.report.before.invalid, result.report.after.invalid
    return f"{what} of {counts}, its nodes inside shaken: {before} cells were invalid, {after} are."


DEMOS = {
    "cube": _Demo(
        lambda size: HexMesh(*sheared_cube(size)),
        15,
        "cube",
        "sheared_cube",
        "figure3",
        Options(gradient_tolerance=_TOLERANCE),
        f"--gradient-tolerance {_TOLERANCE:g}",
        _told_of_cube,
    ),
    "swept": _Demo(
        _shaken_cylinder,
        4,
        "cylinder",
        "shaken_cylinder",
        "cut_open",
        Options(),
        "",
        lambda result, size: _told_of_body(result, "A cylinder"),
    ),
    "curved": _Demo(
        _shaken_ball,
        3,
        "ball",
        "shaken_ball",
        "cut_open",
        Options(boundary="fixed"),
        "--boundary fixed",
        lambda result, size: _told_of_body(result, "A ball"),
    ),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("folder", nargs="?", default="hexconformal-demo", metavar="FOLDER", help="default %(default)s")
    parser.add_argument(
        "--mesh", default="cube", metavar="cube|swept|curved", help="a sheared cube; a tangled cylinder of wedges and"
        " hexahedra; or a tangled ball of quadratic hexahedra (default %(default)s)",
    )  # fmt: skip
    sizes = ", ".join(f"{demo.size} of {name}" for name, demo in DEMOS.items())
    parser.add_argument("--size", type=int, metavar="N", help=f"cells along an edge, or inside (default {sizes})")


def run(arguments: Namespace) -> int:
    """Make a mesh regular and print what was done."""
    require_choice("mesh", arguments.mesh, tuple(DEMOS))
    demo = DEMOS[arguments.mesh]
    size = demo.size if arguments.size is None else arguments.size
    with Progress() as progress:
        finished, lines = _run_demo(demo, arguments.folder, size, progress)
    print_text(finished.result.report)
    print_text("\n".join(["", *lines]))
    return exit_code_of(finished, arguments.folder)


def _run_demo(
    demo: _Demo, folder: str | os.PathLike[str], size: int, progress: Progress
) -> tuple[FinishedJob, list[str]]:
    """Regularize a mesh and leave meshes, a page, a series for ParaView, pictures and reports in a folder.

    Parameters
    ----------
    demo
        The mesh.
    folder
        The folder, made if it is missing. Files of an earlier demo are replaced.
    size
        Of the mesh.
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
    missing, before, after = _missing_picture(demo), f"{demo.before}.vtu", f"regular_{demo.body}.vtu"
    outputs = Outputs(
        mesh=str(folder / after),
        extensions=(".vtu",),
        history=str(folder / "history.csv"),
        frames=str(folder / "run.pvd"),
        report=str(folder / "report.json"),
        plot=str(folder / "quality.png"),
        picture=None if missing else str(folder / f"{demo.picture}.png"),
        html=str(folder / "report.html"),
    )
    outputs.check()
    source = folder / before
    write(source, demo.make(size))
    finished = run_job(RegularizeJob(as_volume_mesh(source), demo.options), outputs, progress)
    write_text(folder / "report.txt", f"{finished.result.report}\n")
    files = {
        f"{before}, {after}": "the mesh before and after",
        "report.html": "to look at in a browser",
        "run.pvd": "all iterations, for ParaView",
        f"{demo.picture}.png": "cut open, before and after",
        "quality.png, history.csv": "histograms, a row per iteration",
        "report.txt, report.json": "what became better",
    }
    if missing:
        del files[f"{demo.picture}.png"]
    lines = [f"  {names:<44}{what}" for names, what in files.items()] + [missing] * bool(missing)
    words = f" {demo.words}" if demo.words else ""
    by_hand = f"  hexconformal regularize {source} regular.vtu{words}"
    return finished, [demo.told(finished.result, size), f"{folder}:", *lines, "The same by hand:", by_hand]


def _missing_picture(demo: _Demo) -> str:
    try:
        require_rendering()
    except WriteError as problem:
        return f"  (no {demo.picture}.png: {problem})"
    return ""
