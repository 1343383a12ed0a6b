"""Tangled meshes are unfolded: by the barrier at corners, from a harmonic start, patch by patch, from farther away."""

import numpy as np
import pytest
from corner_problems import fixed_boundary, formulation_of

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import corner_scaled_jacobian
from hexconformal.mesh.topology import boundary_quads
from hexconformal.untangling import pull_back
from hexconformal.untangling.untangle import _unfold_patches, folded_cells, harmonic, untangle


def test_untangling_unfolds_every_cell():
    points, cells = generate.jittered(*generate.box((6, 6, 6)), 1.0, seed=0, valid=False)
    formulation = fixed_boundary(points, cells)
    assert folded_cells(formulation, points).sum() > 50
    *_, last = untangle(formulation, points)
    assert not folded_cells(formulation, last.points).any()


def test_points_are_brought_back_only_where_the_worst_is_worse_and_to_the_start_where_nothing_else_is_near():
    start, cells = generate.jittered(*generate.box((4, 4, 4)), 1.0, seed=0, valid=False)
    straight = generate.box((4, 4, 4))[0]
    worse = straight.copy()
    worse[62] += [0.6, 0.0, 0.0]  # an inner node past its neighbours
    assert corner_scaled_jacobian(worse, cells).min() < corner_scaled_jacobian(start, cells).min() < 0.0
    nowhere, everywhere = np.zeros(len(start), dtype=bool), np.ones(len(start), dtype=bool)
    assert pull_back(straight, start, cells, lambda _: nowhere.copy()) is straight
    assert pull_back(worse, start, cells, lambda _: everywhere.copy()) is start
    back = corner_scaled_jacobian(pull_back(worse, start, cells, lambda _: nowhere.copy()), cells)
    assert back.min() >= corner_scaled_jacobian(start, cells).min()
    assert back.mean() > corner_scaled_jacobian(start, cells).mean() + 0.1
    away = straight.copy()
    away[0] = 0.9  # a corner through the box: no worse, but too far from the surface
    near = pull_back(away, start, cells, lambda x: (np.arange(len(x)) == 0) & (np.linalg.norm(x[0]) >= 0.5))
    assert np.linalg.norm(near[0]) < 0.5
    assert (corner_scaled_jacobian(near, cells) <= 0).sum() < 5


def test_the_harmonic_start_puts_inner_nodes_between_their_neighbours():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.5, seed=0, valid=False)
    formulation = fixed_boundary(points, cells)
    smooth = harmonic(formulation, points, np.ones(len(points), dtype=bool))
    assert np.abs(smooth - generate.box((4, 4, 4))[0]).max() < 5e-3
    surface = np.unique(boundary_quads(cells)[0])
    assert np.array_equal(smooth[surface], points[surface])


class Wall:
    """A surface that one node has to stay near to."""

    def __init__(self, node, place):
        self.node, self.place = node, place

    def relative_distance(self, points):
        return 2.0 * np.linalg.norm(points[self.node] - self.place)

    def restricted(self, patch):
        """As a patch that does not watch what is around it."""
        return


def test_patches_that_leave_the_surface_are_not_unfolded_and_the_others_are():
    points, cells = generate.box((3, 3, 3))
    tangled = 3 * points
    corners = [int(np.argmin(points.sum(axis=1))), int(np.argmax(points.sum(axis=1)))]
    tangled[corners[0]] += 1.8
    tangled[corners[1]] -= 1.8
    cores = [np.arange(len(points)) == corner for corner in corners]
    for node, opened in (None, [True, True]), (corners[0], [False, True]), (corners[1], [True, False]):
        surface = None if node is None else Wall(node, tangled[node])
        formulation = formulation_of(points, cells, barrier=surface)
        found = _unfold_patches(formulation, tangled, tangled, cores)
        still = folded_cells(formulation, found)
        assert [not still[(cells == corner).any(axis=1)].any() for corner in corners] == opened


def test_nothing_is_said_of_others_around_cells_that_cannot_move():
    points, cells = generate.jittered(*generate.ball(3, 2), amount=1.0, seed=1, valid=False)
    notes = hc.regularize((points, cells), fixed=range(len(points))).report.notes
    assert [note for note in notes if note.startswith("cells that stay folded")]
    assert not [note for note in notes if "others stay inverted" in note]


def rough_and_tangled(mesh, seed):
    """A tangled mesh with a rough surface."""
    points, cells = generate.jittered(*mesh, 2.2, seed=seed, valid=False)
    edge = np.linalg.norm(np.diff(mesh[0][cells[:, :2]], axis=1), axis=2).mean()
    return points + 0.2 * edge * np.random.default_rng(seed).normal(size=points.shape), cells


@pytest.mark.long
@pytest.mark.parametrize(("mesh", "seed"), [(generate.box((4, 4, 4)), 17), (generate.cylinder(3, 2, 3), 33)])
def test_what_does_not_unfold_within_the_bound_is_unfolded_from_farther_away(mesh, seed):
    result = hc.regularize(rough_and_tangled(mesh, seed), hausdorff=0.02)
    assert {"untangle with more room", "return to the surface"} <= {record.phase for record in result.history}
    assert result.report.before.inverted > 50
    assert result.report.after.inverted == result.report.after.invalid == 0
    assert 0.0 < result.report.hausdorff <= 0.02


@pytest.mark.long
def test_where_the_bound_is_too_narrow_the_report_tells_how_much_would_do():
    points, cells = rough_and_tangled(generate.box((4, 4, 4)), 17)
    result = hc.regularize((points, cells), hausdorff=0.005)
    report = result.report
    assert 0 < report.after.inverted < 0.5 * report.before.inverted
    assert report.hausdorff <= 0.005
    assert report.after.scaled_jacobian.min >= report.before.scaled_jacobian.min
    (note,) = [note for note in report.notes if "allow more" in note]
    needed = float(note.split("up to ")[1].split()[0])
    assert 0.005 < needed < 0.03
    assert hc.regularize((points, cells), hausdorff=1.5 * needed).report.after.invalid == 0


@pytest.mark.parametrize(("seed", "fixed"), [(0, None), (4, None), (4, [7])])
def test_a_mesh_that_nothing_holds_is_unfolded_and_keeps_its_size(seed, fixed):
    straight, cells = generate.box((5, 5, 5))
    points = straight + 0.12 * np.random.default_rng(seed).normal(size=straight.shape)
    points = np.vstack([points, [50.0, 0.0, 0.0]])  # in no cell

    def mean_edge(x):
        return np.linalg.norm(x[cells[:, [1, 3, 4]]] - x[cells[:, :1]], axis=2).mean()

    result = hc.regularize((points, cells), boundary="free", fixed=fixed)
    assert result.report.before.invalid > 100
    assert result.report.after.invalid == 0
    assert 0.5 < mean_edge(result.points) / mean_edge(points) < 1.5
    np.testing.assert_array_equal(result.points[[-1, *(fixed or ())]], points[[-1, *(fixed or ())]])
