"""A deck of a mesh that did not come from one: nodes, elements and sets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .statements import format_real, keyword_line, written_name

__all__ = ["write_deck"]

_ENTRIES = 16  # that CalculiX and Abaqus read of a line
_NAME_LENGTH = 80


def write_deck(
    target: Path,
    mesh: Any,
    node_labels: NDArray[np.int64] | None,
    cell_labels: NDArray[np.int64] | None,
    type_names: NDArray[np.str_] | None = None,
) -> list[str]:
    """Write a meshio.Mesh with sets.

    Parameters
    ----------
    target
        The file.
    mesh
        With cells that decks have.
    node_labels, cell_labels
        What to call points and cells; None: from 1.
    type_names
        What the types of the cells were called in the deck that they are from; None: in none.

    Returns
    -------
    What could not be kept, in words.
    """
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    nodes = np.arange(1, len(points) + 1) if node_labels is None else node_labels
    count = sum(len(block.data) for block in mesh.cells)
    cells = np.arange(1, count + 1) if cell_labels is None else cell_labels
    types = np.repeat([block.type for block in mesh.cells], [len(block.data) for block in mesh.cells])
    were = np.full(count, "") if type_names is None else type_names
    written = np.array([written_name(*pair) for pair in zip(types.tolist(), were.tolist(), strict=True)], dtype=str)
    texts = [[format_real(value) for value in row] for row in points.tolist()]
    node_names, renamed_nodes = _names(mesh.point_sets)
    cell_names, renamed_cells = _names(key for key in mesh.cell_sets if not str(key).startswith("gmsh:"))
    with target.open("w", encoding="utf-8", errors="surrogateescape", newline="\n") as file:
        file.write("*HEADING\n*NODE\n")
        file.writelines(f"{label}, {', '.join(row)}\n" for label, row in zip(nodes.tolist(), texts, strict=True))
        starts = np.cumsum([0, *(len(block.data) for block in mesh.cells)]).tolist()
        for block, start in zip(mesh.cells, starts[:-1], strict=True):
            own = slice(start, start + len(block.data))
            table, names = np.column_stack([cells[own], nodes[block.data]]), written[own]
            for name in dict.fromkeys(names.tolist()):
                file.write(f"*ELEMENT, TYPE={name}\n")
                for row in table[names == name].tolist():
                    file.writelines(_data_lines(row, goes_on=True))
        for key, name in node_names.items():
            file.write(keyword_line("NSET", {"NSET": name}) + "\n")
            file.writelines(_data_lines(nodes[np.asarray(mesh.point_sets[key], dtype=np.int64)].tolist()))
        for key, name in cell_names.items():
            rows = [
                start + np.asarray([] if part is None else part, dtype=np.int64)
                for part, start in zip(mesh.cell_sets[key], starts, strict=False)
            ]
            file.write(keyword_line("ELSET", {"ELSET": name}) + "\n")
            file.writelines(_data_lines(cells[np.concatenate(rows)].tolist()))
    wanted = np.abs(points - np.array(texts, dtype=np.float64).reshape(-1, 3)).max(axis=1, initial=0.0)
    lost = [f"the name of the set {key!r} (kept as {name!r})" for key, name in (*renamed_nodes, *renamed_cells)]
    replaced = dict.fromkeys(
        pair for pair in zip(were.tolist(), written.tolist(), strict=True) if pair[0] not in ("", pair[1])
    )
    lost += [f"the type of elements {old} (now {new})" for old, new in replaced]
    if wanted.any():
        lost.append(f"the last digits of the coordinates of {(wanted > 0).sum()} nodes (up to {wanted.max():.1g})")
    return lost


def _data_lines(numbers: list[int], goes_on: bool = False) -> Iterator[str]:
    """Lines of at most 16 numbers; one record if it goes on over several lines."""
    for start in range(0, len(numbers), _ENTRIES):
        is_last = start + _ENTRIES >= len(numbers)
        text = ", ".join(map(str, numbers[start : start + _ENTRIES]))
        yield text + ("\n" if is_last or not goes_on else ",\n")


def _names(keys: Iterable[Any]) -> tuple[dict[Any, str], list[tuple[Any, str]]]:
    """Names that decks can have, all different however they are written, and those that differ from what they were."""
    result: dict[Any, str] = {}
    taken: set[str] = set()
    for key in keys:
        name = "".join(letter if letter.isprintable() and letter not in '",=*' else "_" for letter in str(key)).strip()
        # A number would be taken for a label.
        name = (f"SET_{name}" if not name or name.isdecimal() else name)[:_NAME_LENGTH]
        whole, number = name, 1
        while name.upper() in taken:
            number += 1
            name = f"{whole[: _NAME_LENGTH - 8]}_{number}"
        taken.add(name.upper())
        result[key] = name
    return result, [(key, name) for key, name in result.items() if str(key) != name]
