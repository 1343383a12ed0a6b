"""Quality of every cell: measures at the corners of each hexahedron, and certified ones inside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import Serializable
from ..elements import MEASURES, cell_measures, contiguous
from ..io import as_hex_mesh
from .statistics import Statistics, as_table, statistics

__all__ = ["MEASURES", "Quality", "Summary", "WorstCell", "quality"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class WorstCell:
    """One of the cells of smallest scaled Jacobian, by the label that its file gives it, and where it is."""

    id: int | str
    scaled_jacobian: float
    centre: tuple[float, float, float]


@dataclass(frozen=True, repr=False)
class Summary(Serializable):
    """The quality of a mesh in a few numbers.

    Attributes
    ----------
    count
        Number of cells.
    inverted
        Cells whose scaled Jacobian is not positive at some corner.
    invalid
        Cells that are not proved to have det J > 0 everywhere; contains the inverted ones.
    total_volume
        Sum of the cells' volumes.
    scaled_jacobian, minimum_jacobian, shape, conformal_distortion, edge_ratio, volume
        Distribution of each measure of `Quality`.
    worst
        Cells of smallest scaled Jacobian, worst first.
    """

    count: int
    inverted: int
    invalid: int
    total_volume: float
    scaled_jacobian: Statistics
    minimum_jacobian: Statistics
    shape: Statistics
    conformal_distortion: Statistics
    edge_ratio: Statistics
    volume: Statistics
    worst: tuple[WorstCell, ...]

    def __str__(self) -> str:
        head = f"{self.count} cells, {self.inverted} inverted, {self.invalid} invalid, volume {self.total_volume:.6g}"
        return "\n".join([head, *as_table({name: getattr(self, name) for name in MEASURES})])

    __repr__ = __str__


@dataclass(frozen=True, eq=False, repr=False)
class Quality:
    """Measures of every cell, each an (m,) array.

    Attributes
    ----------
    scaled_jacobian
        det J over the product of the three edge lengths, smallest of the eight corners; in [-1, 1], 1 for
        bricks, 0 at the most where an edge has no length.
    minimum_jacobian
        Certified lower bound of min det J / max |det J| over the whole cell; in [-1, 1], 1 for
        parallelepipeds. Positive exactly where ``valid`` (Johnen, Weill & Remacle 2017), equation (13).
    shape
        Mean ratio 3 det^(2/3) / |J|^2, smallest of the corners; 1 for cubes, 0 where a corner is inverted.
    conformal_distortion
        E / (4 |J|^2), E the quaternionic conformal distortion, largest of the corners; 0 for cubes, at
        most 1. Blind to orientation; below 1 - sqrt(3)/2 det J cannot vanish at the corners. Equation (7).
    edge_ratio
        Longest edge over the shortest; inf where one has no length.
    volume
        Integral of det J, in the mesh's unit of length cubed; exact.
    valid
        True where det J > 0 is proved everywhere in the cell.
    points, cells
        The mesh that was measured.
    labels
        What its file calls the cells; None if they are counted from 0.
    """

    scaled_jacobian: Floats
    minimum_jacobian: Floats
    shape: Floats
    conformal_distortion: Floats
    edge_ratio: Floats
    volume: Floats
    valid: NDArray[np.bool_]
    points: Floats
    cells: Ints
    labels: NDArray[Any] | None = None

    def __repr__(self) -> str:
        inverted, invalid = int((self.scaled_jacobian <= 0).sum()), int((~self.valid).sum())
        return f"Quality({len(self.valid)} cells, {inverted} inverted, {invalid} invalid)"

    def summary(self, worst: int = 5) -> Summary:
        """Reduce to a few numbers.

        Parameters
        ----------
        worst
            How many of the worst cells to name.

        Examples
        --------
        >>> from hexconformal.generate import box
        >>> summary = quality(box((2, 2, 2))).summary()
        >>> summary.count, summary.invalid, summary.shape.min
        (8, 0, 1.0)
        """
        order = self.worst(worst)
        centres = self.points[self.cells[order]].mean(axis=1)
        names = (order if self.labels is None else self.labels[order]).tolist()
        return Summary(
            count=len(self.cells),
            inverted=int((self.scaled_jacobian <= 0).sum()),
            invalid=int((~self.valid).sum()),
            total_volume=float(self.volume.sum()),
            **{name: statistics(getattr(self, name)) for name in MEASURES},
            worst=tuple(
                WorstCell(name, float(self.scaled_jacobian[i]), (float(x), float(y), float(z)))
                for name, i, (x, y, z) in zip(names, order, centres, strict=True)
            ),
        )

    def worst(self, count: int) -> Ints:
        """Ids (count,) of the cells of smallest scaled Jacobian, worst first."""
        return np.argsort(self.scaled_jacobian, kind="stable")[: max(count, 0)]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All measures by name, and `valid` as zeros and ones, to put them on a mesh."""
        return {**{name: getattr(self, name) for name in MEASURES}, "valid": self.valid.astype(np.uint8)}


def quality(mesh: Any) -> Quality:
    """Measure every cell of a mesh.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.

    Returns
    -------
    Quality
        Measures of every cell, each an (m,) array.

    Raises
    ------
    MeshError
        If it is no hexahedral mesh.
    ReadError
        If a file cannot be read.

    Examples
    --------
    >>> from hexconformal.generate import box, sheared_block
    >>> quality(sheared_block(2, shear=1.0)).scaled_jacobian.round(4)
    array([0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071])
    >>> q = quality(box((1, 1, 1), lengths=(1, 1, 2)))
    >>> q.valid, q.edge_ratio, q.conformal_distortion.round(4)
    (array([ True]), array([2.]), array([0.1667]))
    """
    hexes = as_hex_mesh(mesh)
    points, cells = contiguous(hexes.points, hexes.cells)
    rows = cell_measures(points, cells)
    measures = dict(zip(MEASURES, rows, strict=True))
    return Quality(**measures, valid=rows[1] > 0, points=points, cells=cells, labels=hexes.cell_labels)
