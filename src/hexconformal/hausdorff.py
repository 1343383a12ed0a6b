"""How far apart two positions of a boundary are, everywhere and in both directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .closest import Surface

__all__ = ["hausdorff", "surface_samples"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def surface_samples(quads: Ints) -> tuple[Ints, Floats]:
    """Where a surface of quads is sampled: nodes, edge midpoints, centres, and half-way from centre to corner.

    Parameters
    ----------
    quads
        (q, 4) nodes in cyclic order.

    Returns
    -------
    (s,) the quad of each sample, (s, 4) weights of its nodes. Every node and every edge comes once; the nodes
    come first, in ascending order.

    Examples
    --------
    >>> of, weights = surface_samples(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> len(of), weights[6].tolist()  # 6 nodes, 7 edges, 2 centres, 8 quarter points
    (23, [0.5, 0.5, 0.0, 0.0])
    """
    count, corner = len(quads), np.eye(4)
    nodes = np.unique(quads, return_index=True)[1]
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    edges = np.unique(ends[:, 0] * (int(quads.max(initial=0)) + 1) + ends[:, 1], return_index=True)[1]
    middle = (corner + np.roll(corner, 1, axis=1)) / 2
    every = np.arange(count)
    of = np.concatenate([nodes // 4, edges // 4, every, np.repeat(every, 4)])
    quarters = np.tile((corner + 0.25) / 2, (count, 1))
    return of, np.concatenate([corner[nodes % 4], middle[edges % 4], np.full((count, 4), 0.25), quarters])


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
    >>> from hexconformal.topology import boundary_quads
    >>> points, cells = box((3, 3, 3))
    >>> round(hausdorff(1.1 * points, points, boundary_quads(cells)[0]), 12) == round(0.1 * 3**0.5, 12)
    True
    """
    of, weights = surface_samples(quads)
    surfaces = Surface(points, quads), Surface(reference, quads)
    worst = 0.0
    for one, other in (surfaces, surfaces[::-1]):
        places = np.einsum("sj,sji->si", weights, one.points[quads[of]])
        # Its own quad on the other surface is the best first guess, the whole surface is searched.
        worst = max(worst, float(other.closest(places, of).distances.max(initial=0.0)))
    return worst
