"""The command line: what can be asked, and how it ends."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, BooleanOptionalAction, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from typing import Any

from . import commands
from .errors import MeshError, OptionError, WriteError
from .interrupt import interruptible
from .io import READ_EXTENSIONS, WRITE_EXTENSIONS
from .options import CHOICES, Options
from .version import __version__

__all__ = ["add_choice", "add_output", "add_told", "command", "main"]

_EXIT_CODES = """exit codes:
  0    done; a run that stops before its tolerance says why, and counts as done
  1    the mesh cannot be worked on, or a file cannot be read or written
  2    the command line makes no sense
  130  interrupted (Ctrl-C or SIGTERM); `regularize` and `remesh` have written the mesh they had reached
"""


_FORMATS = f"""formats:
  read     {" ".join(READ_EXTENSIONS[:14])}
           {" ".join(READ_EXTENSIONS[14:])}
  written  {" ".join(WRITE_EXTENSIONS)}
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        Words after the program's name; default those it was started with.

    Returns
    -------
    The exit code: 0 done, 1 a mesh or file that cannot be used, 2 wrong usage, 130 interrupted.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal import HexMesh, write
    >>> write("box.vtu", HexMesh(*box((2, 2, 2))))
    []
    >>> main(["check", "box.vtu"])
    box.vtu: 8 hexahedra, 27 points, 0 inverted, 0 invalid
    sound
    0
    """
    parser = _parser()
    try:
        parsed = parser.parse_args(arguments)
    except SystemExit as ending:
        return int(ending.code or 0)
    try:
        with interruptible():
            return int(parsed.run(parsed))
    except KeyboardInterrupt:
        return _failed("interrupted: nothing was written", 130)
    except OptionError as problem:
        return _failed(f"error: {problem}", 2)
    except (MeshError, WriteError) as problem:
        return _failed(f"error: {problem}", 1)
    except MemoryError:
        return _failed("error: not enough memory for this mesh", 1)
    except BrokenPipeError:
        # Whoever read our output has had enough; Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _failed(message: str, code: int) -> int:
    print(" ".join(message.split()), file=sys.stderr)
    return code


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="hexconformal",
        description="Make hexahedral meshes, and surfaces, regular by minimizing quaternionic conformal distortion.",
        epilog=f"{_FORMATS}\n{_EXIT_CODES}\n`hexconformal COMMAND --help` shows options and examples.",
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"hexconformal {__version__}")
    added = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    # Surfaces have a package of their own, which builds on this module.
    from surface.cli import add_remesh
    from surface.flow.cli import add_flow

    for add in (_add_regularize, add_remesh, add_flow, _add_move, _add_quality, _add_orient, _add_check, _add_demo):
        add(added)
    return parser


def command(added: Any, name: str, run: Callable[[Namespace], int], summary: str, examples: str) -> ArgumentParser:
    """Add a command, what it runs, and its help."""
    parser: ArgumentParser = added.add_parser(
        name,
        help=summary[0].lower() + summary[1:].partition(".")[0],
        description=summary,
        epilog=f"examples:\n{examples}",
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(run=run)
    return parser


def _add_input(parser: ArgumentParser) -> None:
    parser.add_argument("input", metavar="IN", help="mesh to read; the extension tells the format")
    parser.add_argument(
        "--other-cells", default="refuse", metavar="refuse|keep", help="tetrahedra, wedges, ... beside the hexahedra:"
        " refuse the mesh (default), or keep them, their nodes staying where they are",
    )  # fmt: skip
    parser.add_argument("--linearise", action="store_true", help="take the corners of hexahedra of 20 or 27 nodes")


def add_output(parser: ArgumentParser) -> None:
    """Add the mesh to write."""
    parser.add_argument("output", metavar="OUT", help="mesh to write; the extension tells the format")
    _add_overwrite(parser)


def _add_overwrite(parser: ArgumentParser) -> None:
    parser.add_argument("--overwrite", action="store_true", help="allow OUT to be the input file itself")


def _add_regularize(added: Any) -> None:
    parser = command(
        added,
        "regularize",
        commands.regularize,
        "Make the cells of a hexahedral mesh regular. Inverted cells are unfolded, valid ones stay valid.",
        """  hexconformal regularize part.vtu better.vtu
  hexconformal regularize part.vtu better.vtu --hausdorff 0.01 --features keep
  hexconformal regularize part.vtu better.vtu --surface part.stl
  hexconformal regularize part.msh better.msh --boundary fixed --history run.csv --frames run.pvd
  hexconformal regularize layers.vtu better.vtu --target input --fixed wall
  hexconformal regularize part.vtu better.vtu --report report.json --plot quality.png --worst-picture worst.png
