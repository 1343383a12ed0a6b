"""A surface with linear or bilinear elements: area, mean curvature vector, mass, stiffness, and exact derivatives.

The mean curvature vector Y of linear (bilinear) elements solves, with z the gradient of the area,

    0 = <Y, psi> + <du, dpsi> for all psi,    that is    M Y = -z,

because the stiffness matrix K of the surface gives z = K x exactly, also under quadrature. Equation (22) of
docs/mathematics.md.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy

from hexconformal.geometry import Faces

from ..mesh import Floats

__all__ = ["DiscreteSurface", "Elements", "factorize"]

# Six points, exact for polynomials of degree 4 (Dunavant 1985).
_A, _B = 0.445948490915965, 0.091576213509771
_TRIANGLE = np.array(
    [[1 - 2 * c if i == k else c for k in range(3)] for c in (_A, _B) for i in range(3)],
)
_TRIANGLE_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)
_MIN_DUAL_AREA = 0.25  # of the lumped mass, for nodes whose cells are so obtuse that their Voronoi area is smaller
_GAUSS = 0.5 + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(12.0)


class Elements:
    """Finite elements of a surface: frames, with one or more quadrature points in each.

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

    def __init__(self, cells: Faces, count: int) -> None:
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
        self.frame_weights = self.weights.sum(axis=1)
        self._rows = np.repeat(self.nodes, k, axis=1).ravel()
        self._columns = np.tile(self.nodes, (1, k)).ravel()

    def assemble_matrix(self, local: Floats) -> scipy.sparse.csr_matrix:
        """(n, n) matrix, the sum of local ones (f, k, k)."""
        shape = (self.count, self.count)
        return scipy.sparse.csr_matrix((local.ravel(), (self._rows, self._columns)), shape=shape)

    def assemble_vector(self, local: Floats) -> Floats:
        """(n, 3) nodal sums of local vectors (f, k, 3)."""
        flat = self.nodes.ravel()
        columns = [np.bincount(flat, local[:, :, x].ravel(), self.count) for x in range(3)]
        return np.stack(columns, axis=1).astype(np.float64)

    def interpolate(self, field: Floats) -> Floats:
        """(f, r, 3) values of a nodal field (n, 3) at the quadrature points."""
        return np.asarray(self.values @ field[self.nodes])

    def load_vector(self, field: Floats) -> Floats:
        """(n, 3) integrals of a field (f, r, 3) times the shape functions, over the reference measure."""
        return self.assemble_vector(np.einsum("frk,fr,frx->fkx", self.values, self.weights, field))


