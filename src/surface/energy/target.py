"""Targets: what the cells of a surface should be conformal to, the reference domain of the energies.

Every cell has a perfect shape in the plane. Of a triangle two edge vectors suffice, of a quadrilateral its four
corners; what the energies need is the inverse of the reference frame, so that f_i = sum_a x_a B_ai.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import OptionError, array_of_numbers, first_ids
from hexconformal.geometry import Faces, corner_angles, edge_table

from ..mesh import Floats, Ints

__all__ = ["TARGETS", "flat_angles", "target_shapes", "triangle_from_angles"]

TARGETS = ("flat", "equilateral", "input")

_AREA = np.sqrt(3.0) / 4.0
_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def target_shapes(target: Any, points: Floats, cells: Faces) -> tuple[Floats, Floats]:
    """Perfect shapes of all cells.

    Parameters
    ----------
    target
        "flat": as flat as the valences allow, see :func:`flat_angles`; "equilateral"; "input": the cells' own
        shapes; an (n, 3) array of points of a target mesh with the same cells (its conformal class is kept), or
        a pair of arrays (t, 3, 2) and (q, 4, 2) of planar corners. Quadrilaterals are unit squares in the first two.
    points
        (n, 3) points of the mesh itself.
    cells
        Its cells.

    Returns
    -------
    (t, 3, 2) and (q, 4, 2) corners in the plane.

    Raises
    ------
    OptionError
        If `target` is none of those, or a shape has no area or is turned over.
    """
    squares = np.broadcast_to(_SQUARE, (len(cells.quads), 4, 2))
    if isinstance(target, str):
        if target not in TARGETS:
            names = ", ".join(repr(name) for name in TARGETS)
            raise OptionError(f"target must be {names} or an array, not {target!r}")
        if target == "equilateral":
            angles = np.full(cells.triangles.shape, np.pi / 3)
            return triangle_from_angles(angles), squares
        if target == "flat":
            return triangle_from_angles(flat_angles(cells, len(points))), squares
        target = points
    if isinstance(target, tuple) and len(target) == 2:
        triangles, quads = (array_of_numbers("target", part) for part in target)
        if triangles.shape != (len(cells.triangles), 3, 2) or quads.shape != (len(cells.quads), 4, 2):
            raise OptionError(
                f"target shapes must be ({len(cells.triangles)}, 3, 2) and ({len(cells.quads)}, 4, 2), "
                f"not {triangles.shape} and {quads.shape}"
            )
    else:
        given = array_of_numbers("target", getattr(target, "points", target))
        if given.shape != points.shape:
            raise OptionError(f"a target mesh must have points {points.shape}, not {given.shape}")
        triangles = triangle_from_angles(corner_angles(given, cells.triangles))
        quads = _unfolded(given, cells.quads)
    _require_area(triangles, "triangles")
    _require_area(quads, "quadrilaterals")
    return triangles, quads


def flat_angles(cells: Faces, count: int) -> Floats:
    """Angles of triangles that are as flat as the valences of their nodes allow (Gruber & Aulisa 2020).

    A corner wants 2 pi / valence, on the boundary pi / (number of its cells). Where one of the three is strictly
    largest (and at most 135 degrees) it is kept and the others are scaled to fill pi; else all three are scaled. Every
    angle is positive, whatever the valence. Equation (21) of docs/mathematics.md.

    Parameters
    ----------
    cells
        Cells; quadrilaterals count for the valence.
    count
        Number of nodes.

    Returns
    -------
    (t, 3) angles, each row with the sum pi.

    Examples
    --------
    >>> fan = Faces(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]]), np.empty((0, 4), np.int64))
    >>> np.degrees(flat_angles(fan, 4)[0]).round(6)  # valence 3 inside; 90 degrees at each boundary node
    array([120.,  30.,  30.])
    """
    fan = np.bincount(cells.corners, minlength=count)
    whole = np.where(_on_boundary(cells, count), np.pi, 2 * np.pi)
    wish = (whole / np.maximum(fan, 1))[cells.triangles]
    result = wish * (np.pi / wish.sum(axis=1, keepdims=True))
    order = np.sort(wish, axis=1)
    keep = (order[:, 2] > order[:, 1] * (1 + 1e-12)) & (order[:, 2] <= 0.75 * np.pi)
    largest = wish == order[:, 2:]
    others = np.where(largest, 0.0, wish)
    filled = others * ((np.pi - order[:, 2:]) / np.where(keep, others.sum(axis=1), 1.0)[:, None])
    return np.where(keep[:, None], np.where(largest, wish, filled), result)


def triangle_from_angles(angles: Floats) -> Floats:
    """(t, 3, 2) triangles in the plane with given angles (t, 3) and the area of a unit equilateral one."""
    s = np.sin(angles)
    # Law of sines: the side opposite to a corner goes with the sine of its angle.
    scale = np.sqrt(2 * _AREA / (s[:, 0] * s[:, 1] * s[:, 2]))
    result = np.zeros((len(angles), 3, 2))
    result[:, 1, 0] = scale * s[:, 2]
    result[:, 2, 0] = scale * s[:, 1] * np.cos(angles[:, 0])
    result[:, 2, 1] = scale * s[:, 1] * s[:, 0]
    return result


def _unfolded(points: Floats, quads: Ints) -> Floats:
    """Quadrilaterals laid into the plane of their area vector, with unit area."""
    x = points[quads] - points[quads].mean(axis=1, keepdims=True)
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    size = np.linalg.norm(normal, axis=1)
    normal = normal / np.where(size > 0, size, 1.0)[:, None]
    first = x[:, 1] - x[:, 0] + (x[:, 2] - x[:, 3])
    first -= (first * normal).sum(axis=1, keepdims=True) * normal
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    second = np.cross(normal, first)
    flat = np.stack([(x * first[:, None]).sum(axis=2), (x * second[:, None]).sum(axis=2)], axis=2)
    return np.asarray(flat / np.sqrt(np.maximum(size / 2, 1e-300))[:, None, None])


def _on_boundary(cells: Faces, count: int) -> NDArray[np.bool_]:
    """(n,) nodes on an edge that belongs to one cell only."""
    edges = edge_table(cells)
    mask = np.zeros(count, dtype=bool)
    mask[edges.nodes[edges.counts == 1]] = True
    return mask


def _require_area(shapes: Floats, name: str) -> None:
    if not len(shapes):
        return
    a, b = np.roll(shapes, -1, axis=1) - shapes, np.roll(shapes, 1, axis=1) - shapes
    corner = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    size = (a**2).sum(axis=2) + (b**2).sum(axis=2)
    bad = np.flatnonzero(~(corner > 1e-9 * size).all(axis=1))
    if len(bad):
        raise OptionError(f"target {name} must have an area and be convex, these are not: {first_ids(bad)}")
