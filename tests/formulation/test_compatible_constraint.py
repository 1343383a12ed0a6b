"""The compatible constraint on the boundary of volumes: its normals, its multipliers, and runs under it."""

import numpy as np
import pytest
from corner_problems import CUBES, dense

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy import Assembly, CornerWeights
from hexconformal.formulation import CompatibleConstraint, Formulation, convex_newton
from hexconformal.geometry import enclosed_volume, nodal_area_vectors
from hexconformal.mesh.topology import boundary_quads
from hexconformal.solver import AdmissibleDirections


def ball():
    points, cells = generate.ball(4, 2)
    return points, cells, boundary_quads(cells)[0]


def cube(amount=0.0):
    """A cube of 4^3 cells of size 1, its inner nodes jittered, and the face that each boundary quad is in."""
    points, cells = generate.jittered(*generate.box((4, 4, 4)), amount, seed=2)
    quads, _ = boundary_quads(cells)
    middle = points[quads].mean(axis=1)
    patches = np.argmax(np.column_stack([middle < 1e-9, middle > 1 - 1e-9]), axis=1)
    return 4.0 * points, cells, quads, patches


def smooth(points):
    """A displacement without symmetry."""
    x, y, z = points.T
    return np.column_stack([np.sin(y + 0.3) + x, np.cos(z) * x + 0.2, np.exp(0.5 * x) - y * z])


@pytest.mark.parametrize(("renewed", "order"), [(True, 3), (False, 2)])
def test_displacements_orthogonal_to_the_middle_normal_keep_the_volume_to_third_order(renewed, order):
    points, _, quads = ball()
    errors = []
    for t in (0.02, 0.01, 0.005):
        moved = points + t * smooth(points)
        constraint = CompatibleConstraint.at(points, quads, np.zeros(len(quads), int), 1.0)
        constraint = constraint.renewed(moved) if renewed else constraint
        flux = np.einsum("ki,ki->", (moved - points)[constraint.nodes], constraint.normals)
        errors.append(abs(flux - (enclosed_volume(moved, quads) - enclosed_volume(points, quads))))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, order, atol=0.1)


def test_every_patch_has_multipliers_of_its_own():
    points, _, quads, patches = cube()
    constraint = CompatibleConstraint.at(points, quads, patches, 0.1)
    count = np.bincount(constraint.nodes, minlength=len(points))
    inside = (np.minimum(points, 4.0 - points) < 1e-9).sum(axis=1)
    np.testing.assert_array_equal(count, inside)  # one in a face, two on an edge, three at a corner
    whole = np.zeros_like(points)
    np.add.at(whole, constraint.nodes, constraint.normals)
    np.testing.assert_allclose(whole, nodal_area_vectors(points, quads), atol=1e-14)
    assert constraint.areas.sum() == pytest.approx(6 * 16.0, rel=1e-14)


def test_value_gradient_and_blocks_are_those_of_the_multiplier():
    points, cells, quads = ball()
    eps, patches = 0.05, np.zeros(len(quads), int)
    moved = points + 0.05 * smooth(points)
    constraint = CompatibleConstraint.at(points, quads, patches, eps).renewed(moved)
    along = np.einsum("ki,ki->k", (moved - points)[constraint.nodes], constraint.normals)
    rho = constraint.multiplier(moved)
    # Stationary in rho: <v, N> = eps m rho; and what is left is <v, N> rho - eps / 2 m rho^2.
    np.testing.assert_allclose(along, eps * constraint.areas * rho, rtol=1e-12)
    left = (rho * along - 0.5 * eps * constraint.areas * rho**2).sum()
    assert constraint.value(moved) == pytest.approx(left, rel=1e-12)
    way = np.random.default_rng(0).normal(size=points.shape)
    value, gradient = constraint.value_gradient(moved)
    ahead, behind = (constraint.value(moved + s * 1e-4 * way) for s in (1, -1))
    assert (ahead - behind) / 2e-4 == pytest.approx((gradient * way).sum(), rel=1e-9)
    assembly, forces = Assembly.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    again, seen = constraint.add_convex(moved, forces, assembly)
    assert again == pytest.approx(value, rel=1e-14)
    np.testing.assert_allclose(forces, gradient, atol=1e-12)
    product = (dense(assembly.matrix) @ way.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(product, seen.second_product(moved, way), atol=1e-10)


@pytest.mark.long
def test_a_small_eps_holds_faces_edges_and_corners_of_a_cube_as_the_directions_would():
    points, cells, quads, patches = cube(0.3)
    nobody = AdmissibleDirections(np.empty(0, np.int64), np.empty((0, 3, 3)))
    constraint = CompatibleConstraint.at(points, quads, patches, 1e-9)
    formulation = Formulation(cells, len(points), CUBES, nobody, constraint=constraint)
    *_, last = convex_newton(formulation, points, CornerWeights(), 0.0, decrease=1e-9)
    shift = np.abs(last.points - points)
    on_boundary = np.minimum(points, 4.0 - points) < 1e-9
    assert shift[on_boundary].max() < 1e-6
    assert shift[on_boundary.any(axis=1)].max() < 0.3
    assert shift[~on_boundary.any(axis=1)].max() > 0.1
    assert hc.quality((last.points, cells)).scaled_jacobian.min() > 0.99


@pytest.mark.long
@pytest.mark.parametrize("energy", ["quaternionic", "barrier"])
def test_the_volume_drifts_the_less_the_smaller_eps_is(energy):
    mesh = generate.jittered(*generate.ball(4, 2), 0.3, seed=2)
    reports = [
        hc.regularize(mesh, energy=energy, constraint="compatible", eps=eps, emphasis="mean", hausdorff=0.02).report
        for eps in (1e-2, 1e-4, 1e-6)
    ]
    drift = [abs(report.volume_change) for report in reports]
    assert drift[0] > 10 * drift[1] > 100 * drift[2]
    for report in reports:
        assert report.after.invalid == 0
        assert report.hausdorff <= 0.02
        assert report.energy_after < 0.5 * report.energy_before


@pytest.mark.long
def test_the_bound_ends_steps_that_would_leave_the_surface():
    mesh = generate.jittered(*generate.cylinder(4, 3, 6), 0.3, seed=2)
    options = {"energy": "quaternionic", "constraint": "compatible", "hausdorff": 0.01, "eps": 0.1}
    report = hc.regularize(mesh, **options).report
    assert 0.009 < report.hausdorff <= 0.01
    assert not report.converged
    assert report.reason == "the surface has come to its bound"


@pytest.mark.long
def test_results_do_not_depend_on_the_unit():
    points, cells = generate.jittered(*generate.ball(3, 2), 0.3, seed=2)
    results = [
        hc.regularize((unit * points, cells), constraint="compatible", emphasis="mean").points / unit
        for unit in (1.0, 1024.0)
    ]
    np.testing.assert_allclose(*results, atol=1e-9)


def test_a_surface_to_slide_on_and_the_constraint_exclude_each_other():
    with pytest.raises(hc.OptionError, match="constraint='compatible' must go without another surface"):
        hc.Options(constraint="compatible", surface="fine.stl")
    with pytest.raises(hc.OptionError, match="eps must be positive"):
        hc.Options(eps=0.0)
