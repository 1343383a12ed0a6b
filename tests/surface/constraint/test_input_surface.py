"""What is measured against the input surface: cells that turned over, came to another sheet, or are too far away."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere, no_cells

from hexconformal.geometry import Faces
from surface.constraint import find_interfaces
from surface.constraint.input_surface import InputSurface
from surface.mesh import SurfaceMesh


@pytest.mark.parametrize("side", [(0, 1), (1, 0)])
def test_a_cell_over_a_ridge_is_turned_over_if_either_side_says_so(side):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0.3, -1], [0.5, -0.3, -1]])
    shape = InputSurface(points, Faces(np.array([[0, 1, 2], [1, 0, 3]]), no_cells(4)))
    assert not shape.turned_over(points).any()
    # Upright in the plane of the ridge, so that one of the two facets below is behind it, whichever way it looks.
    moved = np.array([[0.1, 0, 0.2], [0.9, 0, 0.2], [0.5, 0, 1.0], [0.5, -0.3, -1]])
    moved[:2] = moved[list(side)]
    assert shape.turned_over(moved)[0]


def test_a_cell_may_turn_over_by_itself_until_it_is_strict():
    points, cells = icosphere(2)
    shape, nobody = InputSurface(points, cells), np.zeros(len(cells), dtype=bool)
    a, b, c = cells.triangles[0]
    turned = points.copy()
    turned[a] = 1.3 * (points[b] + points[c]) - points[a]
    turned[a] /= np.linalg.norm(turned[a])
    over = shape.turned_over(turned)
    assert over[0]
    assert not shape.cells_out_of_bounds(turned, 1.0, nobody).any()
    shape.forbid_turning = True
    np.testing.assert_array_equal(shape.cells_out_of_bounds(turned, 1.0, nobody), over)
    # What is turned over already may stay so.
    shape.accept()
    assert not shape.cells_out_of_bounds(turned, 1.0, nobody).any()


def test_a_cell_may_never_come_closer_to_another_sheet_than_to_its_own():
    # A thin wall: two parallel sheets that look away from each other.
    top, cells, _ = grid(6, jitter=0.0)
    points = np.concatenate([top, top - [0, 0, 0.1]])
    both = np.concatenate([cells.triangles, cells.triangles[:, ::-1] + len(top)])
    shape, nobody = InputSurface(points, Faces(both, no_cells(4))), np.zeros(len(both), dtype=bool)
    sunk = points.copy()
    sunk[both[40]] -= [0, 0, 0.06]
    assert shape.turned_over(sunk)[40]
    assert not shape.cells_out_of_bounds(sunk, 1.0, nobody).any()
    shape.forbid_sheet_change = True
    assert shape.cells_out_of_bounds(sunk, 1.0, nobody)[40]
    sunk[both[40]] += [0, 0, 0.02]
    assert not shape.cells_out_of_bounds(sunk, 1.0, nobody).any()


def test_cells_stray_of_which_a_node_does():
    points, cells, inner = grid(4)
    shape, nobody = InputSurface(points, cells), np.ones(len(cells), dtype=bool)
    peak = int(np.flatnonzero(inner)[4])
    lifted = points + 0.066 * (np.arange(len(points)) == peak)[:, None] * [0, 0, 1]
    # Centres are a third as far away, and the input's node is nearer to the slope of the peak than to its top.
    assert np.array_equal(shape.cells_out_of_bounds(lifted, 0.06, nobody), (cells.triangles == peak).any(axis=1))
    assert not shape.cells_out_of_bounds(lifted, 0.063, nobody).any()


def test_a_line_that_moves_within_a_flat_surface_is_measured_and_marks_the_cells_beside_it():
    points, cells, _ = grid(4)
    middle = np.flatnonzero(points[:, 0] == 0.5)
    mesh = SurfaceMesh(points, cells, cell_data={"part": cells.centres(points)[:, 0] > 0.5})
    found = find_interfaces(mesh)
    assert set(found.edges.ravel()) == set(middle)
    lined, plain = InputSurface(points, cells, found), InputSurface(points, cells)
    moved, nobody = points.copy(), np.zeros(len(cells), dtype=bool)
    node = middle[np.argmin(points[middle, 1])]
    moved[node, 0] += 0.1
    # The lowest edge of the line alone is more than 0.05 away, and the cells on its two sides hold its both ends.
    beside = np.isin(cells.triangles, middle[points[middle, 1] < 0.3]).sum(axis=1) == 2
    assert beside.sum() == 2
    assert plain.hausdorff(moved) < 1e-12
    assert lined.hausdorff(moved) == pytest.approx(0.1, abs=1e-3)
    for shape, expected in ((lined, beside), (plain, nobody)):
        np.testing.assert_array_equal(shape.cells_beyond(moved, 0.05), expected)
        np.testing.assert_array_equal(shape.cells_out_of_bounds(moved, 0.05, nobody), expected)
    assert not lined.cells_beyond(moved, 0.11).any()