""",
    )
    _add_input(parser)
    add_output(parser)
    shape = parser.add_argument_group("how the shape is kept")
    add_choice(shape, "boundary", "boundary nodes slide along the surface, stay, or go where they like")
    shape.add_argument(
        "--hausdorff", type=float, default=Options.hausdorff, metavar="X", help="how far a curved boundary may move,"
        " over the diagonal of the bounding box; 0: curved parts stay (default %(default)g)",
    )  # fmt: skip
    add_choice(shape, "features", "sharp edges and corners: auto keeps them unless they are noise or stair steps")
    shape.add_argument("--surface", metavar="FILE", help="slide on this surface, which may be finer (.stl, .ply, ...)")
    shape.add_argument("--conserve-volume", action="store_true", help="give the result the volume of the input")
    shape.add_argument(
        "--fixed", metavar="NAME", help="point array whose nonzero nodes stay besides; three components hold x, y, z"
    )
    what = parser.add_argument_group("what is minimized")
    what.add_argument(
        "--target", default=Options.target, metavar="auto|cube|input|A:B:C", help="perfect cell: cube, each cell's own"
        " shape in the input, a box, or cubes where the input is not stretched on purpose (default %(default)s)",
    )  # fmt: skip
    what.add_argument(
        "--sizes", default=Options.sizes, metavar="input|free|NAME", help="volumes of cells: those of the input where"
        " it is valid, any, or a cell array with the wanted ones (default %(default)s)",
    )  # fmt: skip
    add_choice(what, "weight", "cells count the same, or by their volume in the input")
    add_choice(what, "energy", "conformally invariant distortion, or the plain one")
    add_choice(what, "quadrature", "where distortion is measured")
    add_choice(what, "method", "solver; majorize needs the plain energy")
    what.add_argument(
        "--lift",
        action=BooleanOptionalAction,
        default=Options.lift,
        help="raise the worst cells once the distortion is low (default: with the barrier)",
    )
    what.add_argument(
        "--tolerance", type=float, default=Options.tolerance, metavar="X",
        help="stop where the gradient is this much smaller than at the start (default %(default)g)",
    )  # fmt: skip
    what.add_argument(
        "--max-iterations", type=int, default=Options.max_iterations, metavar="N", help="default %(default)d"
    )
    add_told(parser, "the mesh before and after, cut open")


def add_told(parser: ArgumentParser, picture: str) -> None:
    """Add what a run can leave behind besides its mesh; `picture` says what is in that."""
    told = parser.add_argument_group("what is told")
    told.add_argument("--history", metavar="run.csv", help="a row per iteration, there as soon as it is known")
    told.add_argument("--frames", metavar="run.pvd", help="the iterations, as a series for ParaView")
    told.add_argument("--every", type=int, default=1, metavar="K", help="a frame every K iterations (default 1)")
    told.add_argument("--report", metavar="report.json", help="before and after as JSON; - for stdout")
    told.add_argument("--plot", metavar="quality.png", help="histograms of the quality before and after")
    told.add_argument("--picture", metavar="both.png", help=picture)
    told.add_argument("--worst-picture", metavar="worst.png", help="the worst cells before and after, in their place")
    told.add_argument("--quiet", action="store_true", help="errors only")


def add_choice(group: Any, name: str, text: str, choices: Sequence[str] = (), options: type = Options) -> None:
    """Add an option of which `options` has the default, and refuses other values with the same words as in Python."""
    default = getattr(options, name)
    metavar = "|".join(choices or CHOICES[name])
    group.add_argument(f"--{name}", default=default, metavar=metavar, help=f"{text} (default {default})")


def _add_move(added: Any) -> None:
    parser = command(
        added,
        "move",
        commands.move,
        "Move a mesh with its boundary, step after step. Writes frames with the mesh velocity, a history and a"
        " checkpoint after every step into a folder; ends with exit code 1 where the boundary asks for the impossible.",
        """  hexconformal move box.vtu run/ --boundary motion.csv
  hexconformal move box.vtu run/ --boundary motion.csv --fixed wall --operator elastic
  hexconformal move box.vtu run/ --boundary longer.csv --resume

