"""Energy, gradient and Hessians of whole meshes: differences, invariances, two ways to the same product."""

import numpy as np
import pytest
from differences import observed_order
from scipy.spatial.transform import Rotation

from hexconformal import generate
from hexconformal.common.errors import OptionError
from hexconformal.elements.hexahedron import QUADRATURE_RULES, shape_gradients
from hexconformal.energy.distortion_term import DistortionTerm
from hexconformal.generate import box
from hexconformal.kernel import threads
from hexconformal.kernel.distortion import barrier_density, frame_density
from hexconformal.mesh.topology import boundary_quads

SIZE = 5
STEPS = (2e-3, 1e-3)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.fixture
def mesh(rng):
    """A box with every node displaced by up to a fifth of a cell."""
    points, cells = box((SIZE, SIZE, SIZE), (1.0, 1.0, 1.0))
    return points + 0.2 / SIZE * rng.uniform(-1, 1, points.shape), cells


def targets(kind, m, rng):
    """Inverses of random target frames, in each shape that is accepted."""
    shape = {"one": (1, 1), "per cell": (m, 1), "per point": (1, 8), "per cell and point": (m, 8)}.get(kind)
    return None if shape is None else np.linalg.inv(np.eye(3) + 0.1 * rng.normal(size=(*shape, 3, 3)))


TARGETS = ["none", "one", "per cell", "per point", "per cell and point"]


@pytest.mark.parametrize("quadrature", ["gauss", "corners"])
@pytest.mark.parametrize("eps", [None, 0.0, 1e-3])
@pytest.mark.parametrize("kind", TARGETS)
def test_energies_against_numpy(mesh, rng, kind, eps, quadrature):
    points, cells = mesh
    scales, inverses = rng.uniform(0.5, 2, len(cells)), targets(kind, len(cells), rng)
    xi, weights = QUADRATURE_RULES[quadrature]()
    j = np.einsum("qai,mak->mqki", shape_gradients(xi), points[cells])
    if inverses is not None:
        j = j @ inverses
    frame = tuple(tuple(j[..., k, i] for k in range(3)) for i in range(3))
    density = frame_density(frame) if eps is None else barrier_density(frame, eps)
    energies = DistortionTerm(cells, len(points), scales, inverses, eps, quadrature).cell_energies(points)
    np.testing.assert_allclose(energies, scales * (density @ weights), rtol=1e-12)


@pytest.mark.parametrize("quadrature", ["gauss", "corners"])
@pytest.mark.parametrize("eps", [None, 0.0, 1e-3])
@pytest.mark.parametrize("kind", TARGETS)
def test_derivatives_against_differences(mesh, rng, kind, eps, quadrature):
    points, cells = mesh
    scales = rng.uniform(0.5, 2, len(cells)) if kind == "per cell" else None
    distortion = DistortionTerm(cells, len(points), scales, targets(kind, len(cells), rng), eps, quadrature)
    variation = rng.uniform(-1, 1, points.shape)
    slope = np.vdot(distortion.value_gradient(points)[1], variation)
    assert observed_order(
        lambda t: distortion.value_gradient(points + t * variation)[0], slope, STEPS
    ) == pytest.approx(2, abs=0.1)
    product = distortion.second_product(points, variation)
    assert observed_order(
        lambda t: distortion.value_gradient(points + t * variation)[1], product, STEPS
    ) == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize("quadrature", ["gauss", "corners"])
@pytest.mark.parametrize("kind", TARGETS)
def test_the_frozen_form_has_the_gradient_of_the_energy(mesh, rng, kind, quadrature):
    points, cells = mesh
    scales = rng.uniform(0.5, 2, len(cells))
    distortion = DistortionTerm(cells, len(points), scales, targets(kind, len(cells), rng), quadrature=quadrature)
    gradient = distortion.value_gradient(points)[1]
    np.testing.assert_allclose(distortion.frozen_product(points, points), gradient, atol=1e-12)


def test_the_frozen_form_is_symmetric_and_above_the_exact_one(mesh, rng):
    points, cells = mesh
    distortion = DistortionTerm(cells, len(points))
    for _ in range(20):
        a, b = rng.normal(size=(2, *points.shape))
        one, other = distortion.frozen_product(points, a), distortion.frozen_product(points, b)
        assert np.vdot(a, other) == pytest.approx(np.vdot(b, one), rel=1e-11)
        assert np.vdot(a, one) > np.vdot(a, distortion.second_product(points, a))


