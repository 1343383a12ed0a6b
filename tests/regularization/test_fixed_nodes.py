"""Nodes that are fixed, whole or in a component, and boundaries that slide."""

import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import jittered_box
from scipy.spatial.transform import Rotation

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh.topology import boundary_quads


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_what_is_held_is_bit_identical(boundary):
    points, cells = jittered_box(5)
    rng = np.random.default_rng(0)
    held = rng.random(len(points)) < 0.1
    result = hc.regularize((points + 1e3, cells), boundary=boundary, fixed=held)
    assert np.array_equal(result.points[held], (points + 1e3)[held])
    if boundary == "fixed":
        surface = np.unique(boundary_quads(cells)[0])
        assert np.array_equal(result.points[surface], (points + 1e3)[surface])
        assert result.report.boundary_moved == 0


def test_sliding_keeps_the_faces_of_a_turned_cube():
    points, cells = generate.sheared_cube(6)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    result = hc.regularize((points @ turn.T, cells), gradient_tolerance=1e-11)
    regular = generate.box((6, 6, 6))[0] @ turn.T
    assert np.abs(result.points - regular).max() < 1e-10


def test_components_can_be_held_one_by_one():
    points, cells = jittered_box(4)
    mask = np.zeros((len(points), 3), dtype=bool)
    mask[:, 2] = True
    result = hc.regularize((points, cells), boundary="fixed", fixed=mask)
    assert np.array_equal(result.points[:, 2], points[:, 2])
    assert np.abs(result.points - points).max() > 1e-3


def test_components_are_held_in_tangled_meshes_too():
    # Each node that is held in x or y is one that an unfolding start at the mean of its neighbours would move.
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.9, seed=3, valid=False)
    assert (hc.quality((points, cells)).scaled_jacobian <= 0).any()
    fixed = np.random.default_rng(0).random(points.shape) < 0.3
    moved = hc.regularize((points, cells), fixed=fixed, max_iterations=5).points
    np.testing.assert_array_equal(moved[fixed], points[fixed])
    assert (moved[~fixed] != points[~fixed]).any()


def test_a_point_array_names_the_fixed_nodes():
    points, cells = jittered_box(4)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
    grid.point_data["clamp"] = (points[:, 0] < 0.5).astype(np.int32)
    result = hc.regularize(grid, fixed="clamp")
    held = points[:, 0] < 0.5
    assert isinstance(result.mesh, pv.UnstructuredGrid)
    assert np.array_equal(np.asarray(result.mesh.points)[held], points[held])
    with pytest.raises(hc.OptionError, match="'clam' names no point array or group of the file; there are: 'clamp'"):
        hc.regularize(grid, fixed="clam")


def test_all_nodes_fixed_is_a_result():
    points, cells = jittered_box(3)
    result = hc.regularize((points, cells), fixed=np.ones(len(points), dtype=bool))
    assert np.array_equal(result.points, points)
    assert result.converged
