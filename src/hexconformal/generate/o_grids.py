"""Round bodies as O-grids: a central block, and blocks around it."""

from __future__ import annotations

import numpy as np

from ..common import OptionError
from ..mesh import boundary_quads
from .bricks import Floats, Hexes, Ints, box

__all__ = ["ball", "cylinder"]


def cylinder(
    core: int = 6,
    layers: int = 5,
    axial: int = 12,
    radius: float = 1.0,
    length: float = 2.0,
    core_size: float = 0.5,
    grading: float = 1.0,
) -> Hexes:
    """A round cylinder along z as an O-grid: a central block and four blocks around it.

    Parameters
    ----------
    core, layers, axial
        Cells along an edge of the central block, through the outer blocks, and along the axis.
    radius, length
        Size; the axis runs from z = 0 to ``length``.
    core_size
        Distance of the central block's corners from the axis, relative to the radius.
    grading
        Thickness of the outermost layer over that of the innermost: < 1 makes a boundary layer.

    Raises
    ------
    OptionError
        If there is no layer, or `core_size` or `grading` makes no sense.

    Examples
    --------
    >>> from hexconformal.elements import is_valid
    >>> points, cells = cylinder(4, 3, 5)
    >>> len(cells), bool(is_valid(points, cells).all())
    (320, True)
    """
    square, cells = box((core, core, axial), (2.0, 2.0, length), (-1.0, -1.0, 0.0))
    inner, outer = square.copy(), square.copy()
    outer[:, :2] = radius * _round(square[:, :2])
    inner[:, :2] = _core(square[:, :2], radius, core_size)
    quads = boundary_quads(cells)[0]
    side = ~np.isin(square[quads, 2], [0.0]).all(axis=1) & ~(square[quads, 2] == length).all(axis=1)
    return _wrap(inner, cells, quads[side], outer, _layers(layers, grading))


def ball(core: int = 6, layers: int = 5, radius: float = 1.0, core_size: float = 0.5, grading: float = 1.0) -> Hexes:
    """A ball as an O-grid: a central block and six blocks around it.

    Parameters
    ----------
    core, layers
        Cells along an edge of the central block, and through the outer blocks.
    radius
        Radius; the centre is the origin.
    core_size
        Distance of the central block's corners from the centre, relative to the radius.
    grading
        Thickness of the outermost layer over that of the innermost: < 1 makes a boundary layer.

    Raises
    ------
    OptionError
        If there is no layer, or `core_size` or `grading` makes no sense.

    Examples
    --------
    >>> from hexconformal.elements import is_valid
    >>> points, cells = ball(4, 3)
    >>> len(cells), bool(is_valid(points, cells).all())
    (352, True)
    """
    cube, cells = box((core, core, core), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))
    quads = boundary_quads(cells)[0]
    return _wrap(_core(cube, radius, core_size), cells, quads, radius * _round(cube), _layers(layers, grading))


def _round(square: Floats) -> Floats:
    """Carry concentric squares (cubes) onto circles (spheres), with equal angles along their sides."""
    size = np.abs(square).max(axis=1, keepdims=True)
    tangents = np.tan(np.pi / 4 * square / np.where(size > 0, size, 1.0))
    length = np.linalg.norm(tangents, axis=1, keepdims=True)
    rounded: Floats = tangents * size / np.where(length > 0, length, 1.0)
    return rounded


def _core(square: Floats, radius: float, size: float) -> Floats:
    """The central block of an O-grid: half way between a square (cube) and a disc (ball)."""
    if not 0 < size < 1:
        raise OptionError(f"core_size must lie in (0, 1), not {size}")
    block: Floats = radius * size * (square / np.sqrt(square.shape[1]) + _round(square)) / 2
    return block


def _layers(count: int, grading: float) -> Floats:
    """Heights in (0, 1] of the tops of layers whose thickness changes geometrically."""
    if count < 1 or not grading > 0:
        raise OptionError(f"layers must be 1 or more and grading positive, not {count} and {grading}")
    heights = np.cumsum(grading ** (np.arange(count) / max(count - 1, 1)))
    return np.asarray(heights / heights[-1])


def _wrap(inner: Floats, cells: Ints, quads: Ints, outer: Floats, heights: Floats) -> Hexes:
    """Put layers of hexes onto outward quads; the topmost reaches the nodes' places in ``outer``."""
    surface, base = np.unique(quads, return_inverse=True)
    base = base.reshape(quads.shape)
    climb = outer[surface] - inner[surface]
    new = inner[surface] + heights[:, None, None] * climb
    ids = np.vstack([surface, len(inner) + np.arange(len(heights) * len(surface)).reshape(len(heights), -1)])
    hexes = [np.hstack([ids[k][base], ids[k + 1][base]]) for k in range(len(heights))]
    return np.vstack([inner, new.reshape(-1, 3)]), np.vstack([cells, *hexes])
