"""One function per command: takes what was asked, prints what came out, returns the exit code."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from .checks import check as find_faults
from .demo import run_demo
from .errors import MeshError, OptionError, ReadError
from .files import check_writable, write_text
from .io import READ_EXTENSIONS, WRITE_EXTENSIONS, read, write
from .job import Finished, Outputs, Volume, Work, check_pictures, check_places, run_work
from .mesh import HexMesh
from .motion import MeshMotion
from .motion_run import MotionFolder, read_boundary
from .options import Options
from .orient import orient as put_in_order
from .plots import histogram, worst_cells
from .progress import Progress
from .quality import Quality
from .quality import quality as measure

__all__ = ["Kind", "carry_out", "check", "demo", "move", "orient", "quality", "regularize"]

_STDOUT = "-"


@dataclass(frozen=True)
class Kind:
    """How one kind of mesh, volumes or surfaces, is measured, drawn and written."""

    measure: Callable[[Any], Any]
    arrays: Callable[[Any], dict[str, Any]]
    histogram: Callable[..., None]
    worst_cells: Callable[..., None]
    write: Callable[[str, Any], list[str]]
    extensions: tuple[str, ...]
    worst_by: str  # the measure that tells which cells are the worst


_VOLUMES = Kind(measure, Quality.arrays, histogram, worst_cells, write, WRITE_EXTENSIONS, "scaled_jacobian")


def regularize(arguments: Namespace) -> int:
    """Regularize a mesh; an interruption leaves what was reached."""
    options = Options(**{field.name: getattr(arguments, field.name) for field in fields(Options)})
    return carry_out(arguments, WRITE_EXTENSIONS, lambda: Volume(_mesh(arguments), options))


def carry_out(arguments: Namespace, extensions: tuple[str, ...], prepare: Callable[[], Work]) -> int:
    """Do a work with everything that is asked for, and say how it ended.

    Parameters
    ----------
    arguments
        Input, output, and what is to be told.
    extensions
        Those that the output may have.
    prepare
        Reads the input.
    """
    as_json = arguments.report == _STDOUT
    outputs = Outputs(
        mesh=arguments.output,
        history=arguments.history,
        frames=arguments.frames,
        report=None if as_json else arguments.report,
        plot=arguments.plot,
        picture=arguments.picture,
        worst_picture=arguments.worst_picture,
        every=arguments.every,
        extensions=extensions,
    )
    outputs.check(arguments.input, arguments.overwrite)
    with Progress(arguments.quiet) as progress:
        progress.say(f"reading {arguments.input}")
        finished = run_work(prepare(), outputs, progress)
    if as_json:
        print(finished.result.report.to_json())
    elif not arguments.quiet:
        print(finished.result.report)
        print(f"wrote {', '.join(outputs.named())}")
    _tell_lost(arguments.output, finished.lost)
    return _ending(finished, arguments.output)


def quality(arguments: Namespace) -> int:
    """Measure a mesh, or a surface where there are no hexahedra."""
    if arguments.worst < 0:
        raise OptionError(f"worst is not negative, not {arguments.worst}")
    to_file = None if arguments.json == _STDOUT else arguments.json
    check_places([arguments.output, to_file, arguments.plot, arguments.picture], arguments.input, arguments.overwrite)
    check_pictures(arguments.plot, arguments.picture)
    with Progress() as progress:
        progress.say(f"measuring {arguments.input}")
        kind, mesh = _any_mesh(arguments)
        if arguments.output is not None:
            check_writable(arguments.output, kind.extensions)
        measured = kind.measure(mesh)
        summary = measured.summary(arguments.worst)
        if arguments.plot is not None:
            kind.histogram(arguments.plot, measured)
        if arguments.picture is not None:
            kind.worst_cells(arguments.picture, measured, count=arguments.worst)
        lost = []
        if arguments.output is not None:
            lost = kind.write(arguments.output, mesh.replaced(cell_data=kind.arrays(measured)))
        if to_file is not None:
            write_text(to_file, _json(summary))
    if arguments.json == _STDOUT:
        print(_json(summary), end="")
    else:
        print(summary)
        if summary.worst:
            print(f"worst cells (id, {kind.worst_by.replace('_', ' ')}, centre)")
        for cell in summary.worst:
            centre = ", ".join(f"{x:.6g}" for x in cell.centre)
            print(f"{cell.id:>10d} {getattr(cell, kind.worst_by):>10.5f}  ({centre})")
    _tell_lost(arguments.output, lost)
    return 0


def _any_mesh(arguments: Namespace) -> tuple[Kind, Any]:
    """A mesh of hexahedra, or of triangles and quadrilaterals if there are none."""
    import surface.commands
    import surface.io

    extension = Path(arguments.input).suffix.lower()
    is_surface_file = extension in surface.io.EXTENSIONS
    if is_surface_file and extension not in READ_EXTENSIONS:
        return surface.commands.KIND, surface.io.read(arguments.input)
    try:
        return _VOLUMES, _mesh(arguments)
    except ReadError:
        raise
    except MeshError:
        if not is_surface_file:
            raise
        try:
            return surface.commands.KIND, surface.io.read(arguments.input)
        except MeshError:
            # No surface either: what was said of the volume stands.
            pass
        raise


def move(arguments: Namespace) -> int:
    """Move a mesh with its boundary."""
    if arguments.every < 1:
        raise OptionError(f"every is 1 or more, not {arguments.every}")
    boundary = read_boundary(arguments.boundary)
    place = MotionFolder(Path(arguments.folder), None if arguments.frames is None else Path(arguments.frames))
    place.prepare(arguments.resume, arguments.overwrite)
    with Progress(arguments.quiet) as progress:
        progress.say(f"reading {arguments.input}")
        motion = MeshMotion(_mesh(arguments), boundary.nodes, arguments.fixed, arguments.reference, arguments.operator)
        last, stopped = place.follow(motion, boundary, arguments.resume, arguments.every, progress.say)
    if not arguments.quiet:
        for note in motion.notes:
            print(f"note: {note}")
        print(f"wrote {place.frames}, {place.history.name}, {place.last.name}")
    if stopped is not None:
        print(f"interrupted after step {last}: --resume goes on from there", file=sys.stderr)
        return 130
    if place.refusal:
        print(f"error: step {last + 1} was refused: {place.refusal}", file=sys.stderr)
        return 1
    return 0


def orient(arguments: Namespace) -> int:
    """Put cells into VTK's order."""
    check_places([arguments.output], arguments.input, arguments.overwrite)
    check_writable(arguments.output, WRITE_EXTENSIONS)
    mesh, report = put_in_order(_mesh(arguments))
    lost = write(arguments.output, mesh)
    if report.changed:
        print(f"node order was {report.order}; {len(report.mirrored)} of {len(mesh.cells)} cells turned round")
    else:
        print("nothing to do: all cells are in VTK's order, none is mirrored")
    print(f"wrote {arguments.output}")
    _tell_lost(arguments.output, lost)
    return 0


