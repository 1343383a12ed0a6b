"""Round bodies as O-grids: a central block, and blocks around it; of linear and of quadratic hexahedra."""

from __future__ import annotations

import numpy as np

from ..common import OptionError
from ..mesh import boundary_quads, middle_nodes, with_middles
from .bricks import CellsByType, Floats, Hexes, Ints, box

__all__ = ["ball", "curved_ball", "curved_cylinder", "cylinder", "layer_heights", "wrapped"]


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
        If there is no layer, or `radius`, `core_size` or `grading` makes no sense.

    Examples
    --------
    >>> from hexconformal.elements import is_valid
    >>> points, cells = cylinder(4, 3, 5)
    >>> len(cells), bool(is_valid(points, cells).all())
    (320, True)
    """
    squares, heights, cells = _cylinder_grid(core, layers, axial, length, grading)
    return _in_cylinder(squares, heights, radius, core_size), cells


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
        If there is no layer, or `radius`, `core_size` or `grading` makes no sense.

    Examples
    --------
    >>> from hexconformal.elements import is_valid
    >>> points, cells = ball(4, 3)
    >>> len(cells), bool(is_valid(points, cells).all())
    (352, True)
    """
    cubes, heights, cells = _ball_grid(core, layers, grading)
    return _in_ball(cubes, heights, radius, core_size), cells


def curved_cylinder(
    core: int = 2,
    layers: int = 2,
    axial: int = 4,
    radius: float = 1.0,
    length: float = 2.0,
    core_size: float = 0.5,
    grading: float = 1.0,
    nodes: int = 27,
) -> tuple[Floats, CellsByType]:
    """The cylinder of :func:`cylinder` by quadratic hexahedra, whose nodes between corners lie on the true surface.

    Inside, too, these nodes are where the formula of the grid has them: curves follow the surface. The volume is short
    of the true one by a share of u^4 / 30, where 2 u is the angle that a cell has of the circle: by less than a
    thousandth with 8 cells around.

    Parameters
    ----------
    core, layers, axial, radius, length, core_size, grading
        As of :func:`cylinder`.
    nodes
        Of a cell: 20 or 27.

    Returns
    -------
    (n, 3) points;
    cells (m, `nodes`) by the name of their type, as :func:`hexconformal.as_volume_mesh` takes them.

    Raises
    ------
    OptionError
        If a parameter makes no sense.

    Examples
    --------
    >>> from hexconformal import as_volume_mesh, quality
    >>> mesh = as_volume_mesh(curved_cylinder(2, 1, 2, nodes=20))
    >>> mesh, bool(quality(mesh).valid.all()), float(quality(mesh).volume.sum() / (2 * np.pi)).__round__(4)
    (MixedMesh(169 points, 24 hexahedra of 20 nodes), True, 0.9992)
    """
    squares, heights, cells = _with_middles(*_cylinder_grid(core, layers, axial, length, grading), nodes)
    return _in_cylinder(squares, heights, radius, core_size), {f"hexahedron{nodes}": cells}


def curved_ball(
    core: int = 2, layers: int = 2, radius: float = 1.0, core_size: float = 0.5, grading: float = 1.0, nodes: int = 27
) -> tuple[Floats, CellsByType]:
    """The ball of :func:`ball` by quadratic hexahedra, whose nodes between corners lie on the true surface.

    Parameters
    ----------
    core, layers, radius, core_size, grading
        As of :func:`ball`.
    nodes
        Of a cell: 20 or 27.

    Returns
    -------
    (n, 3) points;
    cells (m, `nodes`) by the name of their type, as :func:`hexconformal.as_volume_mesh` takes them.

    Raises
    ------
    OptionError
        If a parameter makes no sense.

    Examples
    --------
    >>> from hexconformal import as_volume_mesh, quality
    >>> mesh = as_volume_mesh(curved_ball(2, 1))
    >>> mesh, bool(quality(mesh).valid.all())
    (MixedMesh(321 points, 32 hexahedra of 27 nodes), True)
    """
    cubes, heights, cells = _with_middles(*_ball_grid(core, layers, grading), nodes)
    return _in_ball(cubes, heights, radius, core_size), {f"hexahedron{nodes}": cells}


