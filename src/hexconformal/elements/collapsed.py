"""Linear cells of all types in one table (m, 8): as hexahedra, some of whose nodes coincide.

A wedge is a hexahedron two of whose vertical edges are one, a pyramid one whose upper face is a point, a tetrahedron
both. Faces, volumes and what shares a node are then those of hexahedra, where faces with fewer than three different
nodes count as none. Whatever is measured at corners takes those of the type.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .cell_type import CellType
from .hexahedron import HEXAHEDRON, QUADRATURE_RULES, shape_gradients
from .pyramid import PYRAMID
from .tetrahedron import TETRAHEDRON
from .wedge import WEDGE

__all__ = ["COLLAPSED", "TypedRows", "are_collapsed", "collapsed_cells", "recognized", "rows_by_type"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# Which of its own nodes a cell of each type has at the eight places of a hexahedron.
COLLAPSED: dict[str, tuple[int, ...]] = {
    HEXAHEDRON.name: (0, 1, 2, 3, 4, 5, 6, 7),
    WEDGE.name: (0, 1, 2, 2, 3, 4, 5, 5),
    PYRAMID.name: (0, 1, 2, 3, 4, 4, 4, 4),
    TETRAHEDRON.name: (0, 1, 2, 2, 3, 3, 3, 3),
}


@dataclass(frozen=True, eq=False)
class TypedRows:
    """The cells of one type in a table.

    Attributes
    ----------
    cell_type
        The type.
    rows
        Their rows: a slice where they follow each other, so that nothing is copied, else ids.
    """

    cell_type: CellType
    rows: slice | Ints

    @property
    def places(self) -> tuple[int, ...]:
        """Of the eight, the one of each of its own nodes, the first where several are one."""
        return tuple(COLLAPSED[self.cell_type.name].index(node) for node in self.cell_type.nodes)

    def own_nodes(self, cells: Ints) -> Ints:
        """(k, j) the nodes that cells of this type have of their own, of a table (m, 8)."""
        return cells[self.rows] if self.cell_type is HEXAHEDRON else cells[self.rows][:, self.places]

    def rule(self, quadrature: str) -> tuple[Field, Field]:
        """Where cells of this type are measured: of hexahedra a quadrature, of others the corners that count.

        Returns
        -------
        (q, 8, 3) what takes the eight places to the derivatives there: of hexahedra those of the shape functions, of
        others the edges at a corner, in the order of `neighbours`;
        (q,) weights, whose sum is the volume of the ideal.

        Examples
        --------
        >>> gradients, weights = TypedRows(TETRAHEDRON, slice(0, 1)).rule("corners")
        >>> gradients[0, :3].astype(int).tolist(), weights.round(6)
        ([[-1, -1, -1], [1, 0, 0], [0, 1, 0]], array([0.117851]))
        """
        if self.cell_type is HEXAHEDRON:
            points, weights = QUADRATURE_RULES[quadrature]()
            return shape_gradients(points), weights
        samples, places = self.cell_type.samples, np.array(self.places)
        gradients = np.zeros((len(samples), 8, 3))
        for q, corner in enumerate(samples):
            gradients[q, places[corner]] = -1.0
            gradients[q, places[self.cell_type.neighbours[corner]], [0, 1, 2]] = 1.0
        return gradients, np.full(len(samples), self.cell_type.volume / len(samples))


def collapsed_cells(cells: Ints, cell_type: CellType) -> Ints:
    """Cells (k, j) of a type as hexahedra (k, 8), quadratic ones by their corners.

    Examples
    --------
    >>> collapsed_cells(np.arange(6)[None], WEDGE)
    array([[0, 1, 2, 2, 3, 4, 5, 5]])
    """
    return np.ascontiguousarray(cells[:, COLLAPSED[cell_type.linear.name]])


def recognized(cells: Ints) -> list[tuple[CellType, Ints, Ints]]:
    """Which hexahedra (k, 8) are wedges, pyramids or tetrahedra, as some of their nodes coincide, whichever these are.

    Returns
    -------
    For each type that is among them: the type, the (j,) rows, and their (j, i) nodes.

    Examples
    --------
    >>> [(one.name, rows, nodes) for one, rows, nodes in recognized(np.array([[0, 0, 1, 2, 3, 3, 4, 5]]))]
    [('wedge', array([0]), array([[1, 2, 0, 4, 5, 3]]))]
    """
    found, left = [], np.arange(len(cells))
    for cell_type in (TETRAHEDRON, WEDGE, PYRAMID):
        pattern = COLLAPSED[cell_type.name]
        places = [pattern.index(node) for node in cell_type.nodes]
        rows, nodes = [left[:0]], [np.empty((0, len(places)), dtype=np.int64)]
        for turn in _turns():
            turned = cells[left][:, turn]
            own = turned[:, places]
            ordered = np.sort(own, axis=1)
            fits = (turned == own[:, pattern]).all(axis=1) & (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
            rows.append(left[fits])
            nodes.append(own[fits])
            left = left[~fits]
        if sum(map(len, rows)):
            found.append((cell_type, np.concatenate(rows), np.concatenate(nodes).astype(np.int64)))
    return found


@cache
def _turns() -> tuple[tuple[int, ...], ...]:
    """The 24 rotations of a hexahedron, as orders of its nodes."""
    generators = (1, 2, 3, 0, 5, 6, 7, 4), (0, 3, 7, 4, 1, 2, 6, 5)
    turns = [tuple(range(8))]
    for turn in turns:  # grows in the loop
        turns += {tuple(turn[i] for i in step) for step in generators} - set(turns)
    return tuple(turns)


def are_collapsed(cells: Ints) -> NDArray[np.bool_]:
    """(m,) cells that are no hexahedra; places 6 and 7 are one node in all other types."""
    return np.asarray(cells[:, 6] == cells[:, 7])


def rows_by_type(cells: Ints) -> tuple[TypedRows, ...]:
    """The types in a table (m, 8), each with its cells, in the order in which they come first.

    Examples
    --------
    >>> table = np.concatenate([collapsed_cells(np.arange(5)[None], PYRAMID), np.arange(8)[None]])
    >>> [(one.cell_type.name, one.rows) for one in rows_by_type(table)]
    [('pyramid', slice(0, 1, None)), ('hexahedron', slice(1, 2, None))]
    """
    others = are_collapsed(cells)
    if not others.any():
        return (TypedRows(HEXAHEDRON, slice(0, len(cells))),)
    # A triangle below, and a point above: neither, one of them, or both.
    kinds = others * (1 + (cells[:, 2] == cells[:, 3]) + 2 * (cells[:, 4] == cells[:, 5]))
    types = HEXAHEDRON, None, WEDGE, PYRAMID, TETRAHEDRON
    found = []
    for kind in np.unique(kinds):
        rows, cell_type = np.flatnonzero(kinds == kind), types[kind]
        if cell_type is None:
            raise ValueError("cells with coinciding nodes must be collapsed as one of the linear types is")
        together = rows[-1] - rows[0] == len(rows) - 1
        found.append((rows[0], TypedRows(cell_type, slice(int(rows[0]), int(rows[-1]) + 1) if together else rows)))
    return tuple(one for _, one in sorted(found, key=lambda pair: pair[0]))
