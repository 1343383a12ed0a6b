"""Where nodes may go on cubes, cylinders and under masks."""

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy import Patch
from hexconformal.io.read_write import as_hex_mesh
from hexconformal.mesh.topology import boundary_quads
from hexconformal.solver.admissible import AdmissibleDirections, boundary_directions, fixed_components


def ranks(points, cells, *arguments):
    constraint = boundary_directions(points, boundary_quads(cells)[0], *arguments)
    rank = np.full(len(points), 3)
    rank[constraint.nodes] = np.rint(np.trace(constraint.projectors, axis1=1, axis2=2)).astype(int)
    return rank


def test_a_cube_has_faces_edges_and_corners():
    points, cells = generate.box((4, 4, 4))
    on = (np.isclose(points, 0) | np.isclose(points, 1)).sum(axis=1)
    assert np.array_equal(ranks(points, cells, "slide"), 3 - on)
    assert np.array_equal(ranks(points, cells, "fixed"), np.where(on > 0, 0, 3))
    assert (ranks(points, cells, "free") == 3).all()


def test_a_cylinder_slides_along_its_axis_and_in_its_flat_ends_only():
    points, cells = generate.cylinder()
    rank = ranks(points, cells, "slide")
    surface = np.unique(boundary_quads(cells)[0])
    radius = np.hypot(points[:, 0], points[:, 1])
    mantle = np.isclose(radius, radius.max())
    end = np.isclose(points[:, 2], points[:, 2].min()) | np.isclose(points[:, 2], points[:, 2].max())
    assert (rank[surface[mantle[surface] & ~end[surface]]] == 1).all()
    assert (rank[mantle & end] == 0).all()
    assert (rank[end & ~mantle] == 2).all()
    # To the last bit: an end stays flat, and the mantle's nodes keep their place across the axis.
    projectors = boundary_directions(points, boundary_quads(cells)[0]).all_projectors(len(points))
    assert (projectors[end & ~mantle] == np.diag([1.0, 1.0, 0.0])).all()
    assert (projectors[mantle & ~end] == np.diag([0.0, 0.0, 1.0])).all()


@pytest.mark.parametrize("axis", range(3))
def test_edges_in_a_coordinate_plane_stay_in_it_to_the_last_bit(axis):
    points, cells = generate.box((3, 3, 3))
    end = np.isin(points[:, axis], (0.0, 1.0))
    turned = points @ Rotation.from_rotvec(0.4 * np.eye(3)[axis]).as_matrix().T
    turned[:, axis] = points[:, axis]
    projectors = boundary_directions(turned, boundary_quads(cells)[0]).all_projectors(len(points))
    assert not projectors[end][:, axis].any()
    assert (np.trace(projectors[end], axis1=1, axis2=2).round() == 1).sum() == 16


def test_a_ball_does_not_slide_at_all():
    points, cells = generate.ball(3, 2)
    surface = np.unique(boundary_quads(cells)[0])
    assert (ranks(points, cells, "slide")[surface] == 0).all()


def test_three_corners_on_a_line_leave_their_plane_open():
    # A quad that is a triangle with a node in the middle of one side; turned, so that nothing is exact.
    points, cells = generate.box((2, 2, 2))
    top = np.flatnonzero((points == [0.5, 0.5, 1.0]).all(axis=1))
    points[top] = [0.25, 0.75, 1.0]  # between two nodes of its quads
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    assert ranks(points, cells, "slide")[top] == ranks(points @ turn.T, cells, "slide")[top] == 2


def test_quads_without_a_side_are_refused():
    points, cells = generate.box((2, 2, 2))
    points[1] = points[0]
    with pytest.raises(hc.MeshError, match=r"an edge of no length at nodes .*: move these apart"):
        boundary_directions(points, boundary_quads(cells)[0])


def test_projection_is_orthogonal_and_idempotent():
    points, cells = generate.sheared_cube(4)
    constraint = boundary_directions(points, boundary_quads(cells)[0])
    field = np.random.default_rng(0).normal(size=points.shape)
    once = constraint.project(field)
    assert np.abs(constraint.project(once) - once).max() < 1e-15
    assert abs(np.einsum("ij,ij->", once, field - once)) < 1e-12


