"""Linear extensions of a displacement of the boundary into the mesh: harmonic, or elastic."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from ..elements import cell_volumes, gauss_rule, shape_gradients
from ..energy import DistortionTerm, jacobian_matrices
from ..kernel import loop, parallel_ranges
from ..mesh import NormalizedMesh, binary_search, corner_incidences, node_pattern
from ..solver import AdmissibleDirections, LaplacePreconditioner, conjugate_gradients

__all__ = ["EXTENSIONS", "Elastic", "Harmonic"]

Field = NDArray[np.float64]

_POISSON_RATIO = 0.3
_MAX_ITERATIONS = 1000


class Harmonic:
    """Componentwise harmonic on the reference cells, where the displacement is not given.

    Parameters
    ----------
    normalized
        The mesh.
    admissible
        Directions nodes may go in; those whose displacement is given are held.
    tolerance
        Of the linear solver.

    Attributes
    ----------
    preconditioner
        The preconditioner: an approximate inverse of the scalar Laplacian on the nodes that may go.
    """

    def __init__(self, normalized: NormalizedMesh, admissible: AdmissibleDirections, tolerance: float) -> None:
        self._admissible, self._tolerance, self._space = admissible, tolerance, normalized.space
        self._laplacian = DistortionTerm(normalized.cells, len(normalized.points), quadrature="corners").laplacian()
        self.preconditioner = LaplacePreconditioner(
            self._laplacian, admissible, normalized.referenced, space=self._space
        )

    def __call__(self, field: Field, points: Field) -> Field:
        """The field (n, 3), zero but where it is given, continued to all nodes of the mesh as it is at the points."""
        return self._solve(self._laplacian.__matmul__, self.preconditioner, field)

    def _solve(self, product: Callable[[Field], Field], preconditioner: LaplacePreconditioner, field: Field) -> Field:
        space, project = self._space, self._admissible.project
        if not space.anywhere(bool(field.any())):
            return field

        def of_all(v: Field) -> Field:
            return project(space.add(product(space.update(v))))

        found = conjugate_gradients(of_all, preconditioner, -of_all(field), self._tolerance, _MAX_ITERATIONS, space)
        return space.update(field + found)


class Elastic(Harmonic):
    """Linear elasticity on the mesh as it is, cells stiffer as they are smaller (Jacobian-based stiffening).

    Notes
    -----
    Stein, Tezduyar & Benney, Mesh moving techniques for fluid-structure interactions with large displacements,
    J. Appl. Mech. 70 (2003): Young's modulus goes with one over the volume of a cell. Every step starts from the
    last mesh; the way back does not lead to the first one.
    """

    def __init__(self, normalized: NormalizedMesh, admissible: AdmissibleDirections, tolerance: float) -> None:
        super().__init__(normalized, admissible, tolerance)
        self._cells = normalized.cells

    def __call__(self, field: Field, points: Field) -> Field:
        volumes = cell_volumes(points, self._cells)
        matrix = _stiffness(points, self._cells, self._space.mean(volumes) / volumes)
        return self._solve(lambda v: np.asarray(matrix @ v.ravel()).reshape(-1, 3), self.preconditioner, field)


def _stiffness(points: Field, cells: NDArray[np.int64], young: Field) -> scipy.sparse.bsr_matrix:
    """(3 n, 3 n) stiffness matrix of isotropic elasticity in 3 x 3 blocks, 2 x 2 x 2 Gauss points."""
    count = len(points)
    gauss_points, weights = gauss_rule()
    frames = jacobian_matrices(points, cells)
    gradients = np.einsum("qai,mqij->mqaj", shape_gradients(gauss_points), np.linalg.inv(frames))
    measures = np.linalg.det(frames) * weights * young[:, None]
    incidences = corner_incidences(cells, count)
    indptr, indices = node_pattern(cells, *incidences)
    data = np.empty((len(indices), 3, 3))
    lame, shear = _POISSON_RATIO / ((1 + _POISSON_RATIO) * (1 - 2 * _POISSON_RATIO)), 0.5 / (1 + _POISSON_RATIO)
    parallel_ranges(_rows, count, cells, gradients, measures, lame, shear, *incidences, indptr, indices, data)
    return scipy.sparse.bsr_matrix((data, indices, indptr), shape=(3 * count, 3 * count))


@loop
def _rows(first, last, cells, g, measures, lame, shear, offsets, incidences, indptr, indices, data):  # type: ignore[no-untyped-def]
    for node in range(first, last):
        for k in range(indptr[node], indptr[node + 1]):
            data[k] = 0.0
        for k in range(offsets[node], offsets[node + 1]):
            cell, a = incidences[k] // 8, incidences[k] % 8
            for b in range(8):
                place = binary_search(indices, indptr[node], indptr[node + 1], cells[cell, b])
                for q in range(8):
                    w = measures[cell, q]
                    inner = 0.0
                    for i in range(3):
                        inner += g[cell, q, a, i] * g[cell, q, b, i]
                    for i in range(3):
                        data[place, i, i] += w * shear * inner
                        for j in range(3):
                            data[place, i, j] += w * (
                                lame * g[cell, q, a, i] * g[cell, q, b, j] + shear * g[cell, q, a, j] * g[cell, q, b, i]
                            )


EXTENSIONS = {"harmonic": Harmonic, "elastic": Elastic}
