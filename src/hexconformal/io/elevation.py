"""Linear hexahedra as quadratic ones, straight, whose nodes between corners are shared."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import BETWEEN, QUADRATIC_TYPES
from ..mesh import CellBlock, MixedMesh
from .read_write import as_hex_mesh

__all__ = ["elevated"]

Ints = NDArray[np.int64]


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
    if nodes not in (20, 27):
        raise OptionError(f"nodes of a quadratic hexahedron must be 20 or 27, not {nodes!r}")
    linear = as_hex_mesh(mesh)
    cells, corners, count = linear.cells, [], len(linear.points)
    # Edges, faces and the cell: what has the same corners has the same node.
    for members in (BETWEEN[:12], BETWEEN[12:18], BETWEEN[18:]) if nodes == 27 else (BETWEEN[:12],):
        ends = linear.cells[:, np.array(members)]
        distinct, inverse = np.unique(np.sort(ends, axis=2).reshape(-1, ends.shape[2]), axis=0, return_inverse=True)
        cells = np.concatenate([cells, count + inverse.reshape(len(cells), -1)], axis=1)
        corners.append(distinct)
        count += len(distinct)
    block = CellBlock(QUADRATIC_TYPES[f"hexahedron{nodes}"], cells, np.arange(len(cells)))
    point_data = {name: _with_middles(array, corners) for name, array in linear.point_data.items()}
    return MixedMesh(_with_middles(linear.points, corners), (block,), point_data, linear.cell_data)


def _with_middles(values: NDArray[Any], corners: list[Ints]) -> NDArray[Any]:
    """Values on the nodes and those between."""
    parts = [values]
    for members in corners:
        own = values[members]
        if values.dtype.kind in "fc":
            parts.append(own.mean(axis=1, dtype=values.dtype))
        else:
            parts.append(np.where((own == own[:, :1]).all(axis=1), own[:, 0], np.zeros((), dtype=values.dtype)))
    return np.concatenate(parts)
