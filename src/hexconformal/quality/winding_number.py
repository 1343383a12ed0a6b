"""Winding number of a mesh's surface around a point: how often a mesh with that surface must cover it.

A valid mesh covers every point as often as its surface winds around it, since each cell that covers it counts +1.
Where the surface winds around a point a negative number of times, it is turned inside out, and no valid mesh has
this surface, whatever the nodes inside do. Equation (13a) of docs/mathematics.md.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["inside_out", "winding_number"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_PLACES = 0.01, 0.5, 0.99  # in a quad, along each side, where its outside is looked at: also next to its nodes
_OFFSET = 1e-4  # distance from the quad, in its shortest edges; less than a narrow fold is deep next to a node
_HALVINGS = 40
_PAIRS = 500_000  # of quads looked at with quads of the surface; a few seconds


def winding_number(point: Field, quads: Field) -> float:
    """Number of times that a closed surface of bilinear quads winds around a point that is not on it.

    Parameters
    ----------
    point
        (3,)
    quads
        (k, 4, 3) corners, in the order in which they are seen from outside.

    Returns
    -------
    float
        An integer but for rounding: 1 inside a surface without overlaps, 0 outside.

    Notes
    -----
    A bilinear quad lies in the hull of its corners. Seen from a point outside that hull it covers the same solid angle
    as either pair of triangles with the same corners; where the two pairs differ, the quad is cut into four.
    """
    total = 0.0
    for _ in range(_HALVINGS):
        one, other = _solid_angles(*(np.moveaxis(quads, 1, 0) - point).transpose(0, 2, 1))
        agree = np.abs(one - other) < 1.0
        total += float(one[agree].sum())
        if agree.all():
            break
        quads = _quarters(quads[~agree])
    return total / (4.0 * np.pi)


def inside_out(points: Field, quads: Ints, among: Ints) -> Ints:
    """Quads whose outside is turned inside out: the closed surface winds around points there less than zero times.

    Parameters
    ----------
    points
        (n, 3)
    quads
        (k, 4) nodes of all boundary quads, seen from outside.
    among
        Those to look at.

    Returns
    -------
    ndarray
        Quads next to which the surface is inside out, so that no valid mesh has it; others may be missed, none is
        reported wrongly.

    Examples
    --------
    >>> import numpy as np
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> cell = np.arange(8)[None]
    >>> cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
    >>> quads = boundary_quads(cell)[0]
    >>> inside_out(cube, quads, np.arange(6))
    array([], dtype=int64)
    >>> inside_out(cube * [1, 1, -1], quads, np.arange(6))
    array([0, 1, 2, 3, 4, 5])
    """
    corners = points[quads]
    among = among[: 1 + _PAIRS // len(quads)]
    found = [quad for quad in among if any(winding_number(p, corners) < -0.5 for p in _outside(corners[quad]))]
    return np.array(found, dtype=np.int64)


def _outside(quad: Field) -> Field:
    """(j, 3) points a little outside a bilinear quad."""
    u, v = (grid.ravel()[:, None] for grid in np.meshgrid(_PLACES, _PLACES))
    a, b, c, d = quad
    along, across = (1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b)
    normal = np.cross(along, across)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    here = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    shortest = np.linalg.norm(quad - np.roll(quad, 1, axis=0), axis=1).min()
    sound = length[:, 0] > 0.0
    return np.asarray(here[sound] + _OFFSET * shortest * normal[sound] / length[sound])


def _solid_angles(a: Field, b: Field, c: Field, d: Field) -> tuple[Field, Field]:
    """(k,) signed solid angles of quads cut along a c, and along b d; corners (3, k) as seen from the origin.

    Of a triangle by Van Oosterom and Strackee (1983).
    """
    corners = a, b, c, d
    lengths = [np.sqrt(_dot(x, x)) for x in corners]
    dots = {(i, j): _dot(corners[i], corners[j]) for i, j in combinations(range(4), 2)}
    ab, cd = _cross(a, b), _cross(c, d)
    volumes = {(0, 1, 2): _dot(ab, c), (0, 2, 3): _dot(a, cd), (0, 1, 3): _dot(ab, d), (1, 2, 3): _dot(b, cd)}

    def angle(i: int, j: int, k: int) -> Field:
        below = lengths[i] * (lengths[j] * lengths[k] + dots[j, k])
        return np.asarray(2.0 * np.arctan2(volumes[i, j, k], below + dots[i, j] * lengths[k] + dots[i, k] * lengths[j]))

    return angle(0, 1, 2) + angle(0, 2, 3), angle(0, 1, 3) + angle(1, 2, 3)


def _dot(a: Field, b: Field) -> Field:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _cross(a: Field, b: Field) -> Field:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _quarters(quads: Field) -> Field:
    """(4 k, 4, 3) the four parts of bilinear quads; bilinear themselves."""
    middle, side = quads.mean(axis=1), 0.5 * (quads + np.roll(quads, -1, axis=1))
    parts = [np.stack([quads[:, k], side[:, k], middle, side[:, k - 1]], axis=1) for k in range(4)]
    return np.concatenate(parts)
