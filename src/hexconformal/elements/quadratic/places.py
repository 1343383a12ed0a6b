"""Where quadratic cells are looked at: places in the unit cube, and the corner as the edges of which each is measured.

At a corner a linear cell is measured by the edges there, and by axes that turn with them. At any other place the same
edges are taken along, by the derivative there: those of the nearest corner.
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from ..collapsed import COLLAPSED
from ..hexahedron import HEXAHEDRON, shape_gradients, trilinear_shapes
from ..pyramid import PYRAMID
from ..tetrahedron import TETRAHEDRON
from ..wedge import WEDGE
from .shape_functions import quadratic_shape_gradients

__all__ = ["edge_derivatives", "in_cube", "inverse_shares", "nearest_corners", "quadratic_rule"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_SIMPSON = ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6))  # nodes and weights
# Of a pyramid from base to apex: exact for linear functions, as its cross sections count, and positive.
_UPWARD = ((0.0, 19 / 36), (0.5, 16 / 36), (1.0, 1 / 36))
# Of a triangle, exact for cubics: places on the bisector of corner 0, its middle a third time on those of the others.
_BISECTOR = (((0.0, 0.0), 1 / 20), ((0.5, 0.5), 2 / 15), ((1 / 3, 1 / 3), 3 / 20))
# Of a tetrahedron, exact for cubics: corners, middles of edges, and its own middle.
_CORNER, _MIDDLE, _CENTRE = 1 / 60, 1 / 15, 8 / 15


def in_cube(reference: Field, cell_type: CellType) -> Field:
    """(q, 3) coordinates in the unit cube of places given by reference coordinates; 0 where any would do.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON10
    >>> in_cube(np.array([[0.25, 0.25, 0.5], [0.0, 0.0, 1.0]]), TETRAHEDRON10).tolist()
    [[1.0, 0.5, 0.5], [0.0, 0.0, 1.0]]
    """
    corners = cell_type.reference_corners[list(COLLAPSED[cell_type.linear.name])]
    out = np.zeros_like(reference, dtype=np.float64)
    # The last coordinate is the same everywhere; edges along the others are the shorter the more the cell narrows.
    for axis in (2, 1, 0):
        where = [np.eye(3)[axis] * end + np.where(np.arange(3) > axis, out, 0.0) for end in (0.0, 1.0)]
        low, high = (trilinear_shapes(place) @ corners[:, axis] for place in where)
        wide = np.abs(high - low) > 1e-9
        out[wide, axis] = ((reference[:, axis] - low)[wide]) / (high - low)[wide]
    return out


@cache
def inverse_shares(cell_type: CellType) -> Field:
    """(216,) one over what each Bernstein polynomial of degree five gives to the volume of a cell.

    Examples
    --------
    >>> bool((inverse_shares(HEXAHEDRON) == 216.0).all()), round(float((1.0 / inverse_shares(TETRAHEDRON)).sum()), 6)
    (True, 0.166667)
    """
    corners = cell_type.reference_corners[list(COLLAPSED[cell_type.linear.name])]
    # The cube becomes the cell with a determinant that is a product of powers of (1 - t).
    frames = shape_gradients(0.5 * np.eye(3)).transpose(0, 2, 1) @ corners
    powers = np.rint(-np.log2(np.linalg.det(frames))).astype(int).tolist()
    rows = [[factorial(6 + m) / (comb(5, k) * factorial(k) * factorial(5 - k + m)) for k in range(6)] for m in powers]
    return np.asarray(np.kron(rows[2], np.kron(rows[1], rows[0])))


def edge_derivatives(cell_type: CellType, places: Field, corners: Ints) -> Field:
    """(3, k, q) derivatives of the shape functions at places (q, 3), along the edges at a corner (q,) of each.

    Examples
    --------
    >>> from hexconformal.elements import WEDGE15
    >>> along = edge_derivatives(WEDGE15, np.zeros((1, 3)), np.array([1]))
    >>> bool(np.allclose(along[0, :, 0] @ WEDGE15.ideal, WEDGE15.ideal[2] - WEDGE15.ideal[1]))
    True
    """
    ends = cell_type.reference_corners[cell_type.neighbours]
    edges = ends - cell_type.reference_corners[: len(ends), None]
    along = quadratic_shape_gradients(places, cell_type) @ edges[corners].transpose(0, 2, 1)
    return np.ascontiguousarray(along.transpose(2, 1, 0))


def nearest_corners(cell_type: CellType, places: Field) -> tuple[Ints, Ints]:
    """Pairs of places (q, 3) and corners: the nearest one, or several, but one of those with parallel edges.

    Returns
    -------
    (p,) numbers of the places, and (p,) corners.

    Examples
    --------
    >>> places, corners = nearest_corners(WEDGE, np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 1.0]]))
    >>> places.tolist(), corners.tolist()
    ([0, 1, 1], [0, 0, 1])
    """
    pattern, count = COLLAPSED[cell_type.linear.name], len(cell_type.neighbours)
    near = np.zeros((len(places), count))
    for corner, share in zip(range(8), trilinear_shapes(places).T, strict=True):
        # At an apex the corner of the base below it counts.
        near[:, pattern[corner] if pattern[corner] < count else pattern[corner - 4]] += share
    nearest = near > near.max(axis=1, keepdims=True) - 1e-9
    kinds = _kinds(cell_type)
    by_kind = np.stack([nearest[:, kinds == kind].any(axis=1) for kind in np.unique(kinds)], axis=1)
    which, kind = np.nonzero(by_kind)
    return which, np.unique(kinds)[kind]


def _kinds(cell_type: CellType) -> Ints:
    """(c,) of each corner the first one that has the same edges in whatever order, forwards or backwards."""
    ends = cell_type.reference_corners[cell_type.neighbours]
    edges = (ends - cell_type.reference_corners[: len(ends), None]).tolist()
    keys = [sorted(max(edge, [-x + 0.0 for x in edge]) for edge in own) for own in edges]
    return np.array([keys.index(key) for key in keys])


@cache
def quadratic_rule(cell_type: CellType) -> tuple[Field, Ints, Field]:
    """A quadrature that is symmetric as the ideal is, with the nodes of a full type among its points.

    Returns
    -------
    (q, 3) places in the unit cube, the corner (q,) as the edges of which each is measured, and (q,) weights, positive,
    which sum to one.

    Examples
    --------
    >>> [len(quadratic_rule(one)[2]) for one in (HEXAHEDRON, WEDGE, PYRAMID, TETRAHEDRON)]
    [27, 27, 27, 11]
    """
    return {HEXAHEDRON: _boxed, PYRAMID: _boxed, WEDGE: _of_wedge, TETRAHEDRON: _of_tetrahedron}[cell_type.linear](
        cell_type.linear
    )


def _boxed(linear: CellType) -> tuple[Field, Ints, Field]:
    upward = _UPWARD if linear is PYRAMID else _SIMPSON
    triples = [(a, b, c) for a in _SIMPSON for b in _SIMPSON for c in upward]
    places = np.array([[place for place, _ in one] for one in triples])
    weights = np.array([np.prod([weight for _, weight in one]) for one in triples])
    return places, np.zeros(len(places), dtype=np.int64), weights


def _of_wedge(linear: CellType) -> tuple[Field, Ints, Field]:
    places, corners, weights = [], [], []
    triangle = linear.reference_corners[:3, :2]
    for corner in range(3):
        around = np.roll(triangle, -corner, axis=0)
        for (second, third), share in _BISECTOR:
            shares = np.array([1.0 - second - third, second, third])
            for height, weight in _SIMPSON:
                places.append([*(shares @ around), height])
                corners.append(corner)
                weights.append(share * weight)
    return in_cube(np.array(places), linear), np.array(corners), np.array(weights)


def _of_tetrahedron(linear: CellType) -> tuple[Field, Ints, Field]:
    corners = linear.reference_corners
    middles = corners[linear.edges].mean(axis=1)
    places = in_cube(np.concatenate([corners, middles, [corners.mean(axis=0)]]), linear)
    weights = np.repeat([_CORNER, _MIDDLE, _CENTRE], [4, 6, 1])
    # All corners have the same derivatives along the axes of the ideal.
    return places, np.concatenate([np.arange(4), linear.edges[:, 0], [0]]), weights
