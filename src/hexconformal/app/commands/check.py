"""The `check` command: of hexahedra, and of surfaces where there are none."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from surface.quality import require_sound

from ...common import MeshError
from ...quality import check, quality
from .arguments import add_input, command
from .quality import any_mesh
from .surface_kind import SURFACES

__all__ = ["add_check"]


def add_check(added: Any) -> None:
    """Add the command to those of the program."""
    parser = command(
        added,
        "check",
        _check,
        "Tell whether a mesh, or a surface, can be worked on, and what is doubtful about it. Exit code 1 if it cannot.",
        "  hexconformal check part.vtu\n  hexconformal check statue.ply\n",
    )
    add_input(parser)


def _check(arguments: Namespace) -> int:
    """Tell what is wrong with a mesh."""
    kind, mesh = any_mesh(arguments)
    head, *lines = _of_surface(mesh) if kind is SURFACES else _of_hexahedra(mesh)
    refused = any(line.startswith("error: ") for line in lines)
    print("\n".join([f"{arguments.input}: {head}", *lines, *(["can be worked on"] if not refused else [])]))
    return int(refused)


def _of_hexahedra(mesh: Any) -> list[str]:
    """What is there, then what was found."""
    findings = check(mesh)
    head = f"{len(mesh.cells)} hexahedra, {len(mesh.points)} points"
    if not any(finding.kind in ("not finite", "bad index") for finding in findings):
        summary = quality(mesh).summary()
        head += f", {summary.inverted} inverted, {summary.invalid} invalid"
    notes = [f"note: {note}" for note in mesh.notes]
    return [head, *notes, *(f"{finding.severity}: {finding.message}" for finding in findings)]


def _of_surface(mesh: Any) -> list[str]:
    """The same of a surface."""
    counts = f"{len(mesh.cells.triangles)} triangles, {len(mesh.cells.quads)} quadrilaterals"
    head = f"{counts}, {len(mesh.points)} points"
    try:
        return [head, *(f"warning: {doubt}" for doubt in require_sound(mesh))]
    except MeshError as problem:
        return [head, f"error: {problem}"]
