"""The preconditioner of minimizations: multigrid for the scalar Laplacian, set up once for the whole run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from ..mesh import SERIAL, Space
from .admissible import AdmissibleDirections
from .multigrid import Multigrid, MultigridSchedule

__all__ = ["LaplacePreconditioner"]

Field = NDArray[np.float64]


class LaplacePreconditioner:
    """Approximate inverse (8 L)^-1 of the Hessian on the admissible displacements.

    With constant normals the frozen Hessian is 8 L, componentwise. Components that are held are rows
    taken out of L; components with the same rows share one multigrid hierarchy. Nodes that move together are one row,
    where none of them is turned; others have the mean of what comes out for each.

    Parameters
    ----------
    laplacian
        (n, n) scalar Laplacian L.
    admissible
        Directions in which nodes may move.
    referenced
        (n,) nodes that belong to a cell; the others have empty rows.
    schedule
        Numbers of the hierarchies.
    space
        Where the fields live; it may have hierarchies of its own.
    """

    def __init__(
        self,
        laplacian: scipy.sparse.csr_matrix,
        admissible: AdmissibleDirections,
        referenced: NDArray[np.bool_],
        schedule: MultigridSchedule | None = None,
        space: Space = SERIAL,
    ) -> None:
        def hierarchy(free: NDArray[np.bool_]) -> Callable[[Field, Sequence[int]], Field]:
            if space.hierarchy is not None:
                return space.hierarchy(laplacian, free)
            return Multigrid(laplacian, free, schedule)

        free = referenced[:, None] & ~admissible.held_components(len(referenced))
        self._joined = admissible.coupled.translated()
        laplacian = self._joined.condensed_scalar(laplacian)
        free[self._joined.nodes] &= (self._joined.nodes == self._joined.roots)[:, None]
        self._project = admissible.project
        self._cycles: list[tuple[list[int], Callable[[Field, Sequence[int]], Field]]] = []
        for component in range(3):
            for axes, _ in self._cycles:
                if space.everywhere(bool((free[:, axes[0]] == free[:, component]).all())):
                    axes.append(component)
                    break
            else:
                self._cycles.append(([component], hierarchy(free[:, component])))

    def __call__(self, gradient: Field) -> Field:
        """Map an admissible gradient (n, 3) to an admissible displacement."""
        out, gradient = np.empty_like(gradient), self._joined.gathered(gradient)
        for axes, cycle in self._cycles:
            out[:, axes] = cycle(gradient, axes)[:, axes]
        return self._project(self._joined.spread(out)) / 8.0