def _cylinder_grid(core: int, layers: int, axial: int, length: float, grading: float) -> tuple[Floats, Floats, Ints]:
    """Nodes of a cylinder's O-grid on concentric squares along z, their heights above the central block, cells."""
    square, cells = box((core, core, axial), (2.0, 2.0, length), (-1.0, -1.0, 0.0))
    quads = boundary_quads(cells)[0]
    side = ~np.isin(square[quads, 2], [0.0]).all(axis=1) & ~(square[quads, 2] == length).all(axis=1)
    squares, heights, hexes = wrapped(square, quads[side], layer_heights(layers, grading))
    return squares, heights, np.vstack([cells, hexes])


def _ball_grid(core: int, layers: int, grading: float) -> tuple[Floats, Floats, Ints]:
    """Nodes of a ball's O-grid on concentric cubes, their heights above the central block, cells."""
    cube, cells = box((core, core, core), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))
    cubes, heights, hexes = wrapped(cube, boundary_quads(cells)[0], layer_heights(layers, grading))
    return cubes, heights, np.vstack([cells, hexes])


def _with_middles(squares: Floats, heights: Floats, cells: Ints, nodes: int) -> tuple[Floats, Floats, Ints]:
    """A grid with nodes in the middle: there, not in space, so that they follow the curves."""
    cells, corners = middle_nodes(cells, len(squares), nodes)
    return with_middles(squares, corners), with_middles(heights, corners), cells


def _in_cylinder(squares: Floats, heights: Floats, radius: float, core_size: float) -> Floats:
    """Where nodes of a cylinder's grid lie."""
    inner, outer = squares.copy(), squares.copy()
    outer[:, :2] = radius * _round(squares[:, :2])
    inner[:, :2] = _core(squares[:, :2], radius, core_size)
    return np.asarray(inner + heights[:, None] * (outer - inner))


def _in_ball(cubes: Floats, heights: Floats, radius: float, core_size: float) -> Floats:
    """Where nodes of a ball's grid lie."""
    inner = _core(cubes, radius, core_size)
    return np.asarray(inner + heights[:, None] * (radius * _round(cubes) - inner))


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
    if not radius > 0:
        raise OptionError(f"radius must be positive, not {radius}")
    block: Floats = radius * size * (square / np.sqrt(square.shape[1]) + _round(square)) / 2
    return block


def layer_heights(count: int, grading: float) -> Floats:
    """Heights in (0, 1] of the tops of layers whose thickness changes geometrically.

    Parameters
    ----------
    count
        Number of layers.
    grading
        Thickness of the outermost over that of the innermost.

    Raises
    ------
    OptionError
        If there is no layer, or `grading` is not positive.

    Examples
    --------
    >>> layer_heights(2, 0.25)
    array([0.8, 1. ])
    """
    if count < 1 or not grading > 0:
        raise OptionError(f"layers must be 1 or more and grading positive, not {count} and {grading}")
    heights = np.cumsum(grading ** (np.arange(count) / max(count - 1, 1)))
    return np.asarray(heights / heights[-1])


def wrapped(places: Floats, quads: Ints, heights: Floats) -> tuple[Floats, Floats, Ints]:
    """Layers of hexahedra on outward quads.

    Parameters
    ----------
    places
        (n, 3) nodes of the mesh inside.
    quads
        (k, 4) faces of it.
    heights
        Of the tops of the layers.

    Returns
    -------
    places of all nodes, those of layers the places that they stand on; their heights, 0 inside; cells of the layers.

    Examples
    --------
    >>> places, heights, cells = wrapped(np.eye(4, 3), np.array([[0, 1, 2, 3]]), np.array([0.5, 1.0]))
    >>> heights[4:].tolist(), cells.tolist()
    ([0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0], [[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    """
    surface, base = np.unique(quads, return_inverse=True)
    base = base.reshape(quads.shape)
    count, layers = len(places), len(heights)
    ids = np.vstack([surface, count + np.arange(layers * len(surface)).reshape(layers, -1)])
    cells = np.vstack([np.hstack([ids[k][base], ids[k + 1][base]]) for k in range(layers)])
    above = np.concatenate([np.zeros(count), np.repeat(heights, len(surface))])
    return np.vstack([places, np.tile(places[surface], (layers, 1))]), above, cells
