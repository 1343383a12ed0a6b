"""Cells in a foreign node order, or mirrored, put into VTK's order."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import CORNER_NEIGHBOURS, CORNERS, cell_volumes
from ..io import as_volume_mesh
from ..mesh import CellBlock, FaceTable, HexMesh, MixedMesh, connected_components, face_table, require_nodes

__all__ = ["NO_BOUNDARY", "Order", "OrientReport", "centre_determinants", "detect_order", "mirrored_cells"]
__all__ += ["orient"]

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
    """A node order: its name, and the places of VTK's nodes in it."""

    name: str
    permutation: tuple[int, ...]


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


def orient(mesh: Any) -> tuple[HexMesh | MixedMesh, OrientReport]:
    """Put all cells into VTK's node order, none of them mirrored; points stay where they are.

    The node order is the one of a few known ones in which most cells are sound. Then cells are turned round so
    that neighbours agree on which side of their common face is out, and so that each connected part has a
    positive volume. That is a matter of connectivity: a cell that is inverted because the mesh is tangled stays
    inverted, for untangling. Beside wedges, pyramids and tetrahedra only that is looked at, not other node orders.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes, or a mesh of several types of cells.

    Returns
    -------
    mesh : HexMesh or MixedMesh
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
    mesh = as_volume_mesh(mesh)
    require_nodes(mesh)
    if isinstance(mesh, MixedMesh):
        turned = mirrored_cells(mesh, face_table(mesh.table))
        blocks = tuple(_turned_round(block, turned[block.places]) for block in mesh.blocks)
        return (replace(mesh, blocks=blocks) if turned.any() else mesh), OrientReport("VTK", np.flatnonzero(turned))
    order = detect_order(mesh.points, mesh.cells)
    cells = mesh.cells[:, order.permutation]
    mirrored = _mirrored(face_table(cells), cell_volumes(mesh.points, cells), mesh.cell_labels)
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
    for name, permutation in _ORDERS.items():
        count = _count_one_sign(points, cells[:, permutation])
        if name == "VTK":
            most, needed = count, max(2 * count, len(cells) // 2)
            if 2 * count > len(cells):
                break
        elif count > max(most, needed):
            best, most = name, count
    return Order(best, tuple(_ORDERS[best]))


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


def _count_one_sign(points: NDArray[np.float64], cells: NDArray[np.int64]) -> int:
    """Number of cells with all eight corners positive, or all negative."""
    count = 0
    for first in range(0, len(cells), 20_000):
        x = points[cells[first : first + 20_000]]
        edges = x[:, CORNER_NEIGHBOURS] - x[:, :, None]
        values = _determinant(edges[:, :, 0], edges[:, :, 1], edges[:, :, 2])
        count += int(((values > 0).all(axis=1) | (values < 0).all(axis=1)).sum())
    return count


def _determinant(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    return (
        a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
        + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
        + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
    )


def mirrored_cells(mesh: MixedMesh, faces: FaceTable) -> NDArray[np.bool_]:
    """(m,) cells to turn round, so that neighbours agree and each part has positive volume.

    Raises
    ------
    MeshError
        If no choice makes all neighbours agree, or there is no boundary.
    """
    volumes = cell_volumes(mesh.points, mesh.table)
    return _mirrored(faces, volumes, mesh.cell_labels)


def _turned_round(block: CellBlock, rows: NDArray[np.bool_]) -> CellBlock:
    cells = block.cells.copy()
    cells[rows] = cells[rows][:, list(block.cell_type.mirrored)]
    return replace(block, cells=cells)


def _mirrored(faces: FaceTable, volumes: NDArray[np.float64], labels: NDArray[Any] | None) -> NDArray[np.bool_]:
    """(m,) cells of these volumes to turn round."""
    count = len(volumes)
    if (faces.counts > 1).all():
        raise MeshError(NO_BOUNDARY)
    joined = (faces.counts == 2) & (faces.orientation != 0)
    a, b = faces.cells[joined].T
    swap = faces.orientation[joined] < 0
    # Two copies of each cell, as it is and turned round, are linked with those copies of its neighbours that agree.
    rows = np.concatenate([a, a + count])
    columns = np.concatenate([np.where(swap, b + count, b), np.where(swap, b, b + count)])
    sheets = connected_components(np.stack([rows, columns]).T, 2 * count)
    torn = np.flatnonzero(sheets[:count] == sheets[count:])
    if len(torn):
        raise MeshError(f"cells that cannot be oriented like their neighbours: {first_ids(torn, labels)}")
    total = np.bincount(sheets[:count], volumes, 2 * count) - np.bincount(sheets[count:], volumes, 2 * count)
    return total[sheets[:count]] < 0
