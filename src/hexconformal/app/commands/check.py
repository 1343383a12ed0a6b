"""The `check` command: of solid cells, and of surfaces where there are none."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from ...common import MeshError, aligned
from ...elements import SOLID_TYPES
from ...mesh import MixedMesh, collapsed_mesh, counts_by_type
from ...quality import MixedQuality, check, quality
from ..terminal import print_line
from .arguments import add_input, read_any_mesh, read_to_work_on
from .choices import add_interfaces
from .contents import describe_contents
from .kinds import VOLUMES

__all__ = ["EXAMPLES", "add_arguments", "run"]

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
    if isinstance(mesh, MixedMesh):
        mesh = read_to_work_on(arguments)
    if isinstance(mesh, MixedMesh):
        head, *lines = _describe_types(mesh, arguments.interfaces)
    else:
        head, *lines = _describe_hexahedra(mesh, arguments.interfaces) if kind is VOLUMES else _describe_surface(mesh)
    refused = any(line.startswith("error: ") for line in lines)
    for line in [f"{arguments.input}: {head}", *lines, *([] if refused else ["can be worked on"])]:
        print_line(line)
    return int(refused)


def _describe_types(mesh: MixedMesh, interfaces: str) -> list[str]:
    """Counts of a mesh of several types, a table of them, what was found in it, then the findings of its checks."""
    findings = check(mesh)
    head, table = f"{counts_by_type(mesh.blocks)}, {len(mesh.points)} points", []
    found: list[str] = []
    if not any(finding.kind in ("not finite", "bad index") for finding in findings):
        measured = quality(mesh)
        summary = measured.summary()
        head += f", {summary.inverted} inverted, {summary.invalid} invalid"
        table = _table_of_types(measured) if isinstance(measured, MixedQuality) else []
        found = describe_contents(collapsed_mesh(mesh), measured, interfaces)
    notes = [f"note: {note}" for note in mesh.notes]
    return [head, *table, *found, *notes, *(f"{finding.severity}: {finding.message}" for finding in findings)]


def _table_of_types(measured: MixedQuality) -> list[str]:
    if len(measured.blocks) < 2:
        return []
    rows = []
    for name, one in measured.summary(0).types.items():
        figures = str(one.count), str(one.inverted), str(one.invalid), f"{one.total_volume:.5g}"
        rows.append((SOLID_TYPES[name].plural, *figures, f"{one.scaled_jacobian.min:.3f}"))
    return aligned(("type", "cells", "inverted", "invalid", "volume", "min SJ"), rows, len(rows))


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
    from surface.quality import require_sound  # not loaded for volumes

    counts = f"{len(mesh.cells.triangles)} triangles, {len(mesh.cells.quads)} quadrilaterals"
    head = f"{counts}, {len(mesh.points)} points"
    try:
        return [head, *(f"warning: {doubt}" for doubt in require_sound(mesh))]
    except MeshError as problem:
        return [head, f"error: {problem}"]
