"""What a page has of a mesh that is too large to have all: some cells, and few triangles in the place of the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .contents import Cells

__all__ = ["cells_to_show", "coarse_faces"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def cells_to_show(cells: Cells, rankings: Sequence[Floats], worst: int) -> Mask:
    """(m,) the worst cells by each ranking (m,), those with a node of these, and of volumes those at the boundary.

    Parameters
    ----------
    cells
        All of them.
    rankings
        Values of the cells in each frame, the worst being the smallest.
    worst
        How many cells of each ranking.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal import HexMesh
    >>> from hexconformal.page.volume_cells import volume_cells
    >>> kept = cells_to_show(volume_cells(HexMesh(*box((7, 7, 7)))), [np.abs(np.arange(343) - 171)], 1)
    >>> kept.sum() - (7**3 - 5**3)  # the one in the middle, and the 26 around it
    np.int64(27)
    """
    chosen = np.zeros(cells.count, dtype=bool)
    for ranking in rankings:
        chosen[np.argsort(ranking, kind="stable")[:worst]] = True
    one, other = cells.sides.T
    nodes = np.zeros(int(cells.faces.max(initial=0)) + 1, dtype=bool)
    nodes[cells.faces[chosen[one] | ((other >= 0) & chosen[other])]] = True
    around = nodes[cells.faces].any(axis=1)
    kept = chosen
    kept[one[around]] = True
    kept[other[around & (other >= 0)]] = True
    if cells.layers is not None:
        kept[one[other < 0]] = True
    return kept


def coarse_faces(points: Floats, faces: Ints, wanted: int) -> Ints:
    """(k, 4) triangles, their last node twice, about as many as wanted, that lie near a surface.

    They are those that are left when nodes that matter least to the shape are taken out (VTK's `vtkDecimatePro`:
    Schroeder, Zarge & Lorensen, "Decimation of triangle meshes", SIGGRAPH 1992). What is left has nodes of the surface
    only, so that these have their places and values in other frames, too. Nodes on the border stay: there it fits
    to what is left out of it.

    Parameters
    ----------
    points
        (n, 3) positions.
    faces
        (f, 4) nodes; triangles have their last node twice.
    wanted
        How many; there are more where the border, or the connections, need them.

    Examples
    --------
    >>> import pyvista as pv
    >>> ball = pv.Icosphere(nsub=4)
    >>> coarse = coarse_faces(ball.points, ball.regular_faces[:, [0, 1, 2, 2]], 500)
    >>> ball.n_cells, coarse.shape
    (5120, (500, 4))
    """
    import pyvista as pv

    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[faces[:, 2] != faces[:, 3]][:, [0, 2, 3]]])
    if len(triangles) > wanted:
        nodes, compact = np.unique(triangles, return_inverse=True)
        surface = pv.PolyData.from_regular_faces(points[nodes], compact.reshape(-1, 3).astype(int))
        surface.point_data["node"] = nodes
        kept = surface.decimate_pro(
            1.0 - wanted / len(triangles), preserve_topology=True, boundary_vertex_deletion=False
        )
        triangles = np.asarray(kept.point_data["node"], dtype=np.int64)[kept.regular_faces]
    return triangles[:, [0, 1, 2, 2]]
