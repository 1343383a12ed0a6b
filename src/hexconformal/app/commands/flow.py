"""The `flow` command."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path

from surface.flow import Evolution, Flow, FlowRun, Helfrich, MeanCurvature, PWillmore, Stepping, Willmore
from surface.plots import plot_history

from ...common import OptionError, json_safe
from ...page import ReportText
from ...runs import RunFolder
from ..progress import Progress
from ..terminal import print_line
from .arguments import add_html, add_outside_references
from .choices import add_interfaces
from .results.outputs import check_page, named_inputs
from .results.pages import page_of_series
from .surface_kind import SURFACES

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal flow statue.ply run/ --flow mean-curvature --conserve volume --remesh --steps 200
  hexconformal flow cube.ply run/ --flow willmore --conserve area,volume --remesh
  hexconformal flow cell.vtp run/ --flow helfrich --kc 1 --c0 0.5 --remesh --t-end 0.1 --outputs 0.01,0.05
  hexconformal flow statue.ply run/ --flow mean-curvature --conserve volume --remesh --steps 400 --resume
  hexconformal flow cube.ply run/ --flow willmore --conserve area,volume --remesh --html flow.html

in the folder: run.pvd (frames for ParaView), history.csv, history.png, last.vtu, checkpoint.npz
"""

# By name, the default first: a flow of the surface in a file, with what it conserves.
_FLOWS: dict[str, Callable[[Namespace, list[str]], Flow]] = {
    "mean-curvature": lambda given, conserve: MeanCurvature(given.input, conserve),
    "willmore": lambda given, conserve: Willmore(given.input, conserve),
    "p-willmore": lambda given, conserve: PWillmore(given.input, given.p, conserve),
    "helfrich": lambda given, conserve: Helfrich(given.input, given.kc, given.c0, given.gamma, conserve),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("input", metavar="IN", help="surface to read; the extension tells the format")
    add_outside_references(parser)
    parser.add_argument("folder", metavar="FOLDER", help="where to write; it is made if it is not there")
    what = parser.add_argument_group("the flow")
    what.add_argument(
        "--flow", metavar="|".join(_FLOWS), default=next(iter(_FLOWS)), help="what falls (default %(default)s)"
    )
    what.add_argument("--conserve", metavar="area,volume", default="", help="what is kept at every step")
    what.add_argument(
        "--p", type=float, default=2.0, help="exponent of p-Willmore flow, int |Y|^p (default %(default)g)"
    )
    what.add_argument("--kc", type=float, default=1.0, help="bending modulus (default %(default)g)")
    what.add_argument("--c0", type=float, default=0.0, help="spontaneous curvature (default %(default)g)")
    what.add_argument("--gamma", type=float, default=0.0, help="surface tension (default %(default)g)")
    when = parser.add_argument_group("how far, in which steps")
    when.add_argument("--steps", type=int, metavar="N", help="stop after N steps")
    when.add_argument("--t-end", type=float, metavar="T", help="stop at time T")
    when.add_argument(
        "--stall", type=float, default=Stepping.stall, metavar="X",
        help="stop where ten steps lower the energy by less than this, relatively (default %(default)g; 0: never)",
    )  # fmt: skip
    when.add_argument("--tau", type=float, metavar="T", help="first time step (default: from the speed)")
    when.add_argument("--tau-max", type=float, default=Stepping.tau_max, metavar="T", help="largest time step")
    when.add_argument(
        "--growth",
        type=float,
        default=Stepping.growth,
        metavar="X",
        help="factor by which an accepted step grows (default %(default)g)",
    )
    when.add_argument("--outputs", metavar="T,T,...", default="", help="times to hit exactly, with a frame each")
    mesh = parser.add_argument_group("remeshing")
    mesh.add_argument(
        "--remesh", type=int, nargs="?", const=1, default=0, metavar="K", help="before every step, or every K-th"
    )
    mesh.add_argument("--remesh-below", type=float, metavar="DEGREES", help="where an angle is smaller than this")
    add_interfaces(mesh, "lines between regions, whose nodes it holds")
    group = parser.add_argument_group("outputs")
    group.add_argument("--every", type=int, default=1, metavar="K", help="a frame every K steps (default 1)")
    group.add_argument("--resume", action="store_true", help="go on with the run in FOLDER")
    group.add_argument("--overwrite", action="store_true", help="start anew in FOLDER, whatever is in it")
    add_html(group, "the frames with energy and angles of each step")
    group.add_argument("--quiet", action="store_true", help="errors only")


def run(arguments: Namespace) -> int:
    """Follow a flow in a folder."""
    if arguments.every < 1:
        raise OptionError(f"every must be 1 or more, not {arguments.every}")
    stepping = Stepping(
        t_end=arguments.t_end,
        steps=arguments.steps,
        tau=arguments.tau,
        tau_max=arguments.tau_max,
        growth=arguments.growth,
        stall=arguments.stall,
        outputs=tuple(_float(text) for text in _words(arguments.outputs)),
        remesh=arguments.remesh,
        remesh_below=arguments.remesh_below,
        remesh_options={"interfaces": arguments.interfaces},
    )
    folder, inputs = RunFolder(Path(arguments.folder)), named_inputs(arguments.input)
    folder.prepare(arguments.resume, arguments.overwrite, inputs)
    check_page(arguments.html, inputs)
    with Progress(arguments.quiet) as progress:
        progress.show(f"reading {arguments.input}")
        evolution = Evolution(_flow(arguments), stepping)
        stopped = folder.follow(FlowRun(evolution), arguments.resume, arguments.every, progress.show)
        plot_history(folder.plot, folder.history)
        if arguments.html is not None:
            progress.show(f"writing {arguments.html}")
            told, title = _report(evolution), Path(arguments.input).name
            page = page_of_series(folder.frames, SURFACES, folder.history, told, title)
            page.write(arguments.html)
    if not arguments.quiet:
        for note in evolution.notes:
            print_line(f"note: {note}")
        if evolution.history:
            print_line(str(evolution.history[-1]))
        print_line("interrupted" if stopped else evolution.reason)
        names = [folder.history.name, folder.plot.name, folder.last.name]
        print_line(f"wrote {', '.join([str(folder.frames), *names, *filter(None, [arguments.html])])}")
    if stopped is not None:
        print_line(f"interrupted at step {evolution.step}: --resume goes on from there", error=True)
        return 130
    return 0


def _report(evolution: Evolution) -> ReportText:
    """What the page says of a flow."""
    lines = [repr(evolution.flow), *map(str, evolution.history[-1:]), evolution.reason]
    return ReportText("\n".join(lines), evolution.notes, json_safe(evolution.stepping))


def _flow(arguments: Namespace) -> Flow:
    if arguments.flow not in _FLOWS:
        *names, last = _FLOWS
        raise OptionError(f"flow must be {', '.join(names)} or {last}, not {arguments.flow!r}")
    return _FLOWS[arguments.flow](arguments, _words(arguments.conserve))


def _words(text: str) -> list[str]:
    return [word for word in text.replace(",", " ").split() if word]


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError as problem:
        raise OptionError(f"outputs must be times, not {text!r}") from problem
