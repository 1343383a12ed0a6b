"""Decks of meshes that come from elsewhere: large fields, properties by tag, placeholders for what is not known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...format_tools.capabilities import Capabilities, supported_part
from ...format_tools.meshio_files import permuted_nodes
from ...format_tools.tags import TAG_ARRAYS, cell_tags, element_numbers, tag_names
from .elements import NODE_ORDERS
from .reals import format_real

__all__ = ["CAPABILITIES", "write"]

Ints = NDArray[np.int64]
CAPABILITIES = Capabilities(
    cell_types="line triangle triangle6 quad quad8 tetra tetra10 pyramid pyramid13 wedge wedge15 "
    "hexahedron hexahedron20",
    own_arrays=TAG_ARRAYS,
)
_CARDS = {
    "line": "CROD",
    "triangle": "CTRIA3",
    "triangle6": "CTRIA6",
    "quad": "CQUAD4",
    "quad8": "CQUAD8",
    "tetra": "CTETRA",
    "tetra10": "CTETRA",
    "pyramid": "CPYRAM",
    "pyramid13": "CPYRAM",
    "wedge": "CPENTA",
    "wedge15": "CPENTA",
    "hexahedron": "CHEXA",
    "hexahedron20": "CHEXA",
}
# Properties by the dimension of the cells that have them, with the material of the same number.
_PROPERTIES = {1: "PROD    {0:<8d}{0:<8d}1.", 2: "PSHELL  {0:<8d}{0:<8d}1.", 3: "PSOLID  {0:<8d}{0:<8d}"}
_LARGEST = 99_999_999  # a number in a field of eight characters


def write(target: Path, mesh: Any) -> list[str]:
    """Write a deck; returns what could not be kept."""
    out, lost = supported_part(mesh, "nastran", CAPABILITIES)
    tag_array, tags = cell_tags(out)
    lost += [f"cell array {name!r}" for name in TAG_ARRAYS if name in out.cell_data and name != tag_array]
    labels = mesh.node_labels
    if labels is None or labels.max() > _LARGEST or labels.min() < 1:
        labels = np.arange(1, len(out.points) + 1)
    properties, changed = _property_numbers(out, tags)
    if changed:
        lost.append(f"the numbers of {changed} groups of cells (numbered anew, to be different)")
    lines = ["$ The solution, materials, thicknesses and areas are placeholders.", "SOL 101", "CEND", "BEGIN BULK"]
    lines += _property_cards(properties, tag_names(out))
    points = np.pad(out.points, ((0, 0), (0, 3 - out.points.shape[1])))
    for label, point in zip(labels.tolist(), points.tolist(), strict=True):
        x, y, z = (format_real(value, 16) for value in point)
        lines.append(f"GRID*   {label:<16d}{'':16}{x:<16}{y:<16}\n*       {z}")
    blocks = permuted_nodes(out.cells, NODE_ORDERS, inverse=True)
    for block, values, numbers in zip(blocks, tags, element_numbers(mesh, out), strict=True):
        owners = [properties[block.dim, tag] for tag in values.tolist()]
        for number, owner, nodes in zip(numbers.tolist(), owners, labels[block.data].tolist(), strict=True):
            lines.append(_card(_CARDS[block.type], [number, owner, *nodes]))
    target.write_text("\n".join([*lines, "ENDDATA", ""]), encoding="utf-8", errors="surrogateescape")
    return [*lost, "digits of coordinates beyond the 16 characters of a field"]


def _property_numbers(mesh: Any, tags: list[Ints]) -> tuple[dict[tuple[int, int], int], int]:
    """The number of a property for every dimension and tag, all different, and how many are not their tag."""
    pairs = zip(mesh.cells, tags, strict=True)
    keys = list(dict.fromkeys((block.dim, tag) for block, part in pairs for tag in np.unique(part).tolist()))
    # Volumes keep their tags first.
    keys.sort(key=lambda key: -key[0])
    fine = [tag for _, tag in keys if 0 < tag <= _LARGEST]
    free, taken, numbers = max([0, *fine]) + 1, set(), {}
    for dimension, tag in keys:
        number = tag
        if not 0 < tag <= _LARGEST or tag in taken:
            number, free = free, free + 1
        taken.add(number)
        numbers[dimension, tag] = number
    return numbers, sum(tag not in (0, number) for (_, tag), number in numbers.items())


def _property_cards(properties: dict[tuple[int, int], int], names: dict[tuple[int, int], str]) -> list[str]:
    lines = []
    for key, number in properties.items():
        if key in names:
            lines.append(f"$ {' '.join(names[key].split())}")
        lines += [_PROPERTIES[key[0]].format(number), f"MAT1    {number:<8d}1.              .3"]
    return lines


def _card(name: str, numbers: list[int]) -> str:
    """A card in small fields.

    >>> print(_card("CHEXA", list(range(1, 11))))
    CHEXA   1       2       3       4       5       6       7       8       +
    +       9       10
    """
    rows = [numbers[start : start + 8] for start in range(0, len(numbers), 8)]
    text = [("+" if k else name).ljust(8) + "".join(f"{number:<8d}" for number in row) for k, row in enumerate(rows)]
    return "+\n".join(text).rstrip()
