"""Cells that are folded inside, with sound corners."""

import numpy as np
from corner_problems import fixed_boundary

from hexconformal import generate
from hexconformal.elements import is_valid
from hexconformal.mesh.topology import boundary_quads
from hexconformal.untangling.untangle import folded_cells
from hexconformal.untangling.untangle_interior import untangle_interior


def test_a_cell_folded_inside_with_sound_corners_is_unfolded():
    points, cells = generate.box((3, 3, 3))
    points = 3 * points + np.random.default_rng(4936).uniform(-0.45, 0.45, points.shape)
    formulation = fixed_boundary(points, cells)
    assert not folded_cells(formulation, points).any()
    assert not is_valid(points, cells).all()
    better = untangle_interior(formulation, points)
    assert is_valid(better, cells).all()
    surface = np.unique(boundary_quads(cells)[0])
    assert np.array_equal(better[surface], points[surface])
    assert untangle_interior(formulation, better) is better
