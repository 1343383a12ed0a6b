"""The discrete surface a flow sees: area, mean curvature vector, mass, stiffness, and their exact derivatives.

The mean curvature vector Y of linear (bilinear) elements solves, with z the gradient of the area,

    0 = <Y, psi> + <du, dpsi> for all psi,    that is    M Y = -z,

because the stiffness matrix K of the surface gives z = K x exactly, also under quadrature. Equation (22) of
docs/mathematics.md.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..mesh import Cells, Floats

__all__ = ["Elements", "State", "factorized"]

# Six points, exact for polynomials of degree 4 (Dunavant 1985).
_A, _B = 0.445948490915965, 0.091576213509771
_TRIANGLE = np.array(
    [[1 - 2 * c if i == k else c for k in range(3)] for c in (_A, _B) for i in range(3)],
)
_TRIANGLE_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)
_LEAST = 0.25  # of the lumped mass, what a node has of the area where its cells are too obtuse for a share
_GAUSS = 0.5 + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(12.0)


class Elements:
    """Where a surface is integrated: frames, with one or more points in each.

    A frame is a place where the derivatives f1, f2 of the immersion are taken: one for a triangle, one at each Gauss
    point of a quadrilateral. A triangle has six points in its frame.

    Parameters
    ----------
    cells
        The cells.
    count
        Number of nodes n.

    Attributes
    ----------
    nodes
        (f, k) nodes of each frame; where there are quadrilaterals k = 4 and a triangle repeats its first node, with
        weight zero.
    gradients
        (f, k, 2) derivatives of the shape functions.
    values
        (f, r, k) shape functions at the points.
    weights
        (f, r) weights of the points on the reference cell.
    """

    def __init__(self, cells: Cells, count: int) -> None:
        self.cells, self.count = cells, count
        t, q = len(cells.triangles), len(cells.quads)
        r, k = (1 if t == 0 else 6), (3 if q == 0 else 4)
        self.nodes = np.zeros((t + 4 * q, k), dtype=np.int64)
        self.gradients = np.zeros((t + 4 * q, k, 2))
        self.values = np.zeros((t + 4 * q, r, k))
        self.weights = np.full((t + 4 * q, r), 0.25 / r)
        self.nodes[:t, :3] = cells.triangles
        self.nodes[:t, 3:] = cells.triangles[:, :1]
        self.gradients[:t, :3] = [[-1, -1], [1, 0], [0, 1]]
        self.values[:t, :, :3] = _TRIANGLE[:r]
        self.weights[:t] = _TRIANGLE_WEIGHTS[:r] / 2
        if q:
            u, v = _GAUSS[:, 0], _GAUSS[:, 1]
            slopes = [np.stack([v - 1, 1 - v, v, -v], axis=1), np.stack([u - 1, -u, u, 1 - u], axis=1)]
            shapes = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
            self.nodes[t:] = np.repeat(cells.quads, 4, axis=0)
            self.gradients[t:] = np.tile(np.stack(slopes, axis=2), (q, 1, 1))
            self.values[t:] = np.tile(shapes, (q, 1))[:, None]
        self.measure = self.weights.sum(axis=1)
        self._rows = np.repeat(self.nodes, k, axis=1).ravel()
        self._columns = np.tile(self.nodes, (1, k)).ravel()

    def matrix(self, local: Floats) -> sparse.csr_matrix:
        """(n, n) matrix from local ones (f, k, k)."""
        shape = (self.count, self.count)
        return sparse.csr_matrix((local.ravel(), (self._rows, self._columns)), shape=shape)

    def gathered(self, local: Floats) -> Floats:
        """(n, 3) nodal sums of local vectors (f, k, 3)."""
        flat = self.nodes.ravel()
        columns = [np.bincount(flat, local[:, :, x].ravel(), self.count) for x in range(3)]
        return np.stack(columns, axis=1).astype(np.float64)

    def at_points(self, field: Floats) -> Floats:
        """(f, r, 3) a nodal field (n, 3) at the points."""
        return np.asarray(self.values @ field[self.nodes])

    def moments(self, field: Floats) -> Floats:
        """(n, 3) sums of weight, field (f, r, 3) and shape function: a field times the reference measure."""
        return self.gathered(np.einsum("frk,fr,frx->fkx", self.values, self.weights, field))


class State:
    """One position of the surface, with what is computed from it once.

    Parameters
    ----------
    elements
        Where to integrate.
    points
        (n, 3) positions.
    """

    def __init__(self, elements: Elements, points: Floats) -> None:
        self.elements, self.points = elements, points
        x = points[elements.nodes]
        self.f1, self.f2 = (np.einsum("fkx,fk->fx", x, elements.gradients[:, :, i]) for i in (0, 1))
        self.vectors = np.cross(self.f1, self.f2)  # (f, 3), of length dA over the reference measure
        self.areas = np.linalg.norm(self.vectors, axis=1)
        self.normals = self.vectors / self.areas[:, None]

    @cached_property
    def area(self) -> float:
        """Area of the surface."""
        return float((self.elements.measure * self.areas).sum())

    def pulled(self, field: Floats) -> Floats:
        """(n, 3) derivative of ``sum of <field, f1 x f2>`` over the frames, for a fixed field (f, 3)."""
        b = self.elements.gradients
        g1, g2 = np.cross(self.f2, field), np.cross(field, self.f1)
        return self.elements.gathered(b[:, :, :1] * g1[:, None] + b[:, :, 1:] * g2[:, None])

    @cached_property
    def area_gradient(self) -> Floats:
        """(n, 3) gradient z = K x of the area."""
        return self.pulled(self.elements.measure[:, None] * self.normals)

    def area_hessian(self, field: Floats) -> Floats:
        """(n, 3) second derivative of the area times a field (n, 3)."""
        elements = self.elements
        w = field[elements.nodes]
        d1, d2 = (np.einsum("fkx,fk->fx", w, elements.gradients[:, :, i]) for i in (0, 1))
        change = np.cross(d1, self.f2) + np.cross(self.f1, d2)
        along = (self.normals * change).sum(axis=1, keepdims=True)
        turn = (change - self.normals * along) / self.areas[:, None]
        m = elements.measure[:, None]
        g1 = m * (np.cross(d2, self.normals) + np.cross(self.f2, turn))
        g2 = m * (np.cross(self.normals, d1) + np.cross(turn, self.f1))
        b = elements.gradients
        return elements.gathered(b[:, :, :1] * g1[:, None] + b[:, :, 1:] * g2[:, None])

    def mass(self, factor: Floats | None = None) -> sparse.csr_matrix:
        """(n, n) mass matrix, with a factor (f, r) at the points."""
        e = self.elements
        weights = e.weights * self.areas[:, None]
        return e.matrix(
            np.einsum("fr,fri,frj->fij", weights if factor is None else weights * factor, e.values, e.values)
        )

    @cached_property
    def stiffness(self) -> sparse.csr_matrix:
        """(n, n) stiffness matrix K of the Laplace-Beltrami operator."""
        e = self.elements
        e11, e12, e22 = ((a * b).sum(axis=1) for a, b in ((self.f1, self.f1), (self.f1, self.f2), (self.f2, self.f2)))
        inverse = np.stack([np.stack([e22, -e12], axis=1), np.stack([-e12, e11], axis=1)], axis=1)
        inverse *= (e.measure / self.areas)[:, None, None]
        return e.matrix(np.einsum("fia,fab,fjb->fij", e.gradients, inverse, e.gradients))

    @cached_property
    def mass_matrix(self) -> sparse.csr_matrix:
        """(n, n) mass matrix M."""
        return self.mass()

    @cached_property
    def curvature(self) -> Floats:
        """(n, 3) mean curvature vector Y; on a sphere of radius R it points inwards and has length 2 / R."""
        return -self.solved(self.area_gradient)

    @cached_property
    def nodal_curvature(self) -> Floats:
        """(n, 3) mean curvature vector, node by node: not that of the energy, but on a sphere right at every node."""
        areas = self.dual_areas[:, None]
        return np.asarray(-self.area_gradient / np.where(areas > 0, areas, 1.0))

    @cached_property
    def dual_areas(self) -> Floats:
        """(n,) areas that belong to the nodes, equation (22a): of acute triangles those of the Voronoi cells."""
        stiffness, x = self.stiffness.tocoo(), self.points
        distances = ((x[stiffness.row] - x[stiffness.col]) ** 2).sum(axis=1)
        areas = -np.bincount(stiffness.row, stiffness.data * distances, len(x)) / 4
        return np.maximum(areas, _LEAST * np.asarray(self.mass_matrix.sum(axis=1)).ravel())

    def solved(self, loads: Floats) -> Floats:
        """(n, 3) the field whose products with the shape functions are the loads: M^-1 times them."""
        return np.asarray(self._factors.solve(loads))

    @cached_property
    def _factors(self):  # type: ignore[no-untyped-def]
        return factorized(self.mass_matrix)


def factorized(matrix: sparse.csr_matrix):  # type: ignore[no-untyped-def]
    """Sparse factors of a symmetric matrix that needs no pivoting (definite, or quasi-definite)."""
    unused = matrix.diagonal() == 0.0
    if unused.any():
        matrix = matrix + sparse.diags_array(unused.astype(np.float64))
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
