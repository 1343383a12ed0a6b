"""Unfolding quadratic hexahedra that are very tangled."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import hexconformal as hc
from hexconformal.mesh import boundary_quads
from hexconformal.regularization.quadratic import unfolding
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting
from hexconformal.regularization.quadratic.straight_start import straight_start
from hexconformal.regularization.quadratic.unfolding import unfold

each_number = pytest.mark.parametrize("nodes", [20, 27])


def ring(nodes, cells=(6, 3, 3)):
    """Three quarters of a ring, between radii of one and two."""
    box = hc.elevated(hc.generate.box(cells), nodes)
    x, y, z = box.points.T
    angle, radius = 1.5 * np.pi * x, 1.0 + y
    return box.replaced(np.stack([radius * np.sin(angle), radius * np.cos(angle), z], axis=1))


def wave(nodes):
    """A bar that goes up and down by more than it is thick, in steep cells."""
    box = hc.elevated(hc.generate.box((12, 3, 3)), nodes)
    x, y, z = box.points.T
    return box.replaced(np.stack([4 * x, y + 1.2 * np.sin(4 * np.pi * x), z], axis=1))


def setting_of(mesh, **options):
    return QuadraticSetting.of(mesh, hc.Options(**{"boundary": "fixed"} | options), QuadraticSchedule())


def shaken(mesh, amount, seed=0):
    """The mesh with its inner nodes of all kinds moved at random, by up to the amount."""
    moves = np.random.default_rng(seed).uniform(-amount, amount, mesh.points.shape)
    on_it = setting_of(mesh).boundary.on_it
    return mesh.replaced(np.where(on_it[:, None], mesh.points, mesh.points + moves)), on_it


def last(iterations, points):
    for iteration in iterations:
        points = iteration.points
    return points


@each_number
@pytest.mark.parametrize(("shape", "amount"), [(ring, 0.15), (wave, 0.1)])
def test_inner_nodes_that_are_shaken_very_much_are_unfolded(shape, amount, nodes):
    assert hc.quality(shape(nodes)).valid.all()
    mesh, on_it = shaken(shape(nodes), amount)
    assert hc.quality(mesh).valid.sum() < 0.5 * len(mesh.blocks[0].cells)
    result = hc.regularize(mesh, boundary="fixed")
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.min >= 0.95 * hc.quality(shape(nodes)).scaled_jacobian.min()
    assert_array_equal(result.points[on_it], mesh.points[on_it])


@each_number
def test_straight_cells_begin_where_linear_ones_are_regular(nodes):
    plain = hc.elevated(hc.generate.box((3, 3, 3)), nodes)
    mesh, on_it = shaken(plain, 0.15)
    setting = setting_of(mesh)
    start = straight_start(setting, setting.start)
    assert_array_equal(start[on_it], setting.start[on_it])
    # Nothing is bent, so that all nodes lie where the corners have them.
    assert_allclose(setting.to_user(start), plain.points, atol=1e-3)


def test_bends_of_the_boundary_go_on_inside():
    mesh, on_it = shaken(ring(27, (4, 2, 4)), 0.1)
    setting = setting_of(mesh)
    start = straight_start(setting, setting.start)
    assert setting.folded_cells(setting.start).sum() > 0.5 * len(setting.left_out)
    assert not setting.folded_cells(start).any()
    # Middles of edges along the ring are farther out than their chords.
    radii = np.linalg.norm(setting.to_user(start)[:, :2], axis=1)
    cells = mesh.blocks[0].cells
    for one, other, middle in [(0, 1, 8), (3, 2, 10), (4, 5, 12), (7, 6, 14)]:
        free = cells[~on_it[cells[:, middle]]]
        chords = setting.to_user(start)[free[:, [one, other]], :2].mean(axis=1)
        assert len(free) > 0
        assert (radii[free[:, middle]] > np.linalg.norm(chords, axis=1) + 0.01).all()


def test_what_stays_does_so_to_the_last_bit():
    mesh, on_it = shaken(ring(27, (4, 2, 4)), 0.1)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    setting = setting_of(mesh.replaced(mesh.points @ (turn * np.linalg.det(turn)).T + 10.0))
    start = straight_start(setting, setting.start)
    assert_array_equal(start[on_it], setting.start[on_it])
    assert (start[~on_it] != setting.start[~on_it]).any(axis=1).all()


def test_layers_that_are_thin_on_purpose_stay_so():
    box = hc.elevated(hc.generate.box((3, 3, 4)), 20)
    points = box.points.copy()
    heights = [0.0, 0.005, 0.01, 0.02, 0.03, 0.055, 0.08, 0.18, 0.28]
    points[:, 2] = np.interp(points[:, 2], np.linspace(0.0, 1.0, 9), heights)
    setting = setting_of(box.replaced(points))
    start = setting.to_user(straight_start(setting, setting.start))
    corners = setting.corners.cells
    thickness = [np.ptp(places[:, :, 2], axis=1) for places in (points[corners], start[corners])]
    assert (thickness[1] > 0.8 * thickness[0]).all()
    assert (thickness[1] < 1.25 * thickness[0]).all()


def test_where_few_cells_are_folded_the_others_do_not_move():
    mesh = ring(20)
    points = mesh.points.copy()
    on_it = setting_of(mesh).boundary.on_it
    node = mesh.blocks[0].cells[np.argmax((~on_it[mesh.blocks[0].cells[:, :8]]).sum(axis=1)), :8]
    node = node[~on_it[node]][0]
    points[node] += 0.45 * np.array([1.0, 1.0, 1.0])
    setting = setting_of(mesh.replaced(points))
    setting = replace(setting, schedule=replace(setting.schedule, many_folded=0.9))
    folded = setting.folded_cells(setting.start)
    assert folded.any()
    found = last(unfold(setting, setting.start), setting.start)
    assert not setting.folded_cells(found).any()
    assert (found != setting.start).any()
    others = ~setting.nodes_of(folded)
    assert_array_equal(found[others], setting.start[others])


def test_each_place_has_what_is_better_there():
    box = hc.elevated(hc.generate.box((6, 2, 2)), 20)
    middle = [np.abs(box.points - [x, 0.5, 0.5]).sum(axis=1).argmin() for x in (1 / 6, 5 / 6)]
    first, second = box.points.copy(), box.points.copy()
    first[middle[0], 0] += 0.3
    second[middle[1], 0] -= 0.3
    setting = setting_of(box.replaced(first))
    moving = setting.nodes_of(np.isin(setting.corners.cells, middle).any(axis=1))
    moving[np.abs(box.points[:, 0] - 0.5) < 0.3] = False
    there = setting.start + (second - first) / setting.unit
    assert setting.folded_cells(setting.start).sum() == setting.folded_cells(there).sum() == 8
    found = unfolding._better_places(setting, setting.start, there, moving)
    assert_allclose(setting.to_user(found), box.points, atol=1e-14)


def test_a_part_that_is_worked_on_holds_all_others():
    setting = setting_of(ring(20))
    moving = setting.nodes_of(np.arange(54) == 20)
    part = setting.within(moving)
    assert not (part.free & ~moving).any()
    assert part.free.sum() == (setting.free & moving).sum() > 0
    assert_array_equal(~part.left_out, moving[setting.mesh.blocks[0].cells].any(axis=1))
    assert len(boundary_quads(setting.corners.cells)[0]) == 90
    assert setting.within(np.ones_like(moving)) is setting


@each_number
def test_the_unit_of_length_makes_no_difference_in_powers_of_two(nodes):
    mesh, _ = shaken(ring(nodes, (6, 3, 2)), 0.15)
    run = {"boundary": "fixed", "max_iterations": 30}
    once = hc.regularize(mesh, **run)
    assert once.report.before.invalid > 10
    assert once.report.after.invalid == 0
    assert_array_equal(hc.regularize(mesh.replaced(2.0**30 * mesh.points), **run).points, 2.0**30 * once.points)


def test_cells_that_stay_invalid_are_not_taken_back_where_that_costs_another():
    box = hc.elevated(hc.generate.box((2, 1, 1), (2.0, 1.0, 1.0)), 20)
    stays, first = box.points.copy(), box.points.copy()
    stays[box.points.sum(axis=1) == 0.0] += [0.0, 3.0, 0.0]  # a corner of the first cell, far out
    first[:] = stays
    first[box.points[:, 0] == 1.0, 0] += 1.5  # the face between them, beyond the second cell
    setting = setting_of(box.replaced(first))
    points = setting.start + (stays - first) / setting.unit
    assert (~setting.valid(setting.start)).tolist() == [True, True]
    assert (~setting.valid(points)).tolist() == [True, False]
    assert_array_equal(unfolding.pulled_back(setting, points), points)
