"""Nodes that are coupled are unfolded, and taken back, together."""

import numpy as np
from corner_problems import CUBES
from meshes.coupled import gaps, periodic_box

from hexconformal.elements import corner_scaled_jacobian, is_valid
from hexconformal.formulation import Formulation
from hexconformal.solver import AdmissibleDirections, coupled_groups
from hexconformal.untangling import folded_cells, improve_folded, pull_back, untangle, untangle_interior


def problem(amount, shape=(4, 4, 4), seed=3):
    points, cells, pairs = periodic_box(shape, amount, seed)
    groups = coupled_groups(pairs, np.tile(np.eye(3), (len(pairs), 1, 1)))
    none = np.zeros((len(points), 3, 3))
    admissible = AdmissibleDirections.from_normal_sums(none, coupled=groups)
    return 4 * points, Formulation(cells, len(points), CUBES, admissible), pairs, groups


def apart(points, start, pairs):
    return np.abs(gaps(points, pairs) - gaps(start, pairs)).max()


def test_patches_at_periodic_faces_are_unfolded_with_their_partners():
    start, formulation, pairs, _ = problem(0.42)
    assert folded_cells(formulation, start).any()
    points = start
    for iteration in untangle(formulation, start):
        points = iteration.points
        assert apart(points, start, pairs) < 1e-13
    assert not folded_cells(formulation, points).any()
    assert np.abs(points[pairs] - start[pairs]).max() > 0.01


def test_what_is_invalid_inside_is_untangled_with_partners():
    # Corners of a face twisted against each other: positive at the corners, negative in between.
    start, formulation, pairs, groups = problem(0.0)
    rng = np.random.default_rng(0)
    for _ in range(400):
        trial = start + groups.averaged(rng.uniform(-0.75, 0.75, start.shape))
        inside = ~folded_cells(formulation, trial) & ~is_valid(trial, formulation.cells)
        if inside.any():
            break
    assert inside.any()
    points = untangle_interior(formulation, trial)
    assert apart(points, trial, pairs) < 1e-13


def test_cells_that_stay_folded_are_improved_with_inner_nodes_only():
    start, formulation, pairs, _ = problem(0.42)
    points = improve_folded(formulation, start, folded_cells(formulation, start))
    np.testing.assert_array_equal(points[pairs], start[pairs])
    assert (points != start).any()


def test_nodes_are_taken_back_with_their_partners():
    start, formulation, pairs, groups = problem(0.2)
    cells = formulation.cells
    # Cells at one face are folded, those at the other stretched.
    shift = np.zeros_like(start)
    shift[pairs[12]] = [0.9, 0.0, 0.0]
    points = start + shift
    assert (corner_scaled_jacobian(points, cells) <= 0).any()
    nowhere = np.zeros(len(points), dtype=bool)
    alone = pull_back(points, start, cells, lambda _: nowhere.copy())
    assert apart(alone, start, pairs) > 0.01
    back = pull_back(points, start, cells, lambda _: nowhere.copy(), coupled=groups)
    assert is_valid(back, cells).all()
    assert apart(back, start, pairs) < 1e-14
