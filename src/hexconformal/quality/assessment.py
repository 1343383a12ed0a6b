"""Quality of every cell: measures at the corners of each, and certified ones inside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import Serializable
from ..elements import HEXAHEDRON, MEASURES, SOLID_TYPES, cell_measures, contiguous, measures_of
from ..io import as_volume_mesh
from ..mesh import CellBlock, MixedMesh, require_nodes, with_wedges_upright
from .statistics import Statistics, as_table, statistics

__all__ = ["MEASURES", "MixedQuality", "MixedSummary", "Quality", "Summary", "TypedCell", "WorstCell", "quality"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class WorstCell:
    """One of the cells of smallest scaled Jacobian, by the label that its file gives it, and where it is."""

    id: int | str
    scaled_jacobian: float
    centre: tuple[float, float, float]


@dataclass(frozen=True)
class TypedCell(WorstCell):
    """The same in a mesh of several types, with the name of its type."""

    type: str


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
        return "\n".join([self._counts("cells"), *as_table({name: getattr(self, name) for name in MEASURES})])

    __repr__ = __str__

    def _counts(self, what: str) -> str:
        return f"{self.count} {what}, {self.inverted} inverted, {self.invalid} invalid, volume {self.total_volume:.6g}"


@dataclass(frozen=True, repr=False)
class MixedSummary(Summary):
    """The same of a mesh of several types: all figures are about all cells.

    Attributes
    ----------
    types
        Summaries of the cells of each type, by its name: "hexahedron", "wedge", "pyramid", "tetra", "hexahedron20",
        "hexahedron27", "wedge15", "wedge18", "pyramid13", "pyramid14", "tetra10".
    """

    types: dict[str, Summary]

    def __str__(self) -> str:
        lines = [self._counts("cells")] if len(self.types) > 1 else []
        for name, one in self.types.items():
            head = one._counts(SOLID_TYPES[name].plural if one.count != 1 else SOLID_TYPES[name].singular)
            lines += [head, *as_table({measure: getattr(one, measure) for measure in MEASURES})]
        return "\n".join(lines)

    __repr__ = __str__


@dataclass(frozen=True, eq=False, repr=False)
class Quality:
    """Measures of every cell, each an (m,) array.

    J is that of equation (6a): of other cells than hexahedra against the ideal of their type, whose edges are equal. Of
    quadratic cells what is said of corners holds for a lattice of places in each, nine along an edge.

    Attributes
    ----------
    scaled_jacobian
        det J over the product of the three edge lengths, smallest of the eight corners; in [-1, 1], 1 for
        bricks, 0 at the most where an edge has no length. Of wedges, tetrahedra and the bases of pyramids over that of
        the ideal, which has 1.
    minimum_jacobian
        Certified lower bound of min det J / max |det J| over the whole cell; in [-1, 1], 1 for
        parallelepipeds. Positive exactly where ``valid`` (Johnen, Weill & Remacle 2017), equations (13) and (13c).
    shape
        Mean ratio 3 det^(2/3) / |J|^2, smallest of the corners; 1 for cubes and ideals, 0 where a corner is inverted.
    conformal_distortion
        E / (4 |J|^2), E the quaternionic conformal distortion, largest of the corners; 0 for cubes and ideals, at
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
        return f"{type(self).__name__}({len(self.valid)} cells, {inverted} inverted, {invalid} invalid)"

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
            **self._figures(),
            worst=tuple(
                WorstCell(name, float(self.scaled_jacobian[i]), (float(x), float(y), float(z)))
                for name, i, (x, y, z) in zip(names, order, centres, strict=True)
            ),
        )

    def _figures(self) -> dict[str, Any]:
        """The fields of a summary that are about all cells."""
        return {
            "count": len(self.valid),
            "inverted": int((self.scaled_jacobian <= 0).sum()),
            "invalid": int((~self.valid).sum()),
            "total_volume": float(self.volume.sum()),
            **{name: statistics(getattr(self, name)) for name in MEASURES},
        }

    def worst(self, count: int) -> Ints:
        """Ids (count,) of the cells of smallest scaled Jacobian, worst first."""
        return np.argsort(self.scaled_jacobian, kind="stable")[: max(count, 0)]

    def cell_blocks(self) -> tuple[CellBlock, ...]:
        """The cells by their type."""
        return (CellBlock(HEXAHEDRON, self.cells, np.arange(len(self.cells))),)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All measures by name, and `valid` as zeros and ones, to put them on a mesh."""
        return {**{name: getattr(self, name) for name in MEASURES}, "valid": self.valid.astype(np.uint8)}


@dataclass(frozen=True, eq=False, repr=False)
class MixedQuality(Quality):
    """Measures of every cell of a mesh of several types, each an (m,) array in the order of the cells.

    Attributes
    ----------
    blocks
        The cells by their type. In `cells` (m, 8) the last node of a cell stands for those that it has not;
        quadratic ones have their corners there.
    """

    blocks: tuple[CellBlock, ...] = ()

    def cell_blocks(self) -> tuple[CellBlock, ...]:
        """The cells by their type."""
        return self.blocks

    def by_type(self) -> dict[str, Quality]:
        """The measures of the cells of each type, by its name."""
        return {block.cell_type.name: self._of(block) for block in self.blocks}

    def summary(self, worst: int = 5) -> MixedSummary:
        """Reduce to a few numbers, of all cells and of each type.

        Parameters
        ----------
        worst
            How many of the worst cells to name, of all and of each type.
        """
        order, names = self.worst(worst), np.empty(len(self.cells), dtype=object)
        for block in self.blocks:
            names[block.places] = block.cell_type.name
        labels = (order if self.labels is None else self.labels[order]).tolist()
        centres = [tuple(self.points[np.unique(nodes)].mean(axis=0).tolist()) for nodes in self.cells[order]]
        return MixedSummary(
            **self._figures(),
            worst=tuple(
                TypedCell(label, float(self.scaled_jacobian[i]), centre, names[i])
                for label, i, centre in zip(labels, order, centres, strict=True)
            ),
            types={name: one.summary(worst) for name, one in self.by_type().items()},
        )

    def _of(self, block: CellBlock) -> Quality:
        labels = np.arange(len(self.cells)) if self.labels is None else self.labels
        measures = {name: getattr(self, name)[block.places] for name in (*MEASURES, "valid")}
        return Quality(**measures, points=self.points, cells=block.cells, labels=labels[block.places])


def quality(mesh: Any) -> Quality:
    """Measure every cell of a mesh.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes: wedges, pyramids and tetrahedra, and cells of second
        order, are measured, too. Points and cells by the name of their type, ``(points, {"tetra": cells})``, will do.

    Returns
    -------
    Quality
        Measures of every cell, each an (m,) array; a MixedQuality, which has those of each type, if not all cells are
        hexahedra.

    Raises
    ------
    MeshError
        If it has no cells of these types, solid cells of others, or cells of nodes that there are none of.
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
    mesh = as_volume_mesh(mesh)
    require_nodes(mesh)
    if isinstance(mesh, MixedMesh):
        return _measure_types(with_wedges_upright(mesh))
    points, cells = contiguous(mesh.points, mesh.cells)
    rows = cell_measures(points, cells)
    measures = dict(zip(MEASURES, rows, strict=True))
    return Quality(**measures, valid=rows[1] > 0, points=points, cells=cells, labels=mesh.cell_labels)


def _measure_types(mesh: MixedMesh) -> MixedQuality:
    count = sum(len(block.cells) for block in mesh.blocks)
    rows, cells = np.empty((len(MEASURES), count)), np.empty((count, 8), dtype=np.int64)
    for block in mesh.blocks:
        rows[:, block.places] = measures_of(mesh.points, block.cells, block.cell_type)
        cells[block.places] = block.cells[:, np.minimum(np.arange(8), block.cells.shape[1] - 1)]
    measures: dict[str, Any] = dict(zip(MEASURES, rows, strict=True))
    return MixedQuality(
        **measures, valid=rows[1] > 0, points=mesh.points, cells=cells, labels=mesh.cell_labels, blocks=mesh.blocks
    )
