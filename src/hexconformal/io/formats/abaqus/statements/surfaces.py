"""Surfaces of decks: sides of elements, by name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .....elements import FACES
from .....mesh import boundary_quads
from .lines import Section, split_fields
from .sets import SetMember

__all__ = ["SURFACE", "read_sides", "sides_of"]

Ints = NDArray[np.int64]

SURFACE = "SURFACE "  # what the kind of a set of sides begins with; the side follows
# Corners of the sides of hexahedra, in the order in which decks number these.
_SIDES = {f"S{number}": FACES[face] for number, face in enumerate((4, 5, 2, 1, 3, 0), 1)}
_OF_SHELLS = ("", "SPOS", "SNEG")


def read_sides(section: Section) -> list[tuple[str, SetMember]]:
    """What the lines of *SURFACE list: sides, "" for those on the boundary, and the elements that they are of."""
    found: dict[str, tuple[list[int], dict[str, None]]] = {}
    for line in section.data:
        elements, side = [*split_fields(line), ""][:2]
        labels, names = found.setdefault(side.upper(), ([], {}))
        if elements.isdecimal():
            labels.append(int(elements))
        elif elements:
            names[elements.strip('"')] = None
    return [
        (side, SetMember(np.array(labels, dtype=np.int64), names=tuple(names)))
        for side, (labels, names) in found.items()
    ]


def sides_of(nodes: Mapping[str, Ints], rows: list[Ints], side: str) -> Ints:
    """(k, 4) nodes of the sides of hexahedra, and of shells of four corners as a whole.

    Parameters
    ----------
    nodes
        (m, w) nodes of all cells by type.
    rows
        Cells of each type.
    side
        S1 to S6; SPOS or SNEG of shells; "" for what is on the boundary. There are no others.
    """
    found = [np.empty((0, 4), dtype=np.int64)]
    solids = [name for name in nodes if name.startswith("hexahedron")]
    for name, chosen in zip(nodes, rows, strict=True):
        if name in solids and side in _SIDES:
            found.append(nodes[name][chosen][:, _SIDES[side]])
        elif name.startswith("quad") and side in _OF_SHELLS:
            found.append(nodes[name][chosen][:, :4])
    if solids and side == "":
        chosen_solids = np.concatenate([_mask(nodes[n], r) for n, r in zip(nodes, rows, strict=True) if n in solids])
        quads, owners = boundary_quads(np.concatenate([nodes[name][:, :8] for name in solids]))
        found.append(quads[chosen_solids[owners]])
    return np.concatenate(found)


def _mask(cells: Ints, rows: Ints) -> NDArray[np.bool_]:
    mask = np.zeros(len(cells), dtype=bool)
    mask[rows] = True
    return mask
