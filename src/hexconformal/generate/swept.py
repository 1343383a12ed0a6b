"""Parts that are swept along an axis, of wedges and hexahedra."""

from __future__ import annotations

import numpy as np

from ..common import OptionError
from .bricks import CellsByType, Floats, Ints
from .o_grids import layer_heights, wrapped

__all__ = ["swept_cylinder"]


def swept_cylinder(
    core: int = 4,
    layers: int = 3,
    axial: int = 8,
    radius: float = 1.0,
    length: float = 2.0,
    core_size: float = 0.6,
    grading: float = 1.0,
) -> tuple[Floats, CellsByType]:
    """A round cylinder along z, swept from a disc: wedges around the axis, and layers of hexahedra around these.

    The triangles lie between concentric rings that are as far apart as their nodes are, so that they are nearly
    equilateral.

    Parameters
    ----------
    core
        Rings of triangles; the outermost has 6 times as many nodes.
    layers, axial
        Cells through the layers of hexahedra, and along the axis.
    radius, length
        Size; the axis runs from z = 0 to ``length``.
    core_size
        Radius of the wedges relative to that of the cylinder.
    grading
        Thickness of the outermost layer over that of the innermost: < 1 makes a boundary layer.

    Returns
    -------
    (n, 3) points;
    cells by the name of their type, as :func:`hexconformal.as_volume_mesh` takes them: 6 core^2 axial wedges and
    6 core layers axial hexahedra.

    Raises
    ------
    OptionError
        If there is no ring, layer or cell along the axis, a size is not positive, or `core_size` or `grading` makes no
        sense.

    Examples
    --------
    >>> from hexconformal import as_volume_mesh, quality
    >>> mesh = as_volume_mesh(swept_cylinder(3, 2, 4))
    >>> mesh, bool(quality(mesh).valid.all())
    (MixedMesh(365 points, 216 wedges, 144 hexahedra), True)
    """
    if min(core, axial) < 1:
        raise OptionError(f"core and axial must be 1 or more, not {core} and {axial}")
    if not min(radius, length) > 0:
        raise OptionError(f"radius and length must be positive, not {radius} and {length}")
    if not 0 < core_size < 1:
        raise OptionError(f"core_size must lie in (0, 1), not {core_size}")
    disc, triangles = _disc(core)
    rim = len(disc) - 6 * core + np.arange(6 * core)
    z = np.linspace(0.0, length, axial + 1)
    places = np.column_stack([np.tile(disc, (axial + 1, 1)), np.repeat(z, len(disc))])
    levels = len(disc) * np.arange(axial)[:, None, None]
    wedges = (levels + np.hstack([triangles, triangles + len(disc)])).reshape(-1, 6)
    edges = np.column_stack([rim, np.roll(rim, -1)])
    quads = (levels + np.hstack([edges, edges[:, ::-1] + len(disc)])).reshape(-1, 4)
    places, heights, hexahedra = wrapped(places, quads, layer_heights(layers, grading))
    # From the wedges to the surface along rays.
    places[:, :2] *= radius * (core_size + heights * (1.0 - core_size))[:, None]
    return places, {"wedge": wedges, "hexahedron": hexahedra}


def _disc(rings: int) -> tuple[Floats, Ints]:
    """Nodes of a unit disc in rings, the k-th of 6 k nodes, and the triangles between them, counter-clockwise."""
    points, triangles = [np.zeros((1, 2))], []
    inner = np.zeros(1, dtype=np.int64)
    for k in range(1, rings + 1):
        angles = np.pi / 3 * np.arange(6 * k) / k
        points.append(k / rings * np.column_stack([np.cos(angles), np.sin(angles)]))
        outer = 1 + 3 * k * (k - 1) + np.arange(6 * k)
        sector, along = np.divmod(np.arange(6 * k), k)
        # Each of the six sectors has k triangles on the outer ring, and k - 1 on the inner one.
        below = inner[(sector * (k - 1) + along) % len(inner)]
        triangles.append(np.column_stack([below, outer, np.roll(outer, -1)]))
        between = along < k - 1
        after = inner[(sector * (k - 1) + along + 1) % len(inner)]
        triangles.append(np.column_stack([below, np.roll(outer, -1), after])[between])
        inner = outer
    return np.concatenate(points), np.concatenate(triangles)