def check(arguments: Namespace) -> int:
    """Tell what is wrong with a mesh."""
    mesh = _mesh(arguments)
    findings = find_faults(mesh)
    head = f"{arguments.input}: {len(mesh.cells)} hexahedra, {len(mesh.points)} points"
    countable = not any(finding.kind in ("not finite", "bad index") for finding in findings)
    if countable:
        summary = measure(mesh).summary()
        head += f", {summary.inverted} inverted, {summary.invalid} invalid"
    print(head)
    for note in mesh.notes:
        print(f"note: {note}")
    for finding in findings:
        print(f"{finding.severity}: {finding.message}")
    if not findings:
        print("sound")
    return int(any(finding.severity == "error" for finding in findings))


def demo(arguments: Namespace) -> int:
    """Make a sheared cube regular."""
    with Progress() as progress:
        finished, lines = run_demo(arguments.folder, arguments.size, progress)
    print(finished.result.report)
    print("\n".join(["", *lines]))
    return _ending(finished, arguments.folder)


def _mesh(arguments: Namespace) -> HexMesh:
    return read(arguments.input, other_cells=arguments.other_cells, linearise=arguments.linearise)


def _json(summary: Any) -> str:
    return json.dumps(summary.to_dict(), indent=2, allow_nan=False) + "\n"


def _tell_lost(path: str, lost: list[str]) -> None:
    if lost:
        print(f"note: {path} does not keep {', '.join(lost)}", file=sys.stderr)


def _ending(finished: Finished, place: str) -> int:
    if finished.stopped_by is None:
        return 0
    reached = f"the mesh of iteration {finished.result.report.iterations} is in {place}"
    if isinstance(finished.stopped_by, KeyboardInterrupt):
        print(f"interrupted: {reached}", file=sys.stderr)
        return 130
    print(f"error: {finished.stopped_by or 'not enough memory'}; {reached}", file=sys.stderr)
    return 1