class DiscreteSurface:
    """A surface at given positions, with its integrals and matrices, each computed once.

    Parameters
    ----------
    elements
        The elements.
    points
        (n, 3) positions.
    """

    def __init__(self, elements: Elements, points: Floats) -> None:
        self.elements, self.points = elements, points
        x = points[elements.nodes]
        self.f1, self.f2 = (np.einsum("fkx,fk->fx", x, elements.gradients[:, :, i]) for i in (0, 1))
        self.area_vectors = np.cross(self.f1, self.f2)  # (f, 3), of length dA over the reference measure
        self.area_elements = np.linalg.norm(self.area_vectors, axis=1)
        self.normals = self.area_vectors / self.area_elements[:, None]

    @cached_property
    def area(self) -> float:
        """Area of the surface."""
        return float((self.elements.frame_weights * self.area_elements).sum())

    def area_vector_gradient(self, field: Floats) -> Floats:
        """(n, 3) derivative of ``sum of <field, f1 x f2>`` over the frames, for a fixed field (f, 3)."""
        b = self.elements.gradients
        g1, g2 = np.cross(self.f2, field), np.cross(field, self.f1)
        return self.elements.assemble_vector(b[:, :, :1] * g1[:, None] + b[:, :, 1:] * g2[:, None])

    @cached_property
    def area_gradient(self) -> Floats:
        """(n, 3) gradient z = K x of the area."""
        return self.area_vector_gradient(self.elements.frame_weights[:, None] * self.normals)

    def area_hessian(self, field: Floats) -> Floats:
        """(n, 3) second derivative of the area times a field (n, 3)."""
        elements = self.elements
        w = field[elements.nodes]
        d1, d2 = (np.einsum("fkx,fk->fx", w, elements.gradients[:, :, i]) for i in (0, 1))
        change = np.cross(d1, self.f2) + np.cross(self.f1, d2)
        along = (self.normals * change).sum(axis=1, keepdims=True)
        turn = (change - self.normals * along) / self.area_elements[:, None]
        m = elements.frame_weights[:, None]
        g1 = m * (np.cross(d2, self.normals) + np.cross(self.f2, turn))
        g2 = m * (np.cross(self.normals, d1) + np.cross(turn, self.f1))
        b = elements.gradients
        return elements.assemble_vector(b[:, :, :1] * g1[:, None] + b[:, :, 1:] * g2[:, None])

    def mass(self, factor: Floats | None = None) -> scipy.sparse.csr_matrix:
        """(n, n) mass matrix, with a factor (f, r) at the points."""
        e = self.elements
        weights = e.weights * self.area_elements[:, None]
        return e.assemble_matrix(
            np.einsum("fr,fri,frj->fij", weights if factor is None else weights * factor, e.values, e.values)
        )

    @cached_property
    def stiffness(self) -> scipy.sparse.csr_matrix:
        """(n, n) stiffness matrix K of the Laplace-Beltrami operator."""
        e = self.elements
        e11, e12, e22 = ((a * b).sum(axis=1) for a, b in ((self.f1, self.f1), (self.f1, self.f2), (self.f2, self.f2)))
        inverse = np.stack([np.stack([e22, -e12], axis=1), np.stack([-e12, e11], axis=1)], axis=1)
        inverse *= (e.frame_weights / self.area_elements)[:, None, None]
        return e.assemble_matrix(np.einsum("fia,fab,fjb->fij", e.gradients, inverse, e.gradients))

    @cached_property
    def mass_matrix(self) -> scipy.sparse.csr_matrix:
        """(n, n) mass matrix M."""
        return self.mass()

    @cached_property
    def curvature(self) -> Floats:
        """(n, 3) mean curvature vector Y; on a sphere of radius R it points inwards and has length 2 / R."""
        return -self.solve_mass(self.area_gradient)

    @cached_property
    def nodal_curvature(self) -> Floats:
        """(n, 3) mean curvature vector, node by node: not that of the energy, but right at every node of a sphere."""
        areas = self.dual_areas[:, None]
        return np.asarray(-self.area_gradient / np.where(areas > 0, areas, 1.0))

    @cached_property
    def dual_areas(self) -> Floats:
        """(n,) areas that belong to the nodes, equation (22a): of acute triangles those of the Voronoi cells."""
        stiffness, x = self.stiffness.tocoo(), self.points
        distances = ((x[stiffness.row] - x[stiffness.col]) ** 2).sum(axis=1)
        areas = -np.bincount(stiffness.row, stiffness.data * distances, len(x)) / 4
        return np.maximum(areas, _MIN_DUAL_AREA * np.asarray(self.mass_matrix.sum(axis=1)).ravel())

    def solve_mass(self, loads: Floats) -> Floats:
        """(n, 3) M^-1 times loads (n, 3)."""
        return np.asarray(self._factors.solve(loads))

    @cached_property
    def _factors(self):  # type: ignore[no-untyped-def]
        return factorize(self.mass_matrix)


def factorize(matrix: scipy.sparse.csr_matrix):  # type: ignore[no-untyped-def]
    """Sparse factors of a symmetric matrix that needs no pivoting (definite, or quasi-definite)."""
    from scipy.sparse.linalg import splu

    unused = matrix.diagonal() == 0.0
    if unused.any():
        matrix = matrix + scipy.sparse.diags_array(unused.astype(np.float64))
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
