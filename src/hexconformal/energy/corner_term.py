"""The distortion at the corners of cells: equations (8), (11) and (12).

It serves where the quaternionic energy (6) is not enough: tangled cells, cells that are barely valid, and the worst
cells of an otherwise good mesh. Everything is measured at the corners, where the scaled Jacobian is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNERS, HEXAHEDRON, CellType, TypedRows, rows_by_type
from ..kernel import EIGHT, CellChunks, Lanes, parallel_ranges
from .block_matrix import Places
from .corner_kernels import corner_densities, corner_fullness, corner_sums
from .target import inverses_of
from .term import Patch, SummedTerm

__all__ = ["CornerMeasures", "CornerTerm", "CornerWeights"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Corners:
    """The corners of a type of cells, which are its first nodes.

    Attributes
    ----------
    table
        (k, 6) the neighbours of each corner, and the signs that turn edges into derivatives.
    lanes, nodes
        As many numbers as there are corners, and nodes.
    pairs
        Where the pairs a >= b of its nodes are among those of the eight places of a hexahedron.
    weight
        What a corner counts, that of a hexahedron 1: a cell as much as its ideal has volume.
    """

    table: Ints
    lanes: Lanes
    nodes: Lanes
    pairs: Ints
    weight: float

    @classmethod
    def of_hexahedron(cls) -> _Corners:
        """Those of the hexahedron, the edges at each in the order of the axes."""
        neighbours = [[int(np.flatnonzero((CORNERS ^ corner == axis).all(axis=1))[0]) for axis in np.eye(3, dtype=int)]
                      for corner in CORNERS]  # fmt: skip
        table = np.ascontiguousarray(np.hstack([neighbours, 1 - 2 * CORNERS]), dtype=np.int64)
        return cls(table, EIGHT, EIGHT, np.arange(36), 1.0)

    @classmethod
    def of_type(cls, cells: TypedRows) -> _Corners:
        """Those of a type of cells."""
        cell_type, places = cells.cell_type, cells.places
        if cell_type is HEXAHEDRON:
            return _HEXAHEDRON
        neighbours = cell_type.neighbours[list(cell_type.samples)]
        table = np.ascontiguousarray(np.hstack([neighbours, np.ones_like(neighbours)]), dtype=np.int64)
        pairs = [places[a] * (places[a] + 1) // 2 + places[b] for a in cell_type.nodes for b in range(a + 1)]
        return cls(table, cell_type.samples, cell_type.nodes, np.array(pairs), 8.0 * cell_type.volume / len(table))


_HEXAHEDRON = _Corners.of_hexahedron()


class _Part(NamedTuple):
    """The cells of one type in a term, by their own nodes, with what is theirs."""

    cell_type: CellType
    rows: slice | Ints
    cells: Ints
    corners: _Corners
    inverses: Field
    chunks: CellChunks | None

    def places(self, places: Places) -> Places:
        """Those of the pairs of its own nodes, of those of the whole table (m, 36); none of none."""
        if self.chunks is None or len(places) == 0:
            return places
        own = places[self.rows]
        return own if self.corners is _HEXAHEDRON else np.ascontiguousarray(own[:, self.corners.pairs])


@dataclass(frozen=True)
class CornerWeights:
    """Weights of what is summed over the corners, equations (8), (12) and (12a).

    Attributes
    ----------
    distortion
        Weight of the whole distortion, edge lengths and angles against the target.
    angle
        Weight of the angles alone: the distortion of the unit columns, edge lengths free.
    stiffness
        phi(e) = e / (1 - stiffness e): no corner gets worse than 1 / stiffness. One for all types of cells, or that of
        each by its name.
    eps
        Of the barrier chi_eps; 0 once nothing is folded.
    proportion
        Weight of the proportions of edges that meet.
    """

    distortion: float = 1.0
    angle: float = 0.0
    stiffness: float | Mapping[str, float] = 0.0
    eps: float = 0.0
    proportion: float = 0.0

    def stiffness_of(self, cell_type: CellType) -> float:
        """That of a type of cells."""
        return self.stiffness[cell_type.name] if isinstance(self.stiffness, Mapping) else self.stiffness

    def largest_angles(self, cells: Ints) -> Field:
        """(m,) density of angles that no corner of each cell may reach: 1 / stiffness, infinite where that is 0."""
        largest = np.full(len(cells), np.inf)
        for one in rows_by_type(cells):
            if (stiffness := self.stiffness_of(one.cell_type)) > 0.0:
                largest[one.rows] = 1.0 / stiffness
        return largest


@dataclass(frozen=True)
class CornerMeasures:
    """Per cell: what its corners have.

    Attributes
    ----------
    determinant
        (m,) smallest det f.
    fullness
        (m,) smallest det f / (|f|^2 / 3)^(3/2), 1 for a cube, next to nothing for what has next to no volume.
    slenderness
        (m,) largest ratio of the lengths of two columns of f; infinite where one has no length.
    distortion, angle
        (m,) largest densities e(f) and e(u); infinite where folded.
    """

    determinant: Field
    fullness: Field
    slenderness: Field
    distortion: Field
    angle: Field


@dataclass(frozen=True, eq=False)
class CornerTerm(SummedTerm):
    """Distortion and angles at the corners of cells; infinite where one is folded, or worse than the stiffness allows.

    Attributes
    ----------
    cells
        (m, 8) nodes, VTK order, other types than hexahedra collapsed.
    inverses
        Inverse target frames as in :class:`hexconformal.energy.distortion_term.DistortionTerm`, empty for cubes; those
        of other types, where there is one for every cell, with that of their ideal.
    weights
        Weights of the two.
    scales
        (m,) weight of each cell; empty where every cell counts the same.
    slender
        (m,) slenderness of each cell up to which its proportions cost nothing; empty where they never cost anything.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> round(CornerTerm(cells, np.empty((0, 1, 3, 3))).value(points) / 8, 10)  # every corner counts 1
    544.2858935546
    """

    cells: Ints
    inverses: Field
    weights: CornerWeights = CornerWeights()
    scales: Field = field(default_factory=lambda: np.empty(0))
    slender: Field = field(default_factory=lambda: np.empty(0))

    @cached_property
    def _parts(self) -> tuple[_Part, ...]:
        """The cells type by type; of hexahedra alone nothing is copied."""
        typed = rows_by_type(self.cells)
        if len(typed) == 1 and typed[0].cell_type is HEXAHEDRON:
            return (_Part(HEXAHEDRON, typed[0].rows, self.cells, _HEXAHEDRON, self.inverses, None),)
        return tuple(self._part(one) for one in typed)

    def _part(self, one: TypedRows) -> _Part:
        inverses = inverses_of(self.inverses, one, len(self.cells))
        cells = np.ascontiguousarray(one.own_nodes(self.cells))
        chunks = CellChunks.of(cells, int(cells.max(initial=-1)) + 1)
        return _Part(one.cell_type, one.rows, cells, _Corners.of_type(one), inverses, chunks)

    def _sums(
        self, chunks: CellChunks, points: Field, order: int, gradient: Field, data: Field, places: Places
    ) -> float:
        w, total = self.weights, 0.0
        for part in self._parts:
            weight, rows = part.corners.weight, part.rows
            scales, slender = (values[rows] if len(values) else values for values in (self.scales, self.slender))
            # The proportions of other types are in their shape.
            proportion = w.proportion if part.corners is _HEXAHEDRON else 0.0
            stiffness = w.stiffness_of(part.cell_type)
            settings = scales, w.eps, weight * w.distortion, weight * w.angle, stiffness, proportion, slender, order
            where = gradient, data, part.places(places), part.corners.lanes, part.corners.nodes
            own = chunks if part.chunks is None else part.chunks
            total += own.total(corner_sums, points, part.cells, part.corners.table, part.inverses, *settings, *where)
            if not np.isfinite(total):
                return float("inf")
        return total

    def restricted(self, patch: Patch) -> CornerTerm:
        """The same of the cells of a patch."""
        inverses = self.inverses[patch.cells] if len(self.inverses) > 1 else self.inverses
        scales = self.scales[patch.cells] if len(self.scales) else self.scales
        slender = self.slender[patch.cells] if len(self.slender) else self.slender
        cells = patch.local[self.cells[patch.cells]]
        return replace(self, cells=cells, inverses=inverses, scales=scales, slender=slender)

    def measures(self, points: Field) -> CornerMeasures:
        """Figures of every cell, weights aside."""
        return CornerMeasures(*self._measured(corner_densities, points, 5))

    def fullness(self, points: Field) -> Field:
        """(m,) that of :class:`CornerMeasures` alone, in less than half of the time."""
        return np.asarray(self._measured(corner_fullness, points, 1)[0])

    def _measured(self, function: Callable[..., None], points: Field, count: int) -> Field:
        """(count, m) what a compiled loop finds of every cell."""
        out = np.empty((count, len(self.cells)))
        for part in self._parts:
            columns = np.empty((count, len(part.cells)))
            corners = part.corners
            settings = part.cells, corners.table, part.inverses, corners.lanes
            parallel_ranges(function, len(part.cells), points, *settings, *columns)
            out[:, part.rows] = columns
        return out
