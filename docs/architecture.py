"""Draw docs/images/architecture.svg from the imports in src/: python docs/architecture.py [--check].

Modules live in rooms; which room a module is in is said here, everything else is read from the source. An arrow leads
from a room to another that it imports from. Ends with an error where a module has no room, where modules or rooms
import each other in a circle, where hexconformal imports surface other than for its commands and filters, or, with
--check, where the picture is not up to date.
"""

from __future__ import annotations

import ast
import sys
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE, PICTURE = ROOT / "src", ROOT / "docs" / "images" / "architecture.svg"

# Title, and modules. Names within hexconformal; those of surface begin with a dot.
ROOMS: dict[str, str] = {
    "the kernel": "compiled quaternion distortion small_matrices",
    "cells": "elements topology sizes size_kernel threads sparsity validity cell_measures",
    "meshes and files": "errors interrupt version plain files arrays mesh selection convert meshio_mesh pyvista_mesh"
    " vtk_mesh parsers format_limits silence vtk_files sound_files abaqus conventions nastran io",
    "what is measured": "distributions generate.bricks generate.o_grids generate.jitter quality orient checks limits"
    " winding connections",
    "the energies of hexahedra": "scratch kernels corner_blocks corner_kernels assembly block_matrix grain shaping"
    " target",
    "solvers": "solver multigrid preconditioner",
    "the boundary": "features creases nearest closest hausdorff constraint band boundary ordering frame",
    "what is asked and told": "asked options report",
    "regularize": "regularize outcome stages step minimize untangle inside ease lift volume",
    "move": "motion extension motion_table motion_run",
    "surface: geometry and files": ".geometry .mesh .vtk_mesh .convert .io .ply .polygons .edges .creases .features",
    "surface: energies": ".energy .barrier .reference .step",
    "surface: remesh": ".checks .quality .options .report .guard .target .problem .core .nearer .worth .result .remesh",
    "surface: flow": ".flow.terms .flow.discrete .flow.energy .flow.step .flow.flows .flow.options .flow.remeshing"
    " .flow.moment .flow.evolve .flow.checkpoint .flow",
    "runs in folders": "history checkpoint series run_folder",
    "pictures": "canvas plots .plots .flow.plots",
    "commands": "__main__ cli commands.arguments commands.kind commands.outputs commands.work commands.regularize"
    " commands.move commands.quality commands.orient commands.check commands.demo .commands.kind .commands.remesh"
    " .commands.flow progress",
    "filters": "accessor hexconformal_plugin",
}
KNOWING = ("commands", "filters")  # rooms of hexconformal that may know surfaces
# The packages themselves hand out what is inside: no room.
FACADES = ("hexconformal", "hexconformal.commands", "hexconformal.generate", "surface", "surface.commands")

_WIDTH, _LINE, _PAD, _ACROSS, _DOWN, _COLUMN = 232, 15, 10, 44, 54, 34


