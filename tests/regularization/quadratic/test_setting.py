"""What of a mesh of quadratic hexahedra counts, and what of it moves."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.energy import CornerWeights
from hexconformal.generate import box
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting


def setting_of(mesh, schedule=None, **options):
    schedule = QuadraticSchedule() if schedule is None else schedule
    return QuadraticSetting.of(mesh, hc.Options(**{"boundary": "free"} | options), schedule)


def row(count=6, **options):
    """A row of cells along the first axis."""
    mesh = hc.elevated(box((count, 1, 1)), 20)
    return setting_of(mesh, **options), mesh.points[:, 0] * count


def marked(count, *cells):
    out = np.zeros(count, dtype=bool)
    out[list(cells)] = True
    return out


def test_rings_of_cells_around_nodes():
    setting, x = row()
    for rings in (0, 1, 2):
        np.testing.assert_array_equal(setting.around(x < 0.1, rings), x < rings + 1.1)


def test_nodes_that_move_with_those_around_are_around_too():
    mesh = hc.elevated(box((6, 1, 1)), 20)
    x = 6 * mesh.points[:, 0]
    first = np.flatnonzero(x < 0.1)
    last = [np.flatnonzero((x > 5.9) & (mesh.points[:, 1:] == mesh.points[k, 1:]).all(axis=1))[0] for k in first]
    setting = setting_of(mesh, couplings=np.column_stack([first, last]))
    np.testing.assert_array_equal(setting.around(x < 0.1, 0), (x < 1.1) | (x > 5.9))
    np.testing.assert_array_equal(setting.around(x < 0.1, 1), (x < 2.1) | (x > 4.9))


def test_what_is_left_out_stays_and_counts_for_nothing():
    setting, x = row()
    assert setting.free.all()
    without = setting.without(marked(6, 0)).without(marked(6, 5))
    np.testing.assert_array_equal(without.left_out, marked(6, 0, 5))
    np.testing.assert_array_equal(without.free, (x > 1.1) & (x < 4.9))
    points = setting.start.copy()
    points[x > 5.1] = points[x > 5.1][:, ::-1]  # of the last cell alone
    assert setting.count_folded(points) > 0
    assert setting.smallest_determinant(points) < 0.0
    assert without.count_folded(points) == 0
    assert without.smallest_determinant(points) == pytest.approx(setting.smallest_determinant(setting.start))
    assert np.isnan(setting.energy(points))
    assert np.isnan(without.energy(points))  # told of all cells
    np.testing.assert_array_equal(without.folded_cells(points), marked(6, 5))


def test_within_a_part_the_cells_at_it_count_and_nothing_else_moves():
    setting, x = row()
    moving = np.abs(x - 2.0) < 0.1
    part = setting.within(moving)
    np.testing.assert_array_equal(part.left_out, ~marked(6, 1, 2))
    np.testing.assert_array_equal(part.free, moving)
    assert setting.within(np.ones(len(x), dtype=bool)) is setting


def test_the_smallest_determinant_is_that_of_all_types():
    curved, (straight, cells) = hc.elevated(box((2, 2, 2)), 20), box((2, 2, 2))
    points = np.vstack([curved.points, straight + [2.0, 0.0, 0.0]])
    count, folded = len(curved.points), points.copy()
    mesh = hc.MixedMesh.of_types(points, {"hexahedron20": curved.blocks[0].cells, "hexahedron": cells + count})
    setting = setting_of(mesh)
    for centre in ([0.5, 0.5, 0.5], [2.5, 0.5, 0.5]):
        folded = setting.start.copy()
        folded[np.abs(points - centre).max(axis=1).argmin()] += 0.9 / setting.unit
        assert setting.smallest_determinant(folded) < 0.0


def test_only_nodes_off_the_boundary_and_free_of_each_other_are_inner():
    points, cells = box((4, 4, 4))
    mesh = hc.elevated((points, cells), 27)
    x = mesh.points[:, 0]
    inside = ((mesh.points > 0.01) & (mesh.points < 0.99)).all(axis=1)
    halves = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(np.int64)
    pair = [int(np.abs(mesh.points - [0.25, y, 0.5]).max(axis=1).argmin()) for y in (0.25, 0.75)]
    setting = setting_of(mesh, boundary="slide", interfaces=halves, couplings=[pair])
    expected = inside & (np.abs(x - 0.5) > 0.01)
    expected[pair] = False
    np.testing.assert_array_equal(setting.inner(setting.start), expected)


def test_evenness_has_another_weight_where_angles_count():
    mesh = hc.elevated(box((2, 2, 2)), 27)
    schedule = QuadraticSchedule(evenness=1.0, raised_evenness=3.0)
    setting = setting_of(mesh, schedule)
    for weights, evenness in ((CornerWeights(), 1.0), (CornerWeights(0.5, 1.0, 0.0), 3.0)):
        (term,) = setting.terms(weights)
        assert term.evenness == evenness


def test_a_cell_that_was_valid_and_is_not_between_its_points_is_folded():
    setting, _ = row(1)
    mesh, points = setting.mesh, setting.start.copy()
    rng = np.random.default_rng(0)
    while True:
        points = setting.start + rng.uniform(-0.2, 0.2, points.shape)
        if not setting.folded_cells(points).any() and not setting.valid(points).any():
            break
    assert setting.folds(points)[0].all()
    assert not setting.folds(points)[1].any()
    # From there on it is no loss.
    again = setting_of(mesh.replaced(setting.to_user(points)))
    assert not again.folds(again.start)[0].any()
