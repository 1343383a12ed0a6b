"""Draw docs/images/architecture.svg from the packages in src/: python docs/architecture.py [--check].

A room is a package directly below `hexconformal` or `surface`; what it is, and which rooms it may import from, is said
by its docstring. An arrow leads from a room to another that it imports from. With --check nothing is drawn: the command
ends with an error where the source breaks one of the rules in `faults`, or the picture is not up to date.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import defaultdict
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE, PICTURE = ROOT / "src", ROOT / "docs" / "images" / "architecture.svg"
PACKAGES = ("hexconformal", "surface")
INTERFACES = "hexconformal.app"  # the one room of hexconformal that may know surface
LINES, MODULES = 350, 15  # of a module, of a folder: more than that is no longer taken in

_WIDTH, _LINE, _PAD, _ACROSS, _DOWN, _COLUMN = 232, 15, 10, 44, 54, 34


@dataclass(frozen=True)
class Import:
    """Names that a module imports from another module or package of ours."""

    source: str
    target: str
    names: tuple[str, ...]


def modules(source: Path = SOURCE) -> dict[str, Path]:
    """Every module by its full name."""
    found = {}
    for path in sorted(source.rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(name: str, path: Path, known: dict[str, Path]) -> list[Import]:
    """What a module imports of ours, inside functions too."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [Import(name, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            whole = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                submodule = f"{whole}.{alias.name}" in known
                target, names = (f"{whole}.{alias.name}", ()) if submodule else (whole, (alias.name,))
                found.append(Import(name, target, names))
    return [one for one in found if one.target in known and one.target != name]


def room_of(name: str) -> str:
    """The room that a module is in: its package below `hexconformal` or `surface`, if there is one."""
    return ".".join(name.split(".")[:2])


def rooms(known: dict[str, Path]) -> dict[str, list[str]]:
    """The modules of each room, by their names inside it."""
    found: dict[str, list[str]] = {}
    for name, path in known.items():
        if name == room_of(name) and name not in PACKAGES and path.name == "__init__.py":
            found[name] = []
    for name, path in known.items():
        if room_of(name) in found and path.name != "__init__.py":
            found[room_of(name)].append(name.removeprefix(room_of(name) + "."))
    return found


def arrows(known: dict[str, Path]) -> dict[str, set[str]]:
    """The rooms that each room imports from."""
    inside = rooms(known)
    imported: dict[str, set[str]] = {room: set() for room in inside}
    for name, path in known.items():
        if room_of(name) in inside:
            targets = {room_of(one.target) for one in imports(name, path, known)}
            imported[room_of(name)] |= (targets & set(inside)) - {room_of(name)}
    return imported


def faults(source: Path = SOURCE) -> list[str]:
    """Where the source breaks the rules, in words.

    Modules and rooms import each other in one direction; another room is imported as a package, and from that only what
    it hands out; a room imports what its docstring says; of `hexconformal` only the user interfaces know `surface`; no
    module and no folder is too large to be taken in.
    """
    known = modules(source)
    inside = rooms(known)
    found = []
    graph = {name: {one.target for one in imports(name, path, known)} for name, path in known.items()}
    for what, edges in (("modules", graph), ("rooms", arrows(known))):
        try:
            TopologicalSorter(edges).prepare()
        except CycleError as problem:
            found.append(f"these {what} import each other in a circle: {' <- '.join(problem.args[1])}")
    public = {room: _public(known[room]) for room in inside}
    for name, path in known.items():
        for one in imports(name, path, known):
            here, there = room_of(name), room_of(one.target)
            if here.startswith("hexconformal") and here != INTERFACES and there.startswith("surface"):
                found.append(f"{name} imports {one.target}: only {INTERFACES} may know surface")
            if here == there or there not in inside or here == there.split(".")[0]:
                continue
            hidden = [n for n in one.names if n not in public[there]]
            if one.target != there and one.target.removeprefix(there + ".") not in public[there]:
                found.append(f"{name} imports {one.target}: import it from {there}, which must hand it out (__all__)")
            elif hidden:
                found.append(f"{name} imports {', '.join(hidden)}, which {there} does not hand out (__all__)")
    for room, others in arrows(known).items():
        stated = _stated_imports(known[room], room)
        for other in sorted(others - stated):
            found.append(f"{room} imports {other}, but its docstring does not say so")
        for other in sorted(stated - others):
            found.append(f"the docstring of {room} says that it imports {other}, which it does not")
    folders = defaultdict(int)
    for name, path in known.items():
        folders[path.parent] += path.name != "__init__.py"
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > LINES:
            found.append(f"{name} has {lines} lines, more than {LINES}")
    for folder, count in folders.items():
        if count > MODULES:
            found.append(f"{folder.relative_to(source)} has {count} modules, more than {MODULES}")
    return found


