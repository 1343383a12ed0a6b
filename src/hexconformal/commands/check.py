"""The `check` command."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from ..checks import check
from ..quality import quality
from .arguments import add_input, command, mesh_of

__all__ = ["add_check"]


def add_check(added: Any) -> None:
    """Add the command to those of the program."""
    parser = command(
        added,
        "check",
        _check,
        "Tell whether a mesh can be worked on, and what is doubtful about it. Exit code 1 if it cannot.",
        "  hexconformal check part.vtu\n",
    )
    add_input(parser)


def _check(arguments: Namespace) -> int:
    """Tell what is wrong with a mesh."""
    mesh = mesh_of(arguments)
    findings = check(mesh)
    head = f"{arguments.input}: {len(mesh.cells)} hexahedra, {len(mesh.points)} points"
    countable = not any(finding.kind in ("not finite", "bad index") for finding in findings)
    if countable:
        summary = quality(mesh).summary()
        head += f", {summary.inverted} inverted, {summary.invalid} invalid"
    print(head)
    for note in mesh.notes:
        print(f"note: {note}")
    for finding in findings:
        print(f"{finding.severity}: {finding.message}")
    if not findings:
        print("can be worked on")
    return int(any(finding.severity == "error" for finding in findings))
