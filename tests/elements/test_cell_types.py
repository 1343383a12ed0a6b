"""The tables of cell types: outward faces, ideals of one, frames that carry the symmetry, and their energy."""

import numpy as np
import pytest
from meshes.linear_cells import TYPES, random_cells, renumberings
from scipy.spatial.transform import Rotation

from hexconformal.elements import CELL_TYPES, FACES
from hexconformal.kernel.distortion import barrier_density, barrier_second, frame_density, frame_second

each_type = pytest.mark.parametrize("cell_type", TYPES, ids=lambda one: one.name)


def frames(cell_type, x):
    """(..., q, 3, 3) J at the sampled corners of cells (..., k, 3)."""
    corners = list(cell_type.samples)
    edges = x[..., cell_type.neighbours[corners], :] - x[..., corners, None, :]
    return np.swapaxes(edges, -1, -2) @ cell_type.inverse_target


def columns(matrices):
    """Matrices (..., 3, 3) as the kernel takes them: tuples of columns, of components."""
    return tuple(tuple(matrices[..., k, i] for k in range(3)) for i in range(3))


def energy(cell_type, x, density=frame_density):
    return density(columns(frames(cell_type, x))).sum(axis=-1)


def similar_copies(cell_type, count, rng):
    turns = Rotation.random(count, rng).as_matrix()
    return rng.uniform(0.1, 10, (count, 1, 1)) * (cell_type.ideal @ turns) + rng.normal(size=(count, 1, 3))


@each_type
def test_tables_are_those_of_a_ball(cell_type):
    x, edges = cell_type.ideal, {tuple(sorted(edge)) for edge in cell_type.edges.tolist()}
    around = [(a, b) for face in cell_type.faces for a, b in zip(face, face[1:] + face[:1], strict=True)]
    # Every edge lies between two faces, which run along it in opposite directions.
    assert len(set(around)) == len(around) == 2 * len(edges)
    assert {tuple(sorted(pair)) for pair in around} == edges
    assert len(x) - len(edges) + len(cell_type.faces) == 2
    for face in cell_type.faces:
        a, b, c = x[list(face[:3])]
        assert np.cross(b - a, c - b) @ (a - x.mean(axis=0)) > 0.1
    for node, neighbours in enumerate(cell_type.neighbours):
        assert {tuple(sorted((node, int(other)))) for other in neighbours} <= edges
    np.testing.assert_allclose(np.linalg.norm(x[cell_type.edges[:, 1]] - x[cell_type.edges[:, 0]], axis=1), 1)


@each_type
def test_numbers_are_those_of_vtk(cell_type):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.UnstructuredGrid({cell_type.vtk: np.array([cell_type.nodes])}, cell_type.ideal)
    cell = grid.get_cell(0)
    assert {tuple(sorted(edge.point_ids)) for edge in cell.edges} == {
        tuple(sorted(e)) for e in cell_type.edges.tolist()
    }
    assert {tuple(sorted(face.point_ids)) for face in cell.faces} == {tuple(sorted(face)) for face in cell_type.faces}
    assert grid.cell_quality("volume")["volume"][0] == pytest.approx(cell_type.volume, rel=1e-12)


def test_the_hexahedron_has_the_tables_of_before():
    assert CELL_TYPES["hexahedron"].faces == tuple(map(tuple, FACES.tolist()))
    np.testing.assert_array_equal(CELL_TYPES["hexahedron"].inverse_target, np.eye(3))


@each_type
def test_mirrored_order_changes_the_sign_of_every_corner(cell_type):
    x = random_cells(cell_type, 100, 0.1)
    assert (np.linalg.det(frames(cell_type, x)) > 0).all()
    assert (np.linalg.det(frames(cell_type, x[:, list(cell_type.mirrored)])) < 0).all()


@each_type
def test_ideal_cells_have_no_energy(cell_type):
    copies = similar_copies(cell_type, 1000, np.random.default_rng(0))
    invariant = energy(cell_type, copies, lambda f: barrier_density(f, 0.0))
    assert invariant.max() <= 3e-28
    np.testing.assert_allclose(np.linalg.det(frames(cell_type, cell_type.ideal)), 1, rtol=1e-14)
    assert energy(cell_type, random_cells(cell_type, 100, 0.1)).min() > 1e-3


@each_type
@pytest.mark.parametrize("density", [frame_density, lambda f: barrier_density(f, 0.1)])
def test_energy_does_not_depend_on_the_order_of_nodes(cell_type, density):
    orders = renumberings(cell_type)
    assert len(orders) == {"tetra": 12, "wedge": 6, "pyramid": 4, "hexahedron": 24}[cell_type.name]
    x = random_cells(cell_type, 200, 0.6)
    expected = energy(cell_type, x, density)
    for order in orders:
        np.testing.assert_allclose(energy(cell_type, x[:, order], density), expected, rtol=1e-13)


@each_type
def test_mirror_images_have_the_same_energy(cell_type):
    x = random_cells(cell_type, 200, 0.6)
    for order in renumberings(cell_type, -1):
        image = x[:, order] * [1, 1, -1]
        np.testing.assert_allclose(energy(cell_type, image), energy(cell_type, x), rtol=1e-13)


@pytest.mark.parametrize(("name", "least"), [("tetra", 0.5), ("wedge", 0.1)])
def test_with_axes_that_are_the_same_at_all_corners_the_order_would_matter(name, least):
    cell_type = CELL_TYPES[name]
    axes = Rotation.from_euler("xyz", [10, 20, 40], degrees=True).as_matrix()
    inverses = np.linalg.inv(frames(cell_type, cell_type.ideal) @ np.linalg.inv(cell_type.inverse_target)) @ axes
    x, sums = random_cells(cell_type, 200, 0.3), []
    for order in renumberings(cell_type):
        edges = frames(cell_type, x[:, order]) @ np.linalg.inv(cell_type.inverse_target)
        sums.append(frame_density(columns(edges @ inverses)).sum(axis=-1))
    assert (np.max(sums, axis=0) / np.min(sums, axis=0)).max() > 1 + least


def test_one_corner_of_a_tetrahedron_says_what_all_say():
    cell_type = CELL_TYPES["tetra"]
    x = random_cells(cell_type, 200, 0.5)
    edges = np.swapaxes(x[:, cell_type.neighbours] - x[:, :, None], -1, -2) @ cell_type.inverse_target
    densities = frame_density(columns(edges))
    np.testing.assert_allclose(densities, np.repeat(densities[:, :1], 4, axis=1), rtol=1e-12)


@each_type
@pytest.mark.parametrize("second", [frame_second, lambda f, d: barrier_second(f, d, 0.0)])
def test_only_similarities_cost_nothing(cell_type, second):
    x = similar_copies(cell_type, 1, np.random.default_rng(1))[0]
    x /= np.linalg.norm(x[1] - x[0])
    size = x.size
    moves = np.eye(size).reshape(size, *x.shape)
    at, along = columns(frames(cell_type, x)[None]), frames(cell_type, moves)
    found = second(at, columns(along))
    second_derivatives = np.stack([np.stack(column, axis=-1) for column in found], axis=-1)
    hessian = np.einsum("aqij,bqij->ab", along, second_derivatives)
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12)
    values = np.linalg.eigvalsh(hessian)
    assert np.abs(values[:7]).max() < 1e-12
    assert values[7] > 0.1
