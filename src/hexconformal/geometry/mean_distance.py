"""Mean distance between surfaces."""

from __future__ import annotations

import numpy as np

from .area_vectors import face_area_vectors
from .closest_point import SurfaceLocator

__all__ = ["mean_distance"]


def mean_distance(one: SurfaceLocator, other: SurfaceLocator, near: bool = False) -> float:
    """Mean distance between two surfaces of triangles and bilinear quadrilaterals, of both directions.

    Parameters
    ----------
    one, other
        The two.
    near
        True where they are two positions of one surface, to save time.

    Returns
    -------
    The mean over the areas of both, in units of length; looked at are the centre of every face and places half-way from
    there to its corners.

    Examples
    --------
    >>> square, quads = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2, 3]])
    >>> tilted = square + [[0, 0, 0], [0, 0, 0.1], [0, 0, 0.1], [0, 0, 0]]
    >>> round(mean_distance(SurfaceLocator(square, quads), SurfaceLocator(tilted, quads)), 3)
    0.05
    """
    total = area = 0.0
    for this, that in ((one, other), (other, one)):
        size = this.faces.shape[1]
        weights = np.vstack([np.full(size, 1.0 / size), (np.eye(size) + 1.0 / size) / 2])
        places = np.einsum("sj,fji->fsi", weights, this.points[this.faces])
        start = np.repeat(np.arange(len(this.faces)), len(weights)) if near else None
        there = that.closest(places.reshape(-1, 3), start).distances.reshape(len(places), -1)
        areas = np.linalg.norm(face_area_vectors(this.points, this.faces), axis=1)
        total += float(areas @ there.mean(axis=1))
        area += float(areas.sum())
    return total / area if area else 0.0
