"""Grids of bricks: straight, sheared, twisted, bent, graded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import CORNERS, is_valid

__all__ = ["CellsByType", "Hexes", "bent_bar", "boundary_layer", "box", "sheared_block", "sheared_cube", "twisted_cube"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Hexes = tuple[Floats, Ints]
CellsByType = dict[str, Ints]  # by the name of their type


def box(
    shape: Sequence[int] = (10, 10, 10),
    lengths: Sequence[float] = (1.0, 1.0, 1.0),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> Hexes:
    """A regular grid of equal bricks; nodes and cells are numbered with x running fastest.

    Parameters
    ----------
    shape
        Number of cells along x, y, z.
    lengths, origin
        Size and lowest corner.

    Raises
    ------
    OptionError
        If there is no cell in some direction, or a length is not positive.

    Examples
    --------
    >>> points, cells = box((2, 1, 1))
    >>> points.shape, cells.tolist()
    ((12, 3), [[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
    """
    nx, ny, nz = shape
    if min(shape) < 1:
        raise OptionError(f"shape must have one cell or more in every direction, not {tuple(shape)}")
    if not min(lengths) > 0:
        raise OptionError(f"lengths must be positive, not {tuple(lengths)}")
    axes = [o + length * np.linspace(0.0, 1.0, n + 1) for n, length, o in zip(shape, lengths, origin, strict=True)]
    z, y, x = np.meshgrid(*reversed(axes), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    ids = np.arange(len(points), dtype=np.int64).reshape(nz + 1, ny + 1, nx + 1)
    cells = np.stack([ids[k : k + nz, j : j + ny, i : i + nx].ravel() for i, j, k in CORNERS], axis=1)
    return points, cells


def sheared_cube(n: int = 15, shear: float = 0.8) -> Hexes:
    """The unit cube with skewed grid lines inside and on its faces (Gruber & Aulisa, volumetric remeshing, Figure 3).

    Three shears follow one another, each along one axis and monotone in its coordinate; they fade out at
    the two faces across that axis. So the outer surface stays the exact cube, corners stay, edges of the
    cube are mapped to themselves, and the map can be inverted whatever its strength. Should a coarse grid
    not resolve it, the shear is reduced until every cell is valid.

    Parameters
    ----------
    n
        Cells along an edge.
    shear
        Strength in [0, 1).

    Raises
    ------
    OptionError
        If the strength is another.

    Examples
    --------
    >>> points, cells = sheared_cube(6)
    >>> bool(is_valid(points, cells).all()), float(points.min()), float(points.max())
    (True, 0.0, 1.0)
    """
    if not 0 <= shear < 1:
        raise OptionError(f"shear must lie in [0, 1), not {shear}")
    straight, cells = box((n, n, n))
    points = straight.copy()
    while True:
        for axis in range(3):
            x, y, z = (points[:, (axis + i) % 3] for i in range(3))
            x += shear / np.pi * np.sin(np.pi * x) * np.cos(2 * np.pi * y) * np.cos(np.pi * z)
        # The sine of pi is not quite zero.
        points[(straight == 0) | (straight == 1)] = straight[(straight == 0) | (straight == 1)]
        if is_valid(points, cells).all():
            return points, cells
        shear *= 0.9
        points[:] = straight


def sheared_block(n: int = 10, shear: float = 1.5) -> Hexes:
    """A unit cube pushed over sideways.

    Parameters
    ----------
    n
        Cells along an edge.
    shear
        Growth of x from the bottom of y to its top.

    Examples
    --------
    >>> points, _ = sheared_block(4, shear=1.5)
    >>> float(points[:, 0].max())
    2.5
    """
    points, cells = box((n, n, n))
    points[:, 0] += shear * points[:, 1]
    return points, cells


def twisted_cube(n: int = 10, degrees: float = 60.0) -> Hexes:
    """A unit cube whose top is turned against its bottom, about the z axis.

    Parameters
    ----------
    n
        Cells along an edge.
    degrees
        Angle between bottom and top. Beyond some angle, which depends on `n`, cells are inverted.

    Examples
    --------
    >>> points, cells = twisted_cube(4, degrees=90)
    >>> bool(is_valid(points, cells).all())
    True
    """
    points, cells = box((n, n, n), origin=(-0.5, -0.5, -0.5))
    angle = np.radians(degrees) * points[:, 2]
    x, y = points[:, 0].copy(), points[:, 1].copy()
    points[:, 0] = np.cos(angle) * x - np.sin(angle) * y
    points[:, 1] = np.sin(angle) * x + np.cos(angle) * y
    return points, cells


def bent_bar(shape: Sequence[int] = (24, 6, 6), degrees: float = 90.0, length: float = 4.0) -> Hexes:
    """A bar of unit cross-section, bent in the xy plane.

    Parameters
    ----------
    shape
        Number of cells along the bar, and across.
    degrees
        Angle between its two ends.
    length
        Length of its centre line.

    Raises
    ------
    OptionError
        If the bar would have to pass through the centre of its own arc.

    Examples
    --------
    >>> points, cells = bent_bar((8, 2, 2))
    >>> bool(is_valid(points, cells).all())
    True
    """
    points, cells = box(shape, (length, 1.0, 1.0), (0.0, -0.5, -0.5))
    angle = np.radians(degrees)
    if abs(angle) < 1e-12:
        return points, cells
    radius = length / angle
    if abs(radius) <= 0.5:
        raise OptionError(f"a bar of length {length} must be bent by less than {360 / np.pi * length:.4g} degrees")
    turned, distance = points[:, 0] / radius, radius - points[:, 1]
    points[:, 0] = distance * np.sin(turned)
    points[:, 1] = radius - distance * np.cos(turned)
    return points, cells


def boundary_layer(shape: Sequence[int] = (8, 8, 16), aspect: float = 100.0) -> Hexes:
    """The unit cube with thin cells at z = 0 that grow geometrically upwards.

    Parameters
    ----------
    shape
        Number of cells along x, y, z.
    aspect
        Width (along x) of the cells at the bottom over their height.

    Raises
    ------
    OptionError
        If the aspect is not positive.

    Examples
    --------
    >>> points, _ = boundary_layer((4, 4, 10), aspect=50)
    >>> bool(np.isclose(np.unique(points[:, 2])[1], 0.25 / 50))
    True
    """
    nx, _, nz = shape
    points, cells = box(shape)
    if not aspect > 0:
        raise OptionError(f"aspect must be positive, not {aspect}")
    if nz == 1:
        return points, cells
    powers = np.arange(nz)
    low, high = 1e-6, 1e6  # growth rate of the heights, by bisection of its logarithm
    for _ in range(200):
        growth = np.sqrt(low * high)
        if (growth**powers).sum() > nx * aspect:
            high = growth
        else:
            low = growth
    heights = np.r_[0.0, np.cumsum(growth**powers)]
    points[:, 2] = (heights / heights[-1])[np.arange(len(points)) // ((nx + 1) * (shape[1] + 1))]
    return points, cells
