"""The `check` command: of hexahedra, and of surfaces where there are none."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from surface.quality import require_sound

from ...common import MeshError
from ...quality import check, quality
from ..terminal import print_line
from .arguments import add_input, add_interfaces
from .contents import describe_contents
from .kinds import SURFACES, read_any_mesh

__all__ = ["EXAMPLES", "SUMMARY", "add_arguments", "run"]


SUMMARY = (
    "Tell whether a mesh, or a surface, can be worked on, and what is doubtful about it. Exit code 1 if it cannot."
)
EXAMPLES = (
    "  hexconformal check part.vtu\n  hexconformal check part.vtu --interfaces layer\n  hexconformal check statue.ply\n"
)


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_input(parser)
    add_interfaces(parser, "faces between regions are told")


def run(arguments: Namespace) -> int:
    """Print what is wrong with a mesh, and what is doubtful."""
    kind, mesh = read_any_mesh(arguments)
    head, *lines = _describe_surface(mesh) if kind is SURFACES else _describe_hexahedra(mesh, arguments.interfaces)
    refused = any(line.startswith("error: ") for line in lines)
    for line in [f"{arguments.input}: {head}", *lines, *(["can be worked on"] if not refused else [])]:
        print_line(line)
    return int(refused)


def _describe_hexahedra(mesh: Any, interfaces: str) -> list[str]:
    """Counts of a hexahedral mesh, what was found in it, then the findings of its checks, a line each."""
    findings = check(mesh)
    head = f"{len(mesh.cells)} hexahedra, {len(mesh.points)} points"
    found: list[str] = []
    if not any(finding.kind in ("not finite", "bad index") for finding in findings):
        measured = quality(mesh)
        summary = measured.summary()
        head += f", {summary.inverted} inverted, {summary.invalid} invalid"
        found = describe_contents(mesh, measured, interfaces)
    notes = [f"note: {note}" for note in mesh.notes]
    return [head, *found, *notes, *(f"{finding.severity}: {finding.message}" for finding in findings)]


def _describe_surface(mesh: Any) -> list[str]:
    """Counts of a surface, then the findings of its checks, a line each."""
    counts = f"{len(mesh.cells.triangles)} triangles, {len(mesh.cells.quads)} quadrilaterals"
    head = f"{counts}, {len(mesh.points)} points"
    try:
        return [head, *(f"warning: {doubt}" for doubt in require_sound(mesh))]
    except MeshError as problem:
        return [head, f"error: {problem}"]
