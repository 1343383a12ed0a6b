"""The barrier energy of a surface: against given normals, its continuation, its curvature."""

import numpy as np
import pytest
from meshes.surfaces import grid, mixed_sphere, no_cells, shaken

from hexconformal.geometry import Faces
from surface.energy.barrier import Barrier
from surface.energy.target import target_shapes


def test_the_barrier_against_given_normals_lies_above_and_has_its_derivative():
    points, cells = shaken(mixed_sphere(5), 0.03)
    shapes = target_shapes("equilateral", points, cells)
    own, given = (Barrier(cells, shapes, len(points), 0.1, 0.5) for _ in range(2))
    f1, f2 = (np.stack(f, axis=1) for f in own.frames.derivatives(points))
    n = np.cross(f1, f2) + 0.05 * np.random.default_rng(1).normal(size=f1.shape) * np.linalg.norm(f1, axis=1)[:, None]
    given.normals = n / np.linalg.norm(n, axis=1, keepdims=True)
    assert (given.densities(points) >= own.densities(points) * (1 - 1e-12)).all()
    # A frame upside down has a finite density once the energy has settled there.
    given.normals[3] *= -1
    assert np.isinf(given.densities(points)[3])
    given.cap = 10.0
    given.adapt(points)
    assert np.isfinite(given.value(points))
    assert given.densities(points).max() <= 10.0
    d = np.random.default_rng(3).normal(size=points.shape)
    slope = (given.value(points + 1e-6 * d) - given.value(points - 1e-6 * d)) / 2e-6
    assert (given.gradient(points) * d).sum() == pytest.approx(slope, rel=1e-5)
    hessian = given.hessian(points).toarray()
    assert np.linalg.eigvalsh(hessian)[0] > -1e-10 * np.abs(hessian).max()


def test_the_continuation_is_a_factor_of_m():
    points, cells = shaken(mixed_sphere(5), 0.05)
    shapes = target_shapes("equilateral", points, cells)
    eased, mild = (Barrier(cells, shapes, len(points), m, 0.1) for m in (0.05, 0.15))
    eased.continuation = 3.0
    np.testing.assert_allclose(eased.densities(points), mild.densities(points), rtol=1e-12)
    np.testing.assert_allclose(eased.gradient(points), mild.gradient(points), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(eased.density_hessians(points), mild.density_hessians(points), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("m", "c"), [(np.inf, 0.0), (np.inf, 1.5), (0.1, 0.0), (0.1, 1.5)])
def test_barrier_curvature_in_the_plane_is_the_positive_part(m, c):
    """Of the eigenvalues of the exact Hessian of one frame at least the positive ones are kept."""
    x = np.zeros((3, 3))
    x[:, :2] = [[0.1, 0.0], [1.3, 0.2], [0.7, 0.5]]
    cells = Faces(np.array([[0, 1, 2]]), no_cells(4))
    energy = Barrier(cells, target_shapes("equilateral", x, cells), 3, m, c)
    step, exact = 1e-5, np.empty((6, 6))
    for column in range(6):
        d = np.zeros((3, 3))
        d[column // 2, column % 2] = step
        exact[:, column] = ((energy.gradient(x + d) - energy.gradient(x - d)) / (2 * step))[:, :2].ravel()
    plane = [0, 1, 3, 4, 6, 7]
    kept = energy.hessian(x).toarray()[np.ix_(plane, plane)]
    assert np.linalg.eigvalsh(kept - exact)[0] > -1e-4 * np.abs(exact).max()
    if c == 0.0:
        f = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
        assert np.linalg.matrix_rank(energy.density_hessians(x)[0][f], tol=1e-9 * np.abs(kept).max()) == 2


def test_new_normals_raise_the_energy_by_no_more_than_they_may():
    points, cells, _ = grid(6, 0.2)
    shapes = target_shapes("equilateral", points, cells)
    energy = Barrier(cells, shapes, len(points))
    count = len(cells.triangles)
    upright = np.tile([0.0, 0.0, 1.0], (count, 1))
    rng = np.random.default_rng(2)
    tilted = upright + 0.3 * rng.normal(size=(count, 3))
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    energy.update_normals(points, upright, np.inf)
    before = energy.value(points)
    energy.update_normals(points, tilted, np.inf)
    rise = energy.value(points) - before
    energy.update_normals(points, upright, 0.0)
    assert energy.value(points) == before  # what lowers it is always taken
    energy.update_normals(points, tilted, rise / 4)
    assert before < energy.value(points) <= before + rise / 4
    taken = (energy.normals == tilted).all(axis=1)
    assert 0 < taken.sum() < count
