"""Linear hexahedra as quadratic ones, straight, whose nodes between corners are shared."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..elements import QUADRATIC_TYPES
from ..mesh import CellBlock, MixedMesh, middle_nodes, with_middles
from .read_write import as_hex_mesh

__all__ = ["elevated"]


def elevated(mesh: Any, nodes: int = 20) -> MixedMesh:
    """The mesh of quadratic hexahedra that has the same shape.

    Nodes keep their numbers; those in the middle of edges, faces and cells come after them, each at the mean of its
    corners. Arrays on points have the mean there, integers and other values what all of the corners have, or else 0;
    arrays on cells stay. Sets, and cells of lower dimension, do not come along.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.
    nodes
        Of a cell: 20 or 27.

    Raises
    ------
    MeshError
        If there are cells of other types than linear hexahedra.
    OptionError
        If `nodes` is neither.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> elevated(box((2, 1, 1)), 20), elevated(box((2, 1, 1)), 27)
    (MixedMesh(32 points, 2 hexahedra of 20 nodes), MixedMesh(45 points, 2 hexahedra of 27 nodes))
    """
    linear = as_hex_mesh(mesh)
    cells, corners = middle_nodes(linear.cells, len(linear.points), nodes)
    block = CellBlock(QUADRATIC_TYPES[f"hexahedron{nodes}"], cells, np.arange(len(cells)))
    point_data = {name: with_middles(array, corners) for name, array in linear.point_data.items()}
    return MixedMesh(with_middles(linear.points, corners), (block,), point_data, linear.cell_data)