motion.csv: a header, then a row per step (or time, from 0) and node; displacements from the initial place
  time,node,dx,dy,dz
  0.1,17,0.0,0.02,0.0
in the folder: run.pvd (frames for ParaView), history.csv, last.vtu, checkpoint.npz
""",
    )
    _add_input(parser)
    parser.add_argument("folder", metavar="FOLDER", help="where to write; it is made if it is not there")
    parser.add_argument("--boundary", metavar="motion.csv", required=True, help="where the moving nodes go")
    parser.add_argument("--fixed", metavar="NAME", help="point array whose nonzero nodes stay; others slide on walls")
    parser.add_argument(
        "--operator", default="conformal", metavar="conformal|harmonic|elastic", help="default %(default)s"
    )
    parser.add_argument(
        "--reference", default="initial", metavar="initial|current", help="what cells shall look like (default initial)"
    )
    parser.add_argument("--frames", metavar="run.pvd", help="the series, if not FOLDER/run.pvd")
    parser.add_argument("--every", type=int, default=1, metavar="K", help="a frame every K steps (default 1)")
    parser.add_argument("--resume", action="store_true", help="go on with the run in FOLDER")
    parser.add_argument("--overwrite", action="store_true", help="start anew in FOLDER if it holds a run")
    parser.add_argument("--quiet", action="store_true", help="errors only")


def _add_quality(added: Any) -> None:
    parser = command(
        added,
        "quality",
        commands.quality,
        "Measure every cell of a hexahedral mesh (its validity, det J > 0 everywhere, is certified) or of a surface.",
        """  hexconformal quality part.vtu
  hexconformal quality part.vtu --plot quality.png
  hexconformal quality part.vtu --worst 20 --picture worst.png
  hexconformal quality part.vtu --json - | jq .scaled_jacobian.min
  hexconformal quality part.msh --out measured.vtu
  hexconformal quality statue.ply --plot quality.png
""",
    )
    _add_input(parser)
    parser.add_argument("--json", metavar="FILE", help="write the summary as JSON; - for stdout")
    parser.add_argument("--plot", metavar="quality.png", help="draw histograms")
    parser.add_argument("--picture", metavar="worst.png", help="draw the worst cells in their place")
    parser.add_argument("--worst", type=int, default=5, metavar="N", help="name the N worst cells (default 5)")
    parser.add_argument("--out", dest="output", metavar="FILE", help="write the mesh with the measures as cell arrays")
    _add_overwrite(parser)


def _add_orient(added: Any) -> None:
    parser = command(
        added,
        "orient",
        commands.orient,
        "Put mirrored cells, or cells in a foreign node order, into VTK's order. No point moves.",
        "  hexconformal orient mirrored.msh sound.msh\n",
    )
    _add_input(parser)
    add_output(parser)


def _add_check(added: Any) -> None:
    parser = command(
        added,
        "check",
        commands.check,
        "Tell whether a mesh can be worked on, and what is doubtful about it. Exit code 1 if it cannot.",
        "  hexconformal check part.vtu\n",
    )
    _add_input(parser)


def _add_demo(added: Any) -> None:
    parser = command(
        added,
        "demo",
        commands.demo,
        "Make a cube of skewed cells regular. Leaves meshes, a ParaView series, a picture and a report in a folder.",
        "  hexconformal demo\n  hexconformal demo /tmp/cube --size 30\n",
    )
    parser.add_argument("folder", nargs="?", default="hexconformal-demo", metavar="FOLDER", help="default %(default)s")
    parser.add_argument("--size", type=int, default=15, metavar="N", help="cells along an edge (default %(default)d)")
