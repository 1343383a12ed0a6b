"""The worst cells are raised step by step, as far as held nodes allow."""

from corner_problems import fixed_boundary, formulation_of

from hexconformal import generate
from hexconformal.elements.cell_measures import corner_scaled_jacobian
from hexconformal.regularization.worst_cells import raise_worst, raise_worst_patches


def test_lifting_raises_the_worst_cell_step_by_step():
    points, cells = generate.jittered(*generate.cylinder(4, 3, 6), 0.35, seed=3)
    formulation = fixed_boundary(points, cells)
    lowest = [corner_scaled_jacobian(at.points, cells).min() for at in raise_worst(formulation, points)]
    assert lowest[-1] > corner_scaled_jacobian(points, cells).min() + 0.2
    assert lowest[-1] == max(lowest)


def test_nothing_is_lifted_once_held_corners_forbid_it():
    points, cells = generate.sheared_block(4, 1.0)
    held = fixed_boundary(points, cells)
    assert list(raise_worst_patches(held, points)) == []
    assert list(raise_worst_patches(formulation_of(points, cells), points)) != []
