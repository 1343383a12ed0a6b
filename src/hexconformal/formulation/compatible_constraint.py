"""The compatible constraint of Gruber & Aulisa on the boundary of a volume, with a multiplier per node and patch.

On surfaces it makes displacements v orthogonal to the middle normal N~; they leave volumes to future work. Here the
boundary is cut into smooth patches p at its feature curves, and each has a multiplier of its own,

    L = E(f + v) + sum_p int rho_p <v, N~_p> - eps / 2 int rho_p^2,    eps = eps_hat h^2,

so that a node inside a patch keeps two directions, one on a curve its tangent, and a corner none. rho is nodal and
lumped, which eliminates it: rho = <v, N~> / (eps m), and there is left

    E(f + v) + sum_p sum_i <v_i, N~_pi>^2 / (2 eps m_pi),

with N~_pi the integral of normal times shape function over the patch, half-way between f and f + v, and m_pi that of
the shape function alone. Equation (14a) and equation (14b) of docs/mathematics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..energy import Assembly, Patch, Term
from ..geometry import Faces, nodal_area_vectors, nodal_areas

__all__ = ["CompatibleConstraint"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CompatibleConstraint(Term):
    """The term that is left of the constraint once the multiplier is eliminated; the normals are frozen until renewed.

    Attributes
    ----------
    start
        (n, 3) positions f that displacements are measured from.
    nodes
        (k,) node of each multiplier.
    quads
        (q, 4) boundary quads, in places of `nodes`: those of one patch share no multiplier with another's.
    eps
        Relaxation, an area.
    normals
        (k, 3) area vectors N~.
    areas
        (k,) lumped areas m.
    patch
        Nodes of a patch of the mesh, the only ones that move; None for the whole mesh.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((1, 1, 1))
    >>> quads, _ = boundary_quads(cells)
    >>> constraint = CompatibleConstraint.at(points, quads, np.arange(6), 0.5)
    >>> len(constraint.nodes)  # eight corners of three faces each
    24
    >>> round(constraint.value(points + [0.1, 0.0, 0.0]), 12)  # the two faces x = const: <v, N>^2 / m = 0.01 of area 1
    0.02
    """

    start: Field
    nodes: Ints
    quads: Ints
    eps: float
    normals: Field
    areas: Field
    patch: Patch | None = None

    @classmethod
    def at(cls, points: Field, quads: Ints, patches: Ints, eps: float) -> CompatibleConstraint:
        """The constraint on displacements from points (n, 3), where quads (q, 4) belong to patches (q,)."""
        count = int(patches.max(initial=0)) + 1
        keys, places = np.unique(quads * count + patches[:, None], return_inverse=True)
        nodes, own = keys // count, places.reshape(quads.shape)
        areas = np.maximum(nodal_areas(points[nodes], Faces.of(own)), 1e-300)
        return cls(points, nodes, own, eps, nodal_area_vectors(points[nodes], own), areas)

    def renewed(self, points: Field) -> CompatibleConstraint:
        """The constraint with the normals half-way between the start and these points."""
        middle = 0.5 * (self.start + self._all_points(points))
        return replace(self, normals=nodal_area_vectors(middle[self.nodes], self.quads))

    def multiplier(self, points: Field) -> Field:
        """(k,) the multiplier rho = <v, N~> / (eps m)."""
        return self._along(points) / (self.eps * self.areas)

    def value(self, points: Field) -> float:
        """The sum of <v, N~>^2 / (2 eps m)."""
        return float((0.5 * self._along(points) ** 2 / (self.eps * self.areas)).sum())

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Value and gradient (n, 3), normals frozen."""
        forces = np.zeros_like(self.start)
        np.add.at(forces, self.nodes, self.multiplier(points)[:, None] * self.normals)
        return self.value(points), forces if self.patch is None else forces[self.patch.nodes]

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add gradient and Hessian N~ N~^T / (eps m) of the constraint as it is seen from here."""
        seen = self.renewed(points)
        value, force = seen.value_gradient(points)
        gradient += force
        nodes = self.nodes if self.patch is None else self.patch.local[self.nodes]
        matrix = assembly.matrix
        # The diagonal block is the last of its row; rows of held nodes are empty.
        there = (nodes >= 0) & (matrix.indptr[nodes + 1] > matrix.indptr[nodes])
        outer = np.einsum("ki,kj->kij", seen.normals, seen.normals) / (self.eps * self.areas)[:, None, None]
        np.add.at(matrix.data, matrix.indptr[nodes[there] + 1] - 1, outer[there])
        return value, seen

    def second_product(self, points: Field, variation: Field) -> Field:
        """The Hessian times a variation (n, 3), normals frozen."""
        everywhere, forces = np.zeros_like(self.start), np.zeros_like(self.start)
        nodes = slice(None) if self.patch is None else self.patch.nodes
        everywhere[nodes] = variation
        along = np.einsum("ki,ki->k", everywhere[self.nodes], self.normals) / (self.eps * self.areas)
        np.add.at(forces, self.nodes, along[:, None] * self.normals)
        return np.asarray(forces[nodes])

    def restricted(self, patch: Patch) -> CompatibleConstraint:
        """The constraint where only the nodes of a patch move."""
        return replace(self, patch=patch)

    def _along(self, points: Field) -> Field:
        shift = self._all_points(points)[self.nodes] - self.start[self.nodes]
        return np.asarray(np.einsum("ki,ki->k", shift, self.normals))

    def _all_points(self, points: Field) -> Field:
        if self.patch is None:
            return points
        everywhere = self.patch.points.copy()
        everywhere[self.patch.nodes] = points
        return everywhere
