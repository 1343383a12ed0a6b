"""The `view` command."""

from __future__ import annotations

import tempfile
import webbrowser
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ...common import MeshError, OptionError, ReadError, check_writable, unusable_points
from ...page import Page, ReportText
from ...runs import frames_listed
from ..progress import Progress
from ..terminal import print_line
from .arguments import add_html, add_input, read_any_mesh
from .choices import add_interfaces
from .results.outputs import check_page, named_inputs
from .results.pages import page_of_series

__all__ = ["EXAMPLES", "add_arguments", "run"]

EXAMPLES = """  hexconformal view part.vtu
  hexconformal view part.vtu better.vtu
  hexconformal view run.pvd --history run.csv
  hexconformal view part.vtu --html part.html --no-browser
"""

_SERIES = ".pvd"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser, "solid cells of higher order, polyhedra, ...")
    parser.add_argument(
        "after", metavar="AFTER", nargs="?", help="another mesh with the same cells, to look at beside IN"
    )
    parser.add_argument(
        "--history",
        metavar="run.csv",
        help="history of the run that wrote the series IN (default: history.csv beside it)",
    )
    add_interfaces(parser, "what is shown as regions, with the faces between them")
    add_html(parser, "where to write")
    parser.add_argument("--no-browser", action="store_true", help="write the page, and do not open it")


def run(arguments: Namespace) -> int:
    """Write the page of a mesh, or of a series, and open it."""
    given = Path(arguments.input)
    _refuse_folder_of_run(given)
    is_series = given.suffix.lower() == _SERIES
    if arguments.history is not None and not is_series:
        raise OptionError(f"--history goes with a series ({_SERIES}), not with {given}")
    if arguments.after is not None and is_series:
        raise OptionError(f"a series is shown alone: leave {arguments.after} out")
    inputs = named_inputs(arguments.input)
    if arguments.after is not None:
        inputs |= {Path(arguments.after): "the mesh beside the input"}
    if arguments.html is None:
        target = Path(tempfile.mkdtemp(prefix="hexconformal-")) / f"{given.stem}.html"
    else:
        target = Path(arguments.html)
        check_page(arguments.html, inputs)
    check_writable(target)
    with Progress() as progress:
        progress.show(f"reading {given}")
        page = _page_of_series(arguments) if is_series else _page_of_mesh(arguments)
        progress.show(f"writing {target}")
        page.write(target)
    opened = not arguments.no_browser and webbrowser.open(target.resolve().as_uri())
    print_line(f"wrote {target}" + ("" if opened else ": open it in a browser"))
    return 0


def _refuse_folder_of_run(given: Path) -> None:
    """Raise a ReadError if this is a folder with a series in it, which is what to look at."""
    series = sorted(given.glob(f"*{_SERIES}")) if given.is_dir() else []
    if series:
        text = f"view the series in it: hexconformal view {series[0]} (ParaView opens that file, too)"
        raise ReadError(f"{given} is a folder; {text}")


def _page_of_series(arguments: Namespace) -> Page:
    series = Path(arguments.input)
    beside = series.parent / "history.csv"
    history = beside if arguments.history is None and beside.is_file() else arguments.history
    if history is not None and not Path(history).is_file():
        raise ReadError(f"{history} does not exist")
    first = Namespace(**{**vars(arguments), "input": str(frames_listed(series)[0][1]), "other_cells": "keep"})
    kind, _ = read_any_mesh(first)
    return page_of_series(series, kind, history and Path(history), interfaces=arguments.interfaces)


def _page_of_mesh(arguments: Namespace) -> Page:
    kind, mesh = read_any_mesh(arguments)
    odd, text = unusable_points(mesh.points, mesh.node_labels)
    if len(odd):
        raise MeshError(f"{arguments.input}: {text}")
    after = None if arguments.after is None else kind.read_like(Path(arguments.after), mesh)
    summaries = [str(kind.measure(one).summary()) for one in (mesh, after) if one is not None]
    report = ReportText("\n\n".join(summaries), mesh.notes)
    return kind.page(mesh, after, report=report, interfaces=arguments.interfaces)
