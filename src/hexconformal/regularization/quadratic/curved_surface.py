"""The boundary of a mesh of quadratic cells as faces so small that how far it is from another can be measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from ...geometry import SurfaceLocator, hausdorff, mean_distance
from ...mesh import CellBlock, MixedMesh
from .cut_mesh import CutMesh

__all__ = ["CurvedSurface", "largest_bend", "needed_parts"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_MOST = 1_000_000  # parts of the cells beside the surface at most, each of which takes some hundred bytes


def largest_bend(mesh: MixedMesh, faces: Ints) -> float:
    """How far faces (f, 4) may be away from the one of their corners: n parts along a side are n^2 times nearer.

    A quadratic curve with the nodes a, b, c is |a - 2 b + c| / 2 away from a straight line, at most; a triangle by that
    of all three of its sides.
    """
    cut = CutMesh(mesh, 2)
    parts = cut.faces(faces)
    grids = parts.grid_points(cut.places(mesh.points))
    sides = (grids, grids.swapaxes(1, 2), grids[parts.halves][:, [0, 1, 2], [2, 1, 0]])
    return 0.5 * sum(float(np.linalg.norm(x[:, 0] - 2.0 * x[:, 1] + x[:, 2], axis=-1).max(initial=0.0)) for x in sides)


def needed_parts(mesh: MixedMesh, bend: float, tolerance: float, least: int = 2, most: int = 32) -> int:
    """Parts of edges, a power of two, with which faces that bend so far are followed within a tolerance, if may be."""
    cells, parts = sum(len(block.cells) for block in mesh.blocks), least
    while parts < most and bend > tolerance * parts**2 and 8 * cells * parts**3 <= _MOST:
        parts *= 2
    return parts


@dataclass(frozen=True, eq=False)
class CurvedSurface:
    """Some faces of a mesh, cut into small ones.

    Attributes
    ----------
    quads
        (q, 4) the quads, by rows of the matrix.
    matrix
        (k, n) takes points of the mesh to those of the quads.
    sheets
        (q,) sheet of each quad, where each is compared with itself.
    """

    quads: Ints
    matrix: scipy.sparse.csr_array
    sheets: Ints | None = None

    @classmethod
    def of(cls, mesh: MixedMesh, faces: Ints, tolerance: float, sheets: Ints | None = None) -> CurvedSurface:
        """The faces (f, 4), given by their corners, cut so finely that quads are within a tolerance, if may be.

        Of several sheets (f,) each is compared with itself.
        """
        touched = np.zeros(len(mesh.points), dtype=bool)
        touched[faces] = True
        beside = replace(mesh, blocks=_some(mesh.blocks, touched), cell_data={}, origin=None)
        parts = needed_parts(beside, largest_bend(beside, faces), tolerance)
        cut = CutMesh(beside, parts)
        quads = cut.faces(faces)
        nodes, which = np.unique(quads.nodes, return_inverse=True)
        return cls(which.reshape(-1, 4), cut.matrix(nodes), None if sheets is None else np.repeat(sheets, quads.each))

    def hausdorff(self, before: Field, after: Field, tolerance: float) -> float:
        """Hausdorff distance of the faces from where they were, with points (n, 3) of the mesh before and after."""
        if np.array_equal(before, after):
            return 0.0
        return hausdorff(self.matrix @ after, self.matrix @ before, self.quads, tolerance, sheets=self.sheets)

    def mean_distance(self, before: Field, after: Field) -> float:
        """Mean distance of the faces from where they were."""
        if np.array_equal(before, after):
            return 0.0
        moved, there = (SurfaceLocator(self.matrix @ points, self.quads) for points in (after, before))
        return mean_distance(moved, there, near=True)


def _some(blocks: Sequence[CellBlock], touched: NDArray[np.bool_]) -> tuple[CellBlock, ...]:
    """The cells with a corner among the nodes that are touched."""
    kept = [block.places[touched[block.cells[:, : block.cell_type.corners]].any(axis=1)] for block in blocks]
    order = np.sort(np.concatenate(kept))
    return tuple(
        CellBlock(block.cell_type, block.cells[np.isin(block.places, own)], np.searchsorted(order, own))
        for block, own in zip(blocks, kept, strict=True)
    )
