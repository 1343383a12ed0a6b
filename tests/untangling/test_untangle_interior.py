"""Cells that are folded inside, with sound corners."""

import sys

import numpy as np
from corner_problems import boundary_held, fixed_boundary, formulation_of
from meshes.hexahedra import INVALID_INSIDE
from meshes.linear_cells import renumberings

from hexconformal import generate
from hexconformal.elements import WEDGE, collapsed_cells, is_valid
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


def test_steps_at_an_eps_end_where_nothing_falls_any_more(monkeypatch):
    module, steps = sys.modules[untangle_interior.__module__], 0
    lbfgs = module.lbfgs

    def counted(*given, **options):
        nonlocal steps
        for iterate in lbfgs(*given, **options):
            steps += 1
            yield iterate

    monkeypatch.setattr(module, "lbfgs", counted)
    points, cells = generate.box((2, 2, 2))
    points[cells[0]] = INVALID_INSIDE
    # Along this line the node in the middle does not get far enough.
    projectors, line = boundary_held(points, cells), np.random.default_rng(4).normal(size=3)
    projectors[13] = np.outer(line, line) / (line @ line)
    assert np.array_equal(untangle_interior(formulation_of(points, cells, projectors), points), points)
    assert 0 < steps < 120  # 3600 if it never ended, 141 if every eps were tried


def test_wedges_folded_inside_are_unfolded_alike_whichever_end_comes_first():
    points, cubes = generate.box((2, 2, 2))
    points = 2 * points + np.random.default_rng(4077).uniform(-0.45, 0.45, points.shape)
    wedges = np.concatenate([cubes[:, half] for half in ([0, 4, 1, 3, 7, 2], [4, 5, 1, 7, 6, 2])])
    orders = np.random.default_rng(0).choice(np.array(renumberings(WEDGE)), len(wedges))
    results = []
    for nodes in (wedges, np.take_along_axis(wedges, orders, axis=1)):
        cells = collapsed_cells(nodes, WEDGE)
        formulation = fixed_boundary(points, cells)
        assert not folded_cells(formulation, points).any()
        assert not is_valid(points, cells).all()
        results.append(untangle_interior(formulation, points))
        assert is_valid(results[-1], cells).all()
    np.testing.assert_allclose(*results, rtol=0, atol=1e-9)