def test_components_that_are_left_out_are_those_that_are_most_forbidden():
    points, cells = generate.box((3, 3, 3))
    on = (np.isclose(points, 0) | np.isclose(points, 1)).sum(axis=1)
    points = points @ Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix().T
    constraint = boundary_directions(points, boundary_quads(cells)[0])
    held, projectors = constraint.held_components(len(points)), constraint.all_projectors(len(points))
    assert np.array_equal(held.sum(axis=1), on)
    # A unit vector has a component of 1/3 at least, squared: so far from singular is what is left of a plane or line.
    for node in np.flatnonzero((on == 1) | (on == 2)):
        left = projectors[node][np.ix_(~held[node], ~held[node])]
        assert np.linalg.det(left) > 1 / 3 - 1e-12


def test_what_is_held_besides_is_not_added_to_the_sums_that_were_given():
    sums, fixed = np.zeros((2, 3, 3)), np.zeros((2, 3), dtype=bool)
    fixed[1, 2] = True
    constraint = AdmissibleDirections.from_normal_sums(sums, fixed)
    assert np.array_equal(constraint.nodes, [1])
    assert np.array_equal(constraint.projectors, [np.diag([1.0, 1.0, 0.0])])
    assert not sums.any()


def test_further_nodes_can_be_held():
    points, cells = generate.box((3, 3, 3))
    constraint = boundary_directions(points, boundary_quads(cells)[0])
    on = (np.isclose(points, 0) | np.isclose(points, 1)).sum(axis=1)
    inner, face = np.flatnonzero(on == 0)[0], np.flatnonzero(on == 1)[0]
    held = constraint.with_held(np.array([inner, face, inner]))
    before, after = constraint.all_projectors(len(points)), held.all_projectors(len(points))
    assert not after[[inner, face]].any()
    others = np.setdiff1d(np.arange(len(points)), [inner, face])
    assert np.array_equal(after[others], before[others])
    assert np.array_equal(held.nodes, np.union1d(constraint.nodes, [inner]))
    # The one it came from is as it was.
    assert np.array_equal(before, constraint.all_projectors(len(points)))
    assert np.array_equal(held.with_held(np.empty((0, 8), int)).all_projectors(len(points)), after)


def test_free_are_nodes_that_can_move_at_all():
    points, cells = generate.box((3, 3, 3))
    on = (np.isclose(points, 0) | np.isclose(points, 1)).sum(axis=1)
    constraint = boundary_directions(points, boundary_quads(cells)[0])
    assert np.array_equal(constraint.free(len(points)), on < 3)
    none = AdmissibleDirections(np.empty(0, int), np.empty((0, 3, 3)))
    assert none.free(5).all()
    assert np.array_equal(none.with_held([3]).free(5), [True, True, True, False, True])


def test_in_a_patch_nodes_that_move_keep_their_directions_and_the_others_are_held():
    points, cells = generate.box((4, 4, 4))
    constraint = boundary_directions(points, boundary_quads(cells)[0])
    moving = np.zeros(len(points), dtype=bool)
    moving[cells[5]] = True
    patch = Patch.around(moving, cells, points)
    part = constraint.restricted(patch)
    assert np.array_equal(part.nodes, np.unique(part.nodes))
    projectors = part.all_projectors(len(patch.nodes))
    expected = constraint.all_projectors(len(points)) * moving[:, None, None]
    assert 0 < moving[patch.nodes].sum() < len(patch.nodes) < len(points)
    assert np.array_equal(projectors, expected[patch.nodes])
    field = np.random.default_rng(0).normal(size=points.shape) * moving[:, None]
    assert np.array_equal(part.project(field[patch.nodes]), constraint.project(field)[patch.nodes])


def test_nodes_of_cells_that_are_carried_along_are_held_besides_those_that_are_asked_for():
    points, cells = generate.box((2, 2, 2))
    tetrahedron = np.array([[0, 1, 3, len(points)]])
    more = np.vstack([points, [-1.0, -1.0, -1.0]])
    mesh = as_hex_mesh(meshio.Mesh(more, [("hexahedron", cells), ("tetra", tetrahedron)]), other_cells="keep")
    mask = np.zeros((len(more), 3), dtype=bool)
    mask[5, 1] = True
    held = fixed_components(mesh, mask)
    assert np.array_equal(np.flatnonzero(held.all(axis=1)), tetrahedron[0])
    assert np.array_equal(held[5], [False, True, False])
    assert held.sum() == 13


def test_unknown_modes_are_refused():
    with pytest.raises(hc.OptionError, match="boundary must be"):
        boundary_directions(np.zeros((4, 3)), np.array([[0, 1, 2, 3]]), "sticky")
