"""How far the skin of one frame is from that of another, node by node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import SurfaceLocator
from .contents import Frame

__all__ = ["skin_distance", "with_distances"]

Floats = NDArray[np.float64]


def skin_distance(points: Floats, other: Floats, faces: NDArray[np.int64]) -> Floats:
    """(n,) distance of the nodes of a surface from the same faces at other points; NaN at nodes that it does not have.

    Parameters
    ----------
    points, other
        (n, 3) of the one and of the other surface.
    faces
        (f, 3) or (f, 4) nodes; triangles may have their last node twice.

    Examples
    --------
    >>> square, faces = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]]), np.array([[0, 1, 2, 3]])
    >>> skin_distance(square + [0, 0, 0.25], square, faces)
    array([0.25, 0.25, 0.25, 0.25,  nan])
    """
    nodes, first = np.unique(faces, return_index=True)
    distance = np.full(len(points), np.nan)
    near = first // faces.shape[1]
    distance[nodes] = SurfaceLocator(other, faces).closest(points[nodes], near).distances
    return distance


def with_distances(ends: Sequence[Frame], faces: NDArray[np.int64]) -> list[Frame]:
    """The first and the last frame, each with the distance of its surface (f, 4) from that of the other one."""
    found = []
    for one, other in ((ends[0], ends[1]), (ends[1], ends[0])):
        distance = skin_distance(one.points, other.points, faces)
        found.append(replace(one, point_data={**one.point_data, "surface_distance": distance}))
    return found
