"""Directions of descent in whole multiples of a power of two, so that rounding errors do not grow.

The last digits of a mesh depend on its unit and on how far away it is. Where cells are nearly flat a Newton step
multiplies such differences by up to 10^6, and the next one does so again. Rounded to
multiples far above them the step is the same in all its digits; a line search that halves it keeps them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian, edge_lengths
from ..kernel import loop
from ..mesh import SERIAL, Space
from .coupled_nodes import UNCOUPLED, CoupledNodes

__all__ = ["round_direction"]

Field = NDArray[np.float64]

_THIN, _THINNEST = 2.0**-6, 2.0**-16  # scaled Jacobians between which it has to be, in proportion


def round_direction(
    direction: Field,
    points: Field,
    cells: NDArray[np.int64],
    rounding: float,
    coupled: CoupledNodes = UNCOUPLED,
    space: Space = SERIAL,
) -> Field:
    """The direction (n, 3), that of every node in multiples of a power of two.

    That is `rounding` times the shortest edge of the cells at the node or up to half as much; less where one is flat.
    Nodes that move together are rounded alike.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 1))
    >>> round_direction(np.full((8, 3), 0.3), points, cells, 0.25)[0]
    array([0.25, 0.25, 0.25])
    """
    thickness = np.clip(np.abs(corner_scaled_jacobian(points, cells)), _THINNEST, _THIN) / _THIN
    smallest = np.full(len(points), np.inf)
    _least_at_nodes(cells, edge_lengths(points, cells), thickness, smallest)
    smallest = coupled.least(space.least_at_nodes(smallest))
    apart = np.isfinite(smallest) & (smallest > 0.0)
    unit = np.exp2(np.floor(np.log2(rounding * smallest[apart])))[:, None]
    result = direction.copy()
    result[apart] = unit * np.round(direction[apart] / unit)
    return result


@loop
def _least_at_nodes(cells, lengths, thickness, out):  # type: ignore[no-untyped-def]
    """The least, over the cells at each node, of the shortest edge times the thickness."""
    for c in range(len(cells)):
        least = lengths[c, 0]
        for k in range(1, lengths.shape[1]):
            least = min(least, lengths[c, k])
        least *= thickness[c]
        for a in range(cells.shape[1]):
            out[cells[c, a]] = min(out[cells[c, a]], least)
