"""The boundary faces of a mesh that is shared out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import boundary_quads
from .halo import Halo
from .routes import Routes

__all__ = ["skin_faces"]

Ints = NDArray[np.int64]


def skin_faces(halo: Halo, cells: Ints) -> tuple[Ints, Ints]:
    """Faces (k, 4) of own cells (m, 8) that no cell of any rank has beside them, and the cell (k,) of each."""
    quads, owners = boundary_quads(cells)
    nodes = np.sort(halo.numbers[quads], axis=1)
    # Whoever has a face here alone asks the owner of its lowest node whether others have it, too.
    routes = Routes(halo.comm, halo.owners(nodes[:, 0]))
    _, which, counts = np.unique(routes.forward(nodes), axis=0, return_inverse=True, return_counts=True)
    alone = routes.backward(counts[which.ravel()]) == 1
    return quads[alone], owners[alone]