def test_constant_normals_and_fixed_boundary_leave_the_laplacian(rng):
    points, cells = box((SIZE, SIZE, SIZE), (1.0, 2.0, 3.0))
    inside = np.all((points > 1e-9) & (points < points.max(axis=0) - 1e-9), axis=1)
    distortion = DistortionTerm(cells, len(points))
    field = rng.normal(size=points.shape) * inside[:, None]
    product, laplacian = distortion.frozen_product(points, field), 8 * (distortion.laplacian() @ field)
    np.testing.assert_allclose(product[inside], laplacian[inside], atol=1e-13 * np.abs(field).max())
    # The antisymmetric part acts along the boundary only.
    field = rng.normal(size=points.shape)
    rest = distortion.frozen_product(points, field) - 8 * (distortion.laplacian() @ field)
    assert np.abs(rest[~inside]).max() > 0.1 > 1e10 * np.abs(rest[inside]).max()


def test_box_of_two_cubes():
    points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    inverses = np.diag([1.0, 1.0, 0.5])[None, None]
    assert DistortionTerm(cells, len(points)).value_gradient(points)[0] == pytest.approx(24.0, rel=1e-13)
    energy, gradient = DistortionTerm(cells, len(points), inverses=inverses).value_gradient(points)
    assert energy < 1e-28
    assert np.abs(gradient).max() < 1e-14


@pytest.mark.parametrize(("eps", "degree"), [(None, 2), (0.0, 0)])
def test_similarities(mesh, rng, eps, degree):
    points, cells = mesh
    distortion = DistortionTerm(cells, len(points), eps=eps)
    energy, gradient = distortion.value_gradient(points)
    rotation = Rotation.random(random_state=1).as_matrix()
    moved = 3.0 * points @ rotation.T + [1.0, -2.0, 5.0]
    moved_energy, moved_gradient = distortion.value_gradient(moved)
    assert moved_energy == pytest.approx(3.0**degree * energy, rel=1e-12)
    np.testing.assert_allclose(
        moved_gradient, 3.0 ** (degree - 1) * gradient @ rotation.T, atol=1e-12 * np.abs(gradient).max()
    )
    # Euler's identity, and no force along a translation.
    assert np.vdot(gradient, points) == pytest.approx(degree * energy, abs=1e-11 * energy)
    np.testing.assert_allclose(gradient.sum(axis=0), 0, atol=1e-11 * np.abs(gradient).max())


def test_order_of_cells_and_nodes(mesh, rng):
    points, cells = mesh
    energy, gradient = DistortionTerm(cells, len(points), eps=0.0).value_gradient(points)
    order = rng.permutation(len(points))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    other = place[cells][rng.permutation(len(cells))]
    other_energy, other_gradient = DistortionTerm(other, len(points), eps=0.0).value_gradient(points[order])
    assert other_energy == pytest.approx(energy, rel=1e-13)
    np.testing.assert_allclose(other_gradient, gradient[order], atol=1e-13 * np.abs(gradient).max())


def test_node_outside_every_cell_feels_nothing(mesh):
    points, cells = mesh
    distortion = DistortionTerm(cells, len(points) + 1)
    points = np.vstack([points, [9.0, 9.0, 9.0]])
    assert not distortion.value_gradient(points)[1][-1].any()
    assert not distortion.frozen_product(points, points)[-1].any()


def test_same_bits_for_every_number_of_threads(mesh, rng, monkeypatch):
    points, cells = mesh
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 1)
    results = []
    for count in (1, 2, 5):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        distortion = DistortionTerm(cells, len(points), eps=0.0)
        results.append(
            (
                *distortion.value_gradient(points),
                distortion.second_product(points, points),
                distortion.frozen_product(points, points),
                distortion.laplacian().data,
            )
        )
    for other in results[1:]:
        for a, b in zip(results[0], other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_unknown_quadrature():
    with pytest.raises(OptionError, match="quadrature"):
        DistortionTerm(np.zeros((1, 8), np.int64), 8, quadrature="lobatto")


def test_constant_normals_make_the_step_a_componentwise_harmonic_map():
    # A cube stretched along its axes has constant normals; only inner nodes are disturbed, along the axes.
    points, cells = generate.box((5, 5, 5))
    energy = DistortionTerm(cells, len(points))
    laplacian = energy.laplacian()
    surface = np.unique(boundary_quads(cells)[0])
    inner = np.setdiff1d(np.arange(len(points)), surface)
    field = np.zeros_like(points)
    field[inner] = np.random.default_rng(0).normal(size=(len(inner), 3))
    frozen = energy.frozen_product(points, field)
    assert np.abs(frozen - 8.0 * (laplacian @ field))[inner].max() < 1e-12