def _public(path: Path) -> set[str]:
    """What a package hands out: its __all__."""
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if any(isinstance(target, ast.Name) and target.id == "__all__" for target in targets):
            found |= set(ast.literal_eval(node.value))
    return found


def _stated_imports(path: Path, room: str) -> set[str]:
    """The rooms that a room imports from according to the end of its docstring."""
    text = " ".join((ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split())
    listed = re.search(r"Imports ((?:`[\w.]+`(?:, | and )?)+)", text)
    names = re.findall(r"`([\w.]+)`", listed[1]) if listed else []
    return {name if name.startswith(PACKAGES) else f"{room.split('.')[0]}.{name}" for name in names}


def layers(imported: dict[str, set[str]]) -> list[list[str]]:
    """Rooms from those that need no other upwards."""
    height: dict[str, int] = {}
    for room in TopologicalSorter(imported).static_order():
        height[room] = 1 + max((height[other] for other in imported[room]), default=-1)
    found = defaultdict(list)
    for room in imported:
        found[height[room]].append(room)
    return [found[k] for k in sorted(found)]


def needed(imported: dict[str, set[str]]) -> dict[str, set[str]]:
    """Arrows without those that others imply."""
    below: dict[str, set[str]] = {}
    for layer in layers(imported):
        for room in layer:
            below[room] = set().union(imported[room], *(below[other] for other in imported[room]))
    return {room: {a for a in to if not any(a in below[b] for b in to)} for room, to in imported.items()}


def drawing() -> str:
    """The picture."""
    known = modules()
    inside, imported = rooms(known), arrows(known)
    levels = layers(imported)[::-1]
    wrapped = {room: _wrapped([name.rpartition(".")[2] for name in names]) for room, names in inside.items()}
    # Surfaces have a column of their own on the right.
    columns = max(sum(not _of_surfaces(room) for room in level) for level in levels)
    step = _WIDTH + _ACROSS
    width = (columns + max(sum(map(_of_surfaces, level)) for level in levels)) * step + 2 * _COLUMN - _ACROSS
    place, y = {}, 20
    for level in levels:
        tall = max(2 * _PAD + _LINE * (1 + len(wrapped[room])) for room in level)
        others = [room for room in level if not _of_surfaces(room)]
        of_surfaces = [room for room in level if _of_surfaces(room)]
        left = _COLUMN + (columns - len(others)) * step / 2
        for room in level:
            right = _COLUMN + columns * step
            x = right + of_surfaces.index(room) * step if room in of_surfaces else left + others.index(room) * step
            place[room] = (x, y, 2 * _PAD + _LINE * (1 + len(wrapped[room])))
        y += tall + _DOWN
    height = y - _DOWN + 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#607d8b"/></marker></defs>',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
    ]
    for room, others in needed(imported).items():
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


def _wrapped(names: list[str], characters: int = 38) -> list[str]:
    lines = [""]
    for name in names:
        if lines[-1] and len(lines[-1]) + len(name) > characters:
            lines.append("")
        lines[-1] += f"{name}  "
    return [line.strip() for line in lines]


def main() -> None:
    """Draw it, or tell whether it is drawn, and built, as it should be."""
    if "--check" in sys.argv[1:]:
        found = faults()
        if not found and (not PICTURE.exists() or PICTURE.read_text(encoding="utf-8") != drawing()):
            found = ["docs/images/architecture.svg is not up to date: python docs/architecture.py"]
        if found:
            raise SystemExit("\n".join(found))
    else:
        PICTURE.write_text(drawing(), encoding="utf-8")


if __name__ == "__main__":
    main()
