"""Assembled once more by scikit-fem, with its own shape functions, quadrature and bookkeeping."""

import numpy as np
import pytest

from hexconformal.energy.distortion_term import DistortionTerm
from hexconformal.generate import box
from hexconformal.motion.extension import _stiffness

skfem = pytest.importorskip("skfem")
elasticity = pytest.importorskip("skfem.models.elasticity")

ORDER = [0, 1, 3, 4, 2, 5, 7, 6]  # of scikit-fem's nodes, in VTK's
CELLS = 4


def grid(points, cells):
    return skfem.MeshHex(points.T.copy(), cells[:, ORDER].T.copy(), validate=False, sort_t=False)


def fields(mesh):
    """Basis of (n, 3) fields, with 2 x 2 x 2 Gauss points."""
    return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)


def distorted(rng):
    """A grid of unit cubes, and its points moved at random."""
    points, cells = box((CELLS,) * 3, (CELLS,) * 3)
    return points, points + 0.2 * rng.uniform(-1, 1, points.shape), cells


def planes(f):
    """Pairs of columns of f[k, i] = d x_k / d xi_i, with the normals of their planes."""
    for i, j in ((0, 1), (1, 2), (2, 0)):
        area = np.cross(f[:, i], f[:, j], axis=0)
        yield f[:, i], f[:, j], area / np.sqrt((area**2).sum(axis=0)), i, j


def test_energy_and_frozen_form():
    rng = np.random.default_rng(0)
    straight, points, cells = distorted(rng)
    basis = fields(grid(straight, cells))
    place = basis.zeros()
    place[basis.nodal_dofs] = points.T
    jacobian = basis.interpolate(place).grad
    distortion = DistortionTerm(cells, len(points))

    def density(w):
        return sum(
            2 * (a**2 + b**2).sum(axis=0) - 4 * (n * np.cross(a, b, axis=0)).sum(axis=0)
            for a, b, n, *_ in planes(w.jacobian)
        )

    def frozen(u, v, w):
        u, v = u.grad, v.grad
        return sum(
            4 * (u[:, i] * v[:, i] + u[:, j] * v[:, j]).sum(axis=0)
            - 4 * (n * (np.cross(u[:, i], v[:, j], axis=0) + np.cross(v[:, i], u[:, j], axis=0))).sum(axis=0)
            for _, _, n, i, j in planes(w.jacobian)
        )

    energy = skfem.Functional(density).assemble(basis, jacobian=jacobian)
    assert distortion.value_gradient(points)[0] == pytest.approx(energy, rel=1e-12)
    matrix = skfem.BilinearForm(frozen).assemble(basis, jacobian=jacobian)
    field = rng.normal(size=points.shape)
    vector = basis.zeros()
    vector[basis.nodal_dofs] = field.T
    product = (matrix @ vector)[basis.nodal_dofs].T
    np.testing.assert_allclose(distortion.frozen_product(points, field), product, atol=1e-12 * np.abs(product).max())


def test_laplacian():
    """On parallelepipeds that are their own targets it is the Laplacian of the mesh."""
    rng = np.random.default_rng(1)
    points, cells = box((CELLS,) * 3, (CELLS,) * 3)
    axes = np.cumsum(rng.uniform(0.5, 2.0, (3, CELLS + 1)), axis=1)
    points = axes[[0, 1, 2], np.rint(points).astype(int)] @ (np.eye(3) + 0.3 * rng.uniform(-1, 1, (3, 3)))
    basis = skfem.Basis(grid(points, cells), skfem.ElementHex1(), intorder=3)
    expected = skfem.BilinearForm(lambda u, v, w: (u.grad * v.grad).sum(axis=0)).assemble(basis).toarray()
    frames = (points[cells[:, [1, 3, 4]]] - points[cells[:, :1]]).transpose(0, 2, 1)
    volumes, inverses = np.linalg.det(frames), np.linalg.inv(frames)[:, None]
    laplacian = DistortionTerm(cells, len(points), volumes, inverses).laplacian()
    np.testing.assert_allclose(laplacian.toarray(), expected, atol=1e-12)


def test_stiffness_of_elasticity():
    rng = np.random.default_rng(2)
    _, points, cells = distorted(rng)
    young = rng.uniform(0.1, 10.0, len(cells))
    basis = fields(grid(points, cells))
    lame, shear = elasticity.lame_parameters(young[:, None], 0.3)
    expected = elasticity.linear_elasticity(lame, shear).assemble(basis).toarray()
    dofs = basis.nodal_dofs.T.ravel()
    stiffness = _stiffness(points, cells, young).toarray()
    np.testing.assert_allclose(stiffness, expected[np.ix_(dofs, dofs)], atol=1e-11)
