"""What commands share: how they are added, their input and output, and what they tell."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from typing import Any

from ...io import read
from ...mesh import HexMesh
from ...regularization import CHOICES, Options

__all__ = ["STDOUT", "add_choice", "add_input", "add_output", "add_outputs", "add_overwrite", "command"]
__all__ += ["mesh_of", "tell_lost"]

STDOUT = "-"


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


def add_input(parser: ArgumentParser) -> None:
    """Add the hexahedral mesh to read."""
    parser.add_argument("input", metavar="IN", help="mesh to read; the extension tells the format")
    parser.add_argument(
        "--other-cells", default="refuse", metavar="refuse|keep", help="tetrahedra, wedges, ... beside the hexahedra:"
        " refuse the mesh (default), or keep them, their nodes staying where they are",
    )  # fmt: skip
    parser.add_argument("--linearise", action="store_true", help="take the corners of hexahedra of 20 or 27 nodes")


def add_output(parser: ArgumentParser) -> None:
    """Add the mesh to write."""
    parser.add_argument("output", metavar="OUT", help="mesh to write; the extension tells the format")
    add_overwrite(parser)


def add_overwrite(parser: ArgumentParser) -> None:
    """Add the leave to replace the input."""
    parser.add_argument("--overwrite", action="store_true", help="allow OUT to be the input file itself")


def add_choice(group: Any, name: str, text: str, choices: Sequence[str] = (), options: type = Options) -> None:
    """Add an option of which `options` has the default, and refuses other values with the same words as in Python."""
    default = getattr(options, name)
    metavar = "|".join(choices or CHOICES[name])
    group.add_argument(f"--{name}", default=default, metavar=metavar, help=f"{text} (default {default})")


def add_outputs(parser: ArgumentParser, picture: str) -> None:
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


def mesh_of(arguments: Namespace) -> HexMesh:
    """The input of a command."""
    return read(arguments.input, other_cells=arguments.other_cells, linearise=arguments.linearise)


def tell_lost(path: str, lost: list[str]) -> None:
    """Say what a format could not keep."""
    if lost:
        print(f"note: {path} does not keep {', '.join(lost)}", file=sys.stderr)
