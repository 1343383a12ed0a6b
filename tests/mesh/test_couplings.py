"""Couplings are found: rigid maps of given pairs, and parts at the same place."""

import numpy as np
import pytest
from meshes.coupled import QUARTER, facing, grid_index, periodic_box, sector, unmerged

from hexconformal import generate
from hexconformal.mesh import HexMesh, find_couplings
from hexconformal.mesh.couplings.rigid_maps import affine_map, one_map, several_maps

TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TURN *= np.linalg.det(TURN)


def test_translations_are_exactly_the_identity():
    points, cells, pairs = periodic_box((3, 4, 5), 0.2)
    found = find_couplings(HexMesh(1e3 * points + 7.0, cells), pairs)
    np.testing.assert_array_equal(found.rotations, np.tile(np.eye(3), (len(pairs), 1, 1)))
    np.testing.assert_array_equal(found.pairs, pairs)
    assert found.misfit < 1e-14
    assert found.counts == {"given": len(pairs)}


def test_edges_and_corners_that_are_given_directly_are_translations_too():
    shape = (3, 3, 3)
    points, cells, pairs = periodic_box(shape, 0.1)
    index = grid_index(generate.box(shape)[0], shape)
    look = {tuple(i): k for k, i in enumerate(index)}
    more = [(look[3, 3, 3], look[0, 0, 0]), (look[3, 3, 1], look[0, 0, 1]), (look[0, 3, 1], look[3, 0, 1])]
    found = find_couplings(HexMesh(points, cells), [*pairs.tolist(), *more])
    assert len(found.pairs) == len(pairs) + 3
    np.testing.assert_array_equal(found.rotations, np.tile(np.eye(3), (len(found.pairs), 1, 1)))


@pytest.mark.parametrize("flat", [False, True])
def test_a_sector_is_one_rotation(flat):
    points, cells, pairs = sector((3, 4, 5), 0.2, flat=flat)
    found = find_couplings(HexMesh(points, cells), pairs)
    np.testing.assert_array_equal(found.rotations, np.tile(QUARTER, (len(pairs), 1, 1)))


def test_a_sector_that_repeats_along_its_axis_has_a_rotation_and_a_translation():
    shape = (3, 4, 5)
    points, cells = generate.box(shape)
    index = grid_index(points, shape)
    u = points / points.max(axis=0)
    angle, radius = np.pi / 2 * u[:, 1], 1.0 + u[:, 0]
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), u[:, 2]])
    around, along = facing(index, 1, 4, 0), facing(index, 2, 5, 0)
    found = find_couplings(HexMesh(points, cells), np.concatenate([around, along]))
    np.testing.assert_allclose(found.rotations[: len(around)], np.tile(QUARTER, (len(around), 1, 1)), atol=1e-12)
    np.testing.assert_array_equal(found.rotations[len(around) :], np.tile(np.eye(3), (len(along), 1, 1)))


def test_any_rigid_map_is_found():
    first = np.random.default_rng(0).normal(size=(20, 3))
    maps = one_map(first @ TURN.T + [3.0, -1.0, 2.0], first, 1e-9)
    np.testing.assert_allclose(maps.rotations, np.tile(TURN, (20, 1, 1)), atol=1e-14)
    assert maps.misfits.max() < 1e-14
    assert np.linalg.det(one_map(first * [1.0, 1.0, -1.0], first, 1e-9).rotations[0]) == pytest.approx(1.0)


def test_points_on_a_line_leave_a_rotation_open_and_have_a_misfit():
    line = np.column_stack([np.arange(5.0), np.zeros((5, 2))])
    maps = one_map(line[:, [1, 0, 2]], line, 1e-9)
    assert maps.misfits.max() > 1.0
    np.testing.assert_array_equal(maps.rotations[0], np.eye(3))


def test_an_affine_map_is_taken_where_it_is_rigid_and_fits():
    second = np.random.default_rng(1).normal(size=(9, 3))
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = TURN, [1.0, 2.0, 3.0]
    first = second @ TURN.T + affine[:3, 3]
    np.testing.assert_allclose(affine_map(first, second, affine, 1e-9).rotations[0], TURN, atol=1e-14)
    assert affine_map(first + 1e-6, second, affine, 1e-9) is None
    stretched = affine @ np.diag([2.0, 1.0, 1.0, 1.0])
    assert affine_map(second @ stretched[:3, :3].T + affine[:3, 3], second, stretched, 1e-9) is None
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(affine_map(second * [-1, 1, 1], second, mirror, 1e-9).rotations[0], mirror[:3, :3])


def test_pairs_in_disorder_have_a_misfit():
    points, _, pairs = periodic_box((3, 3, 3), 0.1)
    wrong = pairs.copy()
    wrong[:, 1] = np.random.default_rng(0).permutation(wrong[:, 1])
    maps = several_maps(points[wrong[:, 0]], points[wrong[:, 1]], 1e-6)
    assert maps.misfits.max() > 0.1


def test_nodes_of_different_parts_at_the_same_place_are_coupled():
    points, cells = generate.box((4, 2, 2))
    apart, own, pairs = unmerged(points, cells, points[cells].mean(axis=1)[:, 0] > 0.5)
    apart = apart + 1e-13 * np.random.default_rng(0).uniform(-1, 1, apart.shape)
    found = find_couplings(HexMesh(apart, own))
    assert {frozenset(pair) for pair in found.pairs.tolist()} == {frozenset(pair) for pair in pairs.tolist()}
    assert found.notes == ("couplings: 9 pairs of nodes move together (at the same place in different parts)",)
    assert find_couplings(HexMesh(apart, own), "ignore").notes == ()
    # A millionth of the size apart they are others.
    apart[pairs[:2, 0]] += 1e-6
    assert len(find_couplings(HexMesh(apart, own)).pairs) == 7


def test_lips_of_a_slit_in_one_of_several_parts_are_not_coupled():
    points, cells = generate.box((4, 2, 1))
    slit = (points[:, 0] == 0.5) & (points[:, 1] == 0.0)
    copies = np.where(slit, len(points) + np.cumsum(slit) - 1, np.arange(len(points)))
    beyond = points[cells].mean(axis=1)[:, 0] > 0.5
    cells = np.where(beyond[:, None], copies[cells], cells)
    points = np.concatenate([points, points[slit]])
    far, own = generate.box((1, 1, 1), origin=(5.0, 0.0, 0.0))
    mesh = HexMesh(np.concatenate([points, far]), np.concatenate([cells, own + len(points)]))
    assert len(np.unique(points, axis=0)) < len(points)
    assert len(find_couplings(mesh).pairs) == 0


def test_three_parts_at_one_place_are_one_group():
    points, cells = generate.box((2, 2, 1))
    apart = points[cells].reshape(-1, 3)
    found = find_couplings(HexMesh(apart, np.arange(32).reshape(4, 8)))
    assert len(found.pairs) == 32 - len(points)


def test_nodes_without_hexahedra_are_coupled_to_none():
    points, cells, pairs = periodic_box((2, 2, 2), 0.1)
    points = np.concatenate([points, [[9.0, 9.0, 9.0]]])
    found = find_couplings(HexMesh(points, cells), [*pairs.tolist(), [len(points) - 1, 0]])
    assert len(found.pairs) == len(pairs)
