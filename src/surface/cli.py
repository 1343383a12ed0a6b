"""The `remesh` command: what can be asked of it."""

from __future__ import annotations

from argparse import BooleanOptionalAction
from typing import Any

from hexconformal.cli import add_choice, add_output, add_told, command

from .commands import remesh
from .energy import ENERGIES
from .io import EXTENSIONS
from .options import EMPHASES, Options
from .reference import REFERENCES
from .step import NORMALS

__all__ = ["add_remesh"]


def add_remesh(added: Any) -> None:
    """Add the command to those of the program."""
    parser = command(
        added,
        "remesh",
        remesh,
        "Make the cells of a triangle or quad surface regular. The shape is kept, no cell turns over.",
        f"""  hexconformal remesh statue.ply better.vtu
  hexconformal remesh statue.ply better.vtu --reference flat --iterations 20 --frames run.pvd
  hexconformal remesh part.stl better.stl --hausdorff 0.002 --features 30 --history run.csv
  hexconformal remesh sheet.vtp better.vtp --boundary fixed --plot quality.png --picture both.png

formats: {" ".join(EXTENSIONS)}
""",
    )
    parser.add_argument("input", metavar="IN", help="surface to read; the extension tells the format")
    add_output(parser)
    shape = parser.add_argument_group("how the shape is kept")
    shape.add_argument(
        "--hausdorff", type=float, default=Options.hausdorff, metavar="X", help="how far the surface may move, over the"
        " diagonal of the bounding box (default %(default)g)",
    )  # fmt: skip
    shape.add_argument(
        "--features", default=Options.features, metavar="DEGREES|none", help="edges whose cells meet at more than this"
        " are sharp: their nodes stay on them (default %(default)g)",
    )  # fmt: skip
    add_choice(shape, "boundary", "nodes of open boundaries", ("slide", "fixed"), Options)
    shape.add_argument("--fixed", metavar="NAME", help="point array whose nonzero nodes stay")
    shape.add_argument(
        "--project", action=BooleanOptionalAction, default=Options.project, help="put the nodes back onto the input"
        " surface; without, the constraint alone keeps the shape (default: yes)",
    )  # fmt: skip
    what = parser.add_argument_group("what is minimized")
    what.add_argument(
        "--reference", default=Options.reference, metavar="|".join([*REFERENCES, "FILE"]), help="what the cells shall"
        " be conformal to; a file is a mesh with the same cells (default %(default)s)",
    )  # fmt: skip
    add_choice(what, "energy", "conformally invariant distortion, or the plain one", ENERGIES, Options)
    add_choice(what, "emphasis", "good cells on the whole, or the smallest angles raised", EMPHASES, Options)
    add_choice(what, "normal", "where the normal of the constraint is taken", NORMALS, Options)
    what.add_argument(
        "--eps", type=float, default=Options.eps, metavar="X", help="relaxation of the constraint, in squares of the"
        " mean edge length (default %(default)g)",
    )  # fmt: skip
    what.add_argument(
        "--tolerance", type=float, default=Options.tolerance, metavar="X", help="stop where an iteration lowers the"
        " energy by less than this, relatively (default %(default)g)",
    )  # fmt: skip
    what.add_argument("--iterations", type=int, default=Options.iterations, metavar="N", help="default %(default)d")
    add_told(parser, "the surface before and after")
