"""Types of cells as tables: all that differs between a tetrahedron and a hexahedron for who loops over cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["CellType"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class CellType:
    """A type of cells, nodes in VTK's order; of quadratic ones the tables are about corners, which come first.

    At a corner q with the edges E_q (columns, in the order of `neighbours`) to its three neighbours, cells are measured
    by J = E_q W^-1 with the matrix `inverse_target`, equation (6a). One matrix serves all corners, as those of the
    ideal are alike and its axes turn with them. J is a rotation for the ideal with edges of length one.

    Attributes
    ----------
    name
        As meshio has it.
    singular, plural
        As messages have it.
    vtk
        Its number in VTK, 0 of what VTK does not have.
    ideal
        (n, 3) nodes of the ideal cell, all edges of length one.
    axes
        (3, 3) the axes, as columns, in which the corner at node 0 of the ideal is measured: its symmetries permute
        corners and axes alike, so that the order of the nodes does not matter.
    neighbours
        (k, 3) neighbours of the corners, which are the first k nodes; a valid cell spans a positive volume at each.
    samples
        The corners at which cells are measured: one of a tetrahedron, where all have the same J up to the order of its
        columns. A tuple, as is `nodes`: loops know at compile time how many there are.
    edges
        (e, 2) from node to node.
    faces
        Triangles and quadrilaterals, counter-clockwise seen from outside.
    mirrored
        An order of the nodes in which the cell is inside out.
    reference_volume
        Of the domain over which det J is integrated to the volume of a cell.
    straight
        Of a quadratic type the linear one that has the same corners; None of linear ones.

    Examples
    --------
    >>> from hexconformal.elements import WEDGE
    >>> WEDGE, WEDGE.nodes, WEDGE.samples
    (CellType('wedge'), (0, 1, 2, 3, 4, 5), (0, 1, 2, 3, 4, 5))
    >>> round(WEDGE.volume, 6), round(WEDGE.corner_volume, 6)
    (0.433013, 0.866025)
    """

    name: str
    singular: str
    plural: str
    vtk: int
    ideal: Field
    axes: Field
    neighbours: Ints
    samples: tuple[int, ...]
    edges: Ints
    faces: tuple[tuple[int, ...], ...]
    mirrored: tuple[int, ...]
    reference_volume: float
    straight: CellType | None = None

    def __post_init__(self) -> None:
        for table in (self.ideal, self.axes, self.neighbours, self.edges):
            table.setflags(write=False)

    def __repr__(self) -> str:
        return f"CellType({self.name!r})"

    @cached_property
    def nodes(self) -> tuple[int, ...]:
        """The numbers of its nodes."""
        return tuple(range(len(self.ideal)))

    @property
    def linear(self) -> CellType:
        """The linear type with the same corners: itself if it is one."""
        return self if self.straight is None else self.straight

    @property
    def corners(self) -> int:
        """Number of corners, which come first."""
        return len(self.linear.ideal)

    @cached_property
    def reference_corners(self) -> Field:
        """(c, 3) reference coordinates of the corners: the first is the origin, its neighbours are the unit vectors."""
        first = self.ideal[: self.corners] - self.ideal[0]
        coordinates = np.rint(first @ np.linalg.inv(self._first_edges()).T) + 0.0
        coordinates.setflags(write=False)
        return coordinates

    @property
    def quads(self) -> tuple[tuple[int, ...], ...]:
        """Corners of its faces, four of each: triangles have their last twice."""
        return tuple((*face, face[-1])[:4] for face in self.faces)

    @cached_property
    def inverse_target(self) -> Field:
        """(3, 3) W^-1: takes the edges E of a corner to J = E W^-1."""
        inverse = np.linalg.inv(self._first_edges()) @ self.axes
        inverse.setflags(write=False)
        return inverse

    @cached_property
    def corner_volume(self) -> float:
        """Determinant of the edges at a corner of the ideal: its scaled Jacobian before it is made 1."""
        return float(np.linalg.det(self._first_edges()))

    @cached_property
    def volume(self) -> float:
        """Volume of the ideal, by which a cell counts beside others: there may be many tetrahedra in a hexahedron."""
        return self.corner_volume * self.reference_volume

    def _first_edges(self) -> Field:
        """(3, 3) edges at node 0 of the ideal, as columns."""
        return np.asarray((self.ideal[self.neighbours[0]] - self.ideal[0]).T)
