"""Nodes that slide on faces and edges which are pieces of a parabola: where they are brought to is known."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.regularization import Options
from hexconformal.regularization.quadratic import sliding
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting

each_number = pytest.mark.parametrize("nodes", [20, 27])
BEND = 0.3


def parabola(nodes):
    """A box whose bottom and top are z = BEND x^2, and that plus one: cells of order two have them exactly.

    Nodes are numbered anyhow.
    """
    mesh = hc.elevated(hc.generate.box((3, 3, 2)), nodes)
    order = np.random.default_rng(3).permutation(len(mesh.points))
    x, y, z = flat = mesh.points[order].T
    cells = {f"hexahedron{nodes}": np.argsort(order)[mesh.blocks[0].cells]}
    return hc.MixedMesh.of_types(np.column_stack([x, y, z + BEND * x * x]), cells), flat.T


def setting_of(nodes):
    mesh, flat = parabola(nodes)
    return QuadraticSetting.of(mesh, Options(), QuadraticSchedule()), flat


def heights(points):
    return points[:, 2] - BEND * points[:, 0] ** 2


@each_number
def test_nodes_are_brought_to_the_closest_place_of_their_face_or_edge(nodes):
    setting, flat = setting_of(nodes)
    ways = np.random.default_rng(0).uniform(-0.1, 0.1, flat.shape)
    field = setting.start + setting.admissible(setting.start).project(ways)
    found, before = setting.to_user(setting.on_surface(field)), setting.to_user(field)
    sides = [(flat[:, axis] == end, axis, end) for axis in range(3) for end in (0.0, 1.0)]
    for on, axis, end in sides:
        there = found[:, axis] if axis < 2 else heights(found)
        np.testing.assert_allclose(there[on], end, rtol=0, atol=1e-12)
    count = sum(on.astype(int) for on, _, _ in sides)
    np.testing.assert_array_equal(found[count == 3], setting.mesh.points[count == 3])
    np.testing.assert_array_equal(found[count == 0], before[count == 0])
    assert (np.abs(found - setting.mesh.points).max(axis=1)[count < 3] > 0).all()
    # What is left to where they came from is normal: to the face for those on it, to the curve for those along it.
    curved = np.isin(flat[:, 2], [0.0, 1.0])
    slopes = np.column_stack([np.ones(len(found)), np.zeros(len(found)), 2 * BEND * found[:, 0]])
    along = np.isin(flat[:, 1], [0.0, 1.0])
    for some in (curved & (count == 1), curved & (count == 2) & along):
        assert some.sum() > 4
        left = before[some] - found[some]
        assert np.abs(heights(before[some]) - flat[some, 2]).max() > 1e-4
        np.testing.assert_allclose((left * slopes[some]).sum(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(found[curved & (count == 1), 1], before[curved & (count == 1), 1], atol=1e-9)


@each_number
def test_what_moves_along_one_axis_is_brought_back_too(nodes):
    setting, flat = setting_of(nodes)
    top = np.flatnonzero((flat[:, 2] == 1.0) & (np.abs(flat[:, :2] - 0.5) < 0.4).all(axis=1))
    field = setting.start.copy()
    field[top, 0] += 0.1
    np.testing.assert_allclose(heights(setting.to_user(setting.on_surface(field)))[top], 1.0, atol=1e-12)
    assert np.abs(heights(setting.to_user(field))[top] - 1.0).min() > 1e-4


@each_number
def test_what_has_not_moved_stays_to_the_last_bit(nodes):
    setting, _ = setting_of(nodes)
    np.testing.assert_array_equal(setting.on_surface(setting.start), setting.start)


@each_number
def test_nobody_slides_over_the_end(nodes):
    setting, _ = setting_of(nodes)
    parts = setting.boundary.parts
    low, high = setting.start.min(axis=0), setting.start.max(axis=0)
    for kind in setting.boundary.sliding._kinds:
        for far in (-5.0, 5.0):
            positions = kind.found(parts * (setting.start[kind.nodes] + far))[0] / parts
            assert (positions >= low - 1e-9).all()
            assert (positions <= high + 1e-9).all()


@each_number
def test_directions_are_tangents_and_none_for_what_is_held(nodes):
    setting, flat = setting_of(nodes)
    ways = np.random.default_rng(1).normal(size=flat.shape)
    free = setting.admissible(setting.start).project(ways)
    normals = np.column_stack([-2 * BEND * flat[:, 0], np.zeros(len(flat)), np.ones(len(flat))])
    curved = np.isin(flat[:, 2], [0.0, 1.0])
    np.testing.assert_allclose((free * normals)[curved].sum(axis=1), 0.0, atol=1e-12)
    count = sum((flat[:, axis] == end).astype(int) for axis in range(3) for end in (0.0, 1.0))
    moves = np.linalg.norm(free, axis=1) > 1e-9
    np.testing.assert_array_equal(moves, count < 3)
    # A plane of directions on a face, a line along a curve.
    bases = np.linalg.matrix_rank(setting.admissible(setting.start).all_projectors(len(flat)), tol=1e-9)
    np.testing.assert_array_equal(bases, 3 - count)
    held = np.flatnonzero(curved & (count == 1))[:2]
    less = setting.boundary.sliding.with_held(held).admissible(setting.start).project(ways)
    assert not less[held].any()
    np.testing.assert_array_equal(np.delete(less, held, axis=0), np.delete(free, held, axis=0))


@each_number
def test_walks_alone_tell_where_on_a_face_nodes_are(nodes, monkeypatch):
    monkeypatch.setattr(sliding, "_CORRECTIONS", 0)
    setting, _ = setting_of(nodes)
    parts = setting.boundary.parts
    for kind in setting.boundary.sliding._kinds:
        there = setting.start[kind.nodes]
        np.testing.assert_allclose(kind.found(parts * there)[0] / parts, there, atol=1e-12)