def modules() -> dict[str, Path]:
    """Every module by its full name."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(name: str, path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of ours that a module imports, inside functions too."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            whole = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{whole}.{alias.name}" if f"{whole}.{alias.name}" in known else whole for alias in node.names}
    return {other for other in found if other in known and other != name}


def rooms() -> tuple[dict[str, list[str]], dict[str, set[str]]]:
    """Modules of each room, and the rooms it imports from."""
    known = modules()
    inside: dict[str, list[str]] = {}
    room_of = {}
    for room, names in ROOMS.items():
        full = [f"surface{name}" if name.startswith(".") else f"hexconformal.{name}" for name in names.split()]
        inside[room] = [name for name in full if name in known]
        room_of |= dict.fromkeys(inside[room], room)
    homeless = sorted(set(known) - set(room_of) - set(FACADES))
    if homeless:
        raise SystemExit(f"give these modules a room in docs/architecture.py: {', '.join(homeless)}")
    try:
        TopologicalSorter({name: imports(name, path, known) for name, path in known.items()}).prepare()
    except CycleError as problem:
        raise SystemExit(f"these modules import each other in a circle: {' <- '.join(problem.args[1])}") from problem
    uses: dict[str, set[str]] = {room: set() for room in ROOMS}
    for name, room in room_of.items():
        if name.startswith("hexconformal") and room not in KNOWING:
            strange = [other for other in imports(name, known[name], known) if other.startswith("surface")]
            if strange:
                raise SystemExit(f"{name} imports {', '.join(strange)}: only commands and filters may know surfaces")
        uses[room] |= {room_of[other] for other in imports(name, known[name], known) if other in room_of}
        uses[room].discard(room)
    return inside, uses


def layers(uses: dict[str, set[str]]) -> list[list[str]]:
    """Rooms from those that need no other upwards."""
    height: dict[str, int] = {}
    while len(height) < len(uses):
        ready = [room for room in uses if room not in height and uses[room] <= set(height)]
        if not ready:
            raise SystemExit(f"these rooms import each other in a circle: {', '.join(set(uses) - set(height))}")
        height |= {room: 1 + max((height[other] for other in uses[room]), default=-1) for room in ready}
    found = defaultdict(list)
    for room in uses:
        found[height[room]].append(room)
    return [found[k] for k in sorted(found)]


def needed(uses: dict[str, set[str]]) -> dict[str, set[str]]:
    """Arrows without those that others imply."""
    below: dict[str, set[str]] = {}
    for layer in layers(uses):
        for room in layer:
            below[room] = set().union(uses[room], *(below[other] for other in uses[room]))
    return {room: {a for a in to if not any(a in below[b] for b in to)} for room, to in uses.items()}


def drawing() -> str:
    """The picture."""
    inside, uses = rooms()
    stories = layers(uses)[::-1]
    wrapped = {room: _wrapped([_short(name, room) for name in names]) for room, names in inside.items()}
    # Surfaces have a column of their own on the right.
    columns = max(sum(not _of_surfaces(room) for room in story) for story in stories)
    step = _WIDTH + _ACROSS
    width = (columns + 1) * step + 2 * _COLUMN - _ACROSS
    place, y = {}, 20
    for story in stories:
        tall = max(2 * _PAD + _LINE * (1 + len(wrapped[room])) for room in story)
        others = [room for room in story if not _of_surfaces(room)]
        left = _COLUMN + (columns - len(others)) * step / 2
        for room in story:
            x = _COLUMN + columns * step if _of_surfaces(room) else left + others.index(room) * step
            place[room] = (x, y, 2 * _PAD + _LINE * (1 + len(wrapped[room])))
        y += tall + _DOWN
    height = y - _DOWN + 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#607d8b"/></marker></defs>',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
    ]
    for room, others in needed(uses).items():
        x, top, tall = place[room]
        for other in sorted(others, key=lambda name: place[name]):
            there, low, _ = place[other]
            start, end = (x + _WIDTH / 2, top + tall), (there + _WIDTH / 2, low)
            bend = 0.5 * (end[1] - start[1])
            parts.append(
                f'<path d="M{start[0]:g} {start[1]:g}C{start[0]:g} {start[1] + bend:g} {end[0]:g} {end[1] - bend:g} '
                f'{end[0]:g} {end[1]:g}" fill="none" stroke="#607d8b" stroke-width="1.4" marker-end="url(#tip)"/>'
            )
    for room, (x, top, tall) in place.items():
        fill = "#e8f5e9" if _of_surfaces(room) else "#e3f2fd"
        parts.append(
            f'<rect x="{x:g}" y="{top:g}" width="{_WIDTH}" height="{tall}" rx="6" fill="{fill}" stroke="#37474f"/>'
        )
        lines = [(room, 'font-size="13" font-weight="bold"'), *((text, 'font-size="11"') for text in wrapped[room])]
        for k, (text, style) in enumerate(lines):
            parts.append(f'<text x="{x + _PAD:g}" y="{top + _PAD + _LINE * k + 11:g}" {style}>{text}</text>')
    return "\n".join([*parts, "</svg>", ""])


def _of_surfaces(room: str) -> bool:
    return room.startswith("surface")


def _short(name: str, room: str) -> str:
    """A module's name as it is called in its room."""
    return name if name.startswith("surface") and not _of_surfaces(room) else name.partition(".")[2]


def _wrapped(names: list[str], characters: int = 38) -> list[str]:
    lines = [""]
    for name in names:
        if lines[-1] and len(lines[-1]) + len(name) > characters:
            lines.append("")
        lines[-1] += f"{name}  "
    return [line.strip() for line in lines]


def main() -> None:
    """Draw it, or tell whether it is drawn as it should be."""
    drawn = drawing()
    if "--check" in sys.argv[1:]:
        if not PICTURE.exists() or PICTURE.read_text(encoding="utf-8") != drawn:
            raise SystemExit("docs/images/architecture.svg is not up to date: python docs/architecture.py")
    else:
        PICTURE.write_text(drawn, encoding="utf-8")


if __name__ == "__main__":
    main()
