"""Cells in a foreign node order, or mirrored, put into VTK's order."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import CORNER_NEIGHBOURS, CORNERS
from ..io import as_hex_mesh
from ..mesh import HexMesh, connected_components, face_table

__all__ = ["NO_BOUNDARY", "Order", "OrientReport", "centre_determinants", "detect_order", "orient"]

NO_BOUNDARY = (
    "there is no boundary: every face has a cell on both sides, as where the ends of a periodic mesh are one; "
    "give the cells at one end nodes of their own"
)

_MIRRORED_ORDER = [4, 5, 6, 7, 0, 1, 2, 3]

# Names of node orders, and where in such a cell VTK's eight nodes are found.
_ORDERS = {
    "VTK": [0, 1, 2, 3, 4, 5, 6, 7],
    "lexicographic": [0, 1, 3, 2, 4, 5, 7, 6],
    "bottom and top alternating": [0, 2, 4, 6, 1, 3, 5, 7],
    "top face listed backwards": [0, 1, 2, 3, 7, 6, 5, 4],
}


@dataclass(frozen=True)
class Order:
    """A node order: its name, the places of VTK's nodes in it, and True if most cells are mirrored in it."""

    name: str
    permutation: tuple[int, ...]
    mirrored: bool


@dataclass(frozen=True, eq=False)
class OrientReport:
    """Report of :func:`orient`.

    Attributes
    ----------
    order
        Name of the node order the cells were in: "VTK", "lexicographic", ...
    mirrored
        (k,) ids of the cells that were mirrored and have been turned round.
    """

    order: str
    mirrored: NDArray[np.int64]

    @property
    def changed(self) -> bool:
        """True where any cell is different now."""
        return self.order != "VTK" or len(self.mirrored) > 0


def orient(mesh: Any) -> tuple[HexMesh, OrientReport]:
    """Put all cells into VTK's node order, none of them mirrored; points stay where they are.

    The node order is the one of a few known ones in which most cells are sound. Then cells are turned round so
    that neighbours agree on which side of their common face is out, and so that each connected part has a
    positive volume. That is a matter of connectivity: a cell that is inverted because the mesh is tangled stays
    inverted, for untangling.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.

    Returns
    -------
    mesh : HexMesh
        The mesh with cells in VTK order; as it was if there was nothing to do.
    report : OrientReport
        Order and mirrored cells that were found.

    Raises
    ------
    MeshError
        If no choice makes all neighbours agree (a Moebius band of cells), or there is no boundary that tells in
        from out.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> mesh, report = orient(HexMesh(CORNERS, [[4, 5, 6, 7, 0, 1, 2, 3]]))
    >>> mesh.cells, report.mirrored
    (array([[0, 1, 2, 3, 4, 5, 6, 7]]), array([0]))
    """
    mesh = as_hex_mesh(mesh)
    order = detect_order(mesh.points, mesh.cells)
    cells = mesh.cells[:, order.permutation]
    mirrored = _mirrored(mesh, cells)
    report = OrientReport(order.name, np.flatnonzero(mirrored))
    if not report.changed:
        return mesh, report
    cells[mirrored] = cells[mirrored][:, _MIRRORED_ORDER]
    return replace(mesh, cells=cells), report


def detect_order(points: NDArray[np.float64], cells: NDArray[np.int64]) -> Order:
    """The node order in which most of the cells are sound, all their corners of one sign.

    VTK's own is left only for one that makes most cells sound, and more than twice as many.
    """
    best, most = "VTK", -1
    mirrored = False
    for name, permutation in _ORDERS.items():
        positive, negative = _count_one_sign(points, cells[:, permutation])
        count = positive + negative
        if name == "VTK":
            most, mirrored, needed = count, negative > positive, max(2 * count, len(cells) // 2)
            if 2 * count > len(cells):
                break
        elif count > max(most, needed):
            best, most, mirrored = name, count, negative > positive
    return Order(best, tuple(_ORDERS[best]), bool(mirrored))


def centre_determinants(
    points: NDArray[np.float64], cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Determinant of the trilinear map at each cell's centre, and the product of its three edge lengths there."""
    volumes, sizes = np.empty(len(cells)), np.empty(len(cells))
    signs = (CORNERS.T - 0.5) / 2
    for first in range(0, len(cells), 20_000):
        x = points[cells[first : first + 20_000]]
        edges = signs @ x
        part = slice(first, first + len(x))
        volumes[part] = _determinant(edges[:, 0], edges[:, 1], edges[:, 2])
        sizes[part] = np.sqrt(np.einsum("cij,cij->ci", edges, edges).prod(axis=1))
    return volumes, sizes


def _count_one_sign(points: NDArray[np.float64], cells: NDArray[np.int64]) -> tuple[int, int]:
    """Numbers of cells with all eight corners positive, and all negative."""
    positive = negative = 0
    for first in range(0, len(cells), 20_000):
        x = points[cells[first : first + 20_000]]
        edges = x[:, CORNER_NEIGHBOURS] - x[:, :, None]
        values = _determinant(edges[:, :, 0], edges[:, :, 1], edges[:, :, 2])
        positive += int((values > 0).all(axis=1).sum())
        negative += int((values < 0).all(axis=1).sum())
    return positive, negative


def _determinant(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    return (
        a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
        + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
        + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
    )


def _mirrored(mesh: HexMesh, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) cells to turn round, so that neighbours agree and each part has positive volume."""
    count = len(cells)
    faces = face_table(cells)
    if (faces.uses > 1).all():
        raise MeshError(NO_BOUNDARY)
    joined = (faces.uses == 2) & (faces.orientation != 0)
    a, b = faces.cells[joined].T
    swap = faces.orientation[joined] < 0
    # Two copies of each cell, as it is and turned round, are linked with those copies of its neighbours that agree.
    rows = np.concatenate([a, a + count])
    columns = np.concatenate([np.where(swap, b + count, b), np.where(swap, b, b + count)])
    sheets = connected_components(np.stack([rows, columns]).T, 2 * count)
    torn = np.flatnonzero(sheets[:count] == sheets[count:])
    if len(torn):
        raise MeshError(f"cells that cannot be oriented like their neighbours: {first_ids(torn, mesh.cell_labels)}")
    volumes, _ = centre_determinants(mesh.points, cells)
    total = np.bincount(sheets[:count], volumes, 2 * count) - np.bincount(sheets[count:], volumes, 2 * count)
    return total[sheets[:count]] < 0
