"""Where nodes may go on cubes, cylinders and under masks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hexconformal as hc
from hexconformal import generate
from hexconformal.constraint import boundary_constraint
from hexconformal.topology import boundary_quads


def ranks(points, cells, *arguments):
    constraint = boundary_constraint(points, boundary_quads(cells)[0], *arguments)
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
    with pytest.raises(hc.MeshError, match="boundary quads with an edge of no length at nodes"):
        boundary_constraint(points, boundary_quads(cells)[0])


def test_projection_is_orthogonal_and_idempotent():
    points, cells = generate.sheared_cube(4)
    constraint = boundary_constraint(points, boundary_quads(cells)[0])
    field = np.random.default_rng(0).normal(size=points.shape)
    once = constraint.project(field)
    assert np.abs(constraint.project(once) - once).max() < 1e-15
    assert abs(np.einsum("ij,ij->", once, field - once)) < 1e-12


def test_unknown_modes_are_refused():
    with pytest.raises(hc.OptionError, match="boundary is"):
        boundary_constraint(np.zeros((4, 3)), np.array([[0, 1, 2, 3]]), "sticky")
