"""Hausdorff distance between two positions of a boundary, at samples and in both directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import face_edges, unique_edges
from .closest_point import SurfaceLocator

__all__ = ["distance_between", "hausdorff", "surface_samples"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def surface_samples(faces: Ints) -> tuple[Ints, Floats]:
    """Samples of a surface: nodes, edge midpoints, centres, and half-way from centre to corner.

    Parameters
    ----------
    faces
        (q, k) nodes in cyclic order, k of them each.

    Returns
    -------
    (s,) the face of each sample, (s, k) weights of its nodes. Every node and every edge comes once; the nodes
    come first, in ascending order.

    Examples
    --------
    >>> of, weights = surface_samples(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> len(of), weights[6].tolist()  # 6 nodes, 7 edges, 2 centres, 8 quarter points
    (23, [0.5, 0.5, 0.0, 0.0])
    """
    count, size = faces.shape
    corner = np.eye(size)
    nodes = np.unique(faces, return_index=True)[1]
    edges = unique_edges(face_edges(faces)).first
    middle = (corner + np.roll(corner, 1, axis=1)) / 2
    centre = np.full((count, size), 1.0 / size)
    every = np.arange(count)
    of = np.concatenate([nodes // size, edges // size, every, np.repeat(every, size)])
    quarters = np.tile((corner + 1.0 / size) / 2, (count, 1))
    return of, np.concatenate([corner[nodes % size], middle[edges % size], centre, quarters])


def hausdorff(points: Floats, reference: Floats, quads: Ints) -> float:
    """Largest distance between two positions of a surface of quads, taken in both directions.

    Each quad is four triangles around its centre. The distance from one surface to the other is taken at the
    :func:`surface_samples`.

    Parameters
    ----------
    points, reference
        (n, 3) coordinates of the two.
    quads
        (q, 4) nodes in cyclic order.

    Returns
    -------
    The distance in units of length.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((3, 3, 3))
    >>> round(hausdorff(1.1 * points, points, boundary_quads(cells)[0]), 12) == round(0.1 * 3**0.5, 12)
    True
    """
    of, _ = surface_samples(quads)
    # Its own quad on the other surface is the best first guess, the whole surface is searched.
    return distance_between(SurfaceLocator(points, quads), SurfaceLocator(reference, quads), (of, of))


def distance_between(
    one: SurfaceLocator, other: SurfaceLocator, near: tuple[Ints | None, Ints | None] = (None, None)
) -> float:
    """Largest distance between two surfaces, taken in both directions at their :func:`surface_samples`.

    Parameters
    ----------
    one, other
        The two.
    near
        For the samples of each the faces of the other that are probably close, to save time.

    Returns
    -------
    The distance in units of length.
    """
    worst = 0.0
    for (this, that), guess in zip(((one, other), (other, one)), near, strict=True):
        of, weights = surface_samples(this.faces)
        places = np.einsum("sj,sji->si", weights, this.points[this.faces[of]])
        worst = max(worst, float(that.closest(places, guess).distances.max(initial=0.0)))
    return worst
