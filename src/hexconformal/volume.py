"""Keep the volume that a boundary encloses, for the boundary as a whole.

The note's constraint makes the displacement v of a surface orthogonal to a normal N~, weakly. With the Simpson mean
of the area vectors before, half-way and after, <v, N~> summed over the surface is the change of volume itself, which
a bilinear surface encloses as a cubic of its nodes. So one multiplier, a pressure on the boundary, is enough: the
change that costs least energy per volume is H^-1 N, with H the Hessian of the energy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .shaping import SIZE, Emphasis, Shaping
from .validity import is_valid

__all__ = ["area_normals", "enclosed_volume", "restored", "simpson_normals"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_EXACT = 1e-14  # relative difference of volumes that counts as none
_STEPS, _HALVINGS = 40, 10
_STIFF = 0.95  # stiffness times the worst density: no cell gets worse than that one is
_SOLVE, _SOLVE_ITERATIONS, _SHIFT = 1e-2, 50, 1e-5


def enclosed_volume(points: Field, quads: Ints) -> float:
    """Volume inside a closed surface of bilinear quads, exactly; also where the cells inside are tangled.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) boundary quads, counter-clockwise seen from outside.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.topology import boundary_quads
    >>> points, cells = box((2, 2, 2), (1.0, 2.0, 3.0))
    >>> round(enclosed_volume(points, boundary_quads(cells)[0]), 14)
    6.0
    """
    total, one, other = _diagonals(points, quads)
    return float(np.einsum("ki,ki->", total, np.cross(one, other))) / 24.0


def area_normals(points: Field, quads: Ints) -> Field:
    """(n, 3) normals of the nodes, as long as their share of the area: the gradient of the enclosed volume.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.topology import boundary_quads
    >>> points, cells = box((1, 1, 1))
    >>> area_normals(points, boundary_quads(cells)[0])[7]  # the corner (1, 1, 1)
    array([0.25, 0.25, 0.25])
    """
    total, one, other = _diagonals(points, quads)
    area, turned_one, turned_other = np.cross(one, other), np.cross(total, one), np.cross(other, total)
    normals = np.zeros_like(points)
    shares = (area - turned_other, area - turned_one, area + turned_other, area + turned_one)
    for corner, share in enumerate(shares):
        np.add.at(normals, quads[:, corner], share / 24.0)
    return normals


def simpson_normals(points: Field, moved: Field, quads: Ints) -> Field:
    """(n, 3) Simpson mean N of the area normals on a straight way: the volume changes by the sum of <N, v> exactly.

    Parameters
    ----------
    points, moved
        (n, 3) the ends of the way v = moved - points.
    quads
        (k, 4) boundary quads.
    """
    half = 0.5 * (points + moved)
    return (area_normals(points, quads) + 4.0 * area_normals(half, quads) + area_normals(moved, quads)) / 6.0


def restored(problem: Shaping, points: Field, quads: Ints, volume: float) -> Field:
    """Points that enclose the given volume, changed as the energy resists least; as near as can be otherwise.

    Every step is valid, admissible, and within the limits of the problem's surface.

    Parameters
    ----------
    problem
        What resists; none of its cells may be folded.
    points
        (n, 3) where to begin.
    quads
        (k, 4) boundary quads.
    volume
        What they should enclose.
    """
    valid = is_valid(points, problem.cells)
    for _ in range(_STEPS):
        gap = volume - enclosed_volume(points, quads)
        if abs(gap) <= _EXACT * abs(volume):
            return points
        worst = max(float(problem.measures(points).angle.max(initial=0.0)), 1e-3)
        emphasis = Emphasis(angle=1.0, stiffness=_STIFF / worst, size=SIZE)
        matrix = problem.value_gradient_hessian(points, emphasis)[2]
        normals = area_normals(points, quads)
        way, _ = matrix.solve(normals, problem.projectors, _SOLVE, _SOLVE_ITERATIONS, _SHIFT)
        if not np.einsum("ij,ij->", way, normals) > 0.0:
            return points
        for halving in range(_HALVINGS):
            trial = _swollen(points, way, quads, gap * 0.5**halving)
            if np.isfinite(problem.value(trial, emphasis)) and is_valid(trial, problem.cells)[valid].all():
                points = trial
                break
        else:
            return points
    return points


def _swollen(points: Field, way: Field, quads: Ints, gap: float) -> Field:
    """The points so far along the way that the volume grows by the gap: one equation, solved by iterating on N~."""
    length = 0.0
    for _ in range(30):
        moved = points + length * way
        longer = gap / float(np.einsum("ij,ij->", simpson_normals(points, moved, quads), way))
        if abs(longer - length) <= 1e-15 * abs(longer):
            break
        length = longer
    return points + length * way


def _diagonals(points: Field, quads: Ints) -> tuple[Field, Field, Field]:
    """Of every quad the sum of its nodes and its two diagonals; from one of the nodes, for the sake of digits."""
    a, b, c, d = np.moveaxis(points[quads] - points[quads[0, 0]], 1, 0)
    return a + b + c + d, c - a, d - b
