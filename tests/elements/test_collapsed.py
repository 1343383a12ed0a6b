"""Cells of all types in one table, as collapsed hexahedra."""

import itertools

import numpy as np
import pytest
from meshes.linear_cells import TYPES, random_cells

from hexconformal.elements import (
    CORNERS,
    HEXAHEDRON,
    all_valid,
    are_collapsed,
    cell_volumes,
    collapsed_cells,
    corner_scaled_jacobian,
    corner_shape,
    edge_lengths,
    is_valid,
    measures_of,
    minimum_jacobian,
    recognized,
    rows_by_type,
    valid_cells,
)
from hexconformal.elements.cell_measures import MEASURES

each_type = pytest.mark.parametrize("cell_type", TYPES, ids=lambda one: one.name)
others = pytest.mark.parametrize("cell_type", [one for one in TYPES if one is not HEXAHEDRON], ids=lambda one: one.name)


def table_of(cell_type, x):
    """Points and the table (k, 8) of cells with nodes (k, j, 3) of their own."""
    nodes = np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
    return x.reshape(-1, 3), collapsed_cells(nodes, cell_type), nodes


def rotations():
    """The 24 orders of its nodes in which a hexahedron is the same."""
    turns = []
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            turn = np.eye(3)[list(axes)] * np.array(signs)[:, None]
            if np.linalg.det(turn) > 0:
                moved = ((CORNERS - 0.5) @ turn.T + 0.5).round().astype(int)
                turns.append([int(np.flatnonzero((place == CORNERS).all(axis=1))[0]) for place in moved])
    return turns


@each_type
def test_a_table_says_the_same_of_cells_as_their_type(cell_type):
    points, cells, nodes = table_of(cell_type, random_cells(cell_type, 300, 0.45))
    assert [one.cell_type for one in rows_by_type(cells)] == [cell_type]
    np.testing.assert_array_equal(rows_by_type(cells)[0].own_nodes(cells), nodes)
    measured = dict(zip(MEASURES, measures_of(points, nodes, cell_type), strict=True))
    valid = valid_cells(points, nodes, cell_type)
    assert 0 < valid.sum() < 300
    np.testing.assert_array_equal(is_valid(points, cells), valid)
    np.testing.assert_array_equal(minimum_jacobian(points, cells)[0] > 0, valid)
    assert all_valid(points, cells, np.flatnonzero(valid))
    assert not all_valid(points, cells)
    np.testing.assert_allclose(corner_scaled_jacobian(points, cells), measured["scaled_jacobian"], atol=1e-14)
    np.testing.assert_allclose(corner_shape(points, cells), measured["shape"], atol=1e-14)
    np.testing.assert_allclose(cell_volumes(points, cells), measured["volume"], atol=1e-14)


def test_a_table_of_all_types_says_of_each_what_a_table_of_that_alone_says():
    tables = [table_of(one, random_cells(one, 40, 0.35)) for one in TYPES]
    points, starts = np.concatenate([x for x, *_ in tables]), np.cumsum([0, *(len(x) for x, *_ in tables)])
    order = np.random.default_rng(0).permutation(40 * len(TYPES))
    cells = np.concatenate([own + start for (_, own, _), start in zip(tables, starts, strict=False)])[order]
    for measure in (is_valid, corner_scaled_jacobian, corner_shape, cell_volumes):
        alone = np.concatenate([measure(x, own) for x, own, _ in tables])
        np.testing.assert_array_equal(measure(points, cells), alone[order])
    assert not all_valid(points, cells)
    assert all_valid(points, cells, np.flatnonzero(is_valid(points, cells)))


@each_type
def test_lengths_of_edges_have_the_mean_and_the_least_of_the_edges_of_the_type(cell_type):
    points, cells, nodes = table_of(cell_type, random_cells(cell_type, 50, 0.3))
    own = np.linalg.norm(np.diff(points[nodes[:, cell_type.edges]], axis=2)[:, :, 0], axis=2)
    found = edge_lengths(points, cells)
    np.testing.assert_allclose(found.min(axis=1), own.min(axis=1), rtol=1e-14)
    np.testing.assert_allclose(found.max(axis=1), own.max(axis=1), rtol=1e-14)
    if cell_type.name == "tetra":  # all six are there as often
        np.testing.assert_allclose(found.mean(axis=1), own.mean(axis=1), rtol=0.2)


def test_types_are_told_apart_wherever_their_rows_are():
    tables = [collapsed_cells(10 * k + np.arange(len(one.nodes))[None], one) for k, one in enumerate(TYPES)]
    table = np.concatenate(tables * 2)
    found = {one.cell_type: np.arange(8)[one.rows].tolist() for one in rows_by_type(table)}
    assert found == {one: [k, k + 4] for k, one in enumerate(TYPES)}
    np.testing.assert_array_equal(are_collapsed(table), [one is not HEXAHEDRON for one in TYPES] * 2)
    with pytest.raises(ValueError, match="coinciding nodes"):
        rows_by_type(np.array([[0, 1, 2, 3, 4, 5, 6, 6]]))


@others
def test_hexahedra_are_recognized_whichever_of_their_nodes_coincide(cell_type):
    row = collapsed_cells(np.arange(len(cell_type.nodes))[None], cell_type)[0]
    turned = np.array([row[turn] for turn in rotations()])
    ((found, rows, nodes),) = recognized(turned)
    assert found is cell_type
    np.testing.assert_array_equal(np.sort(rows), np.arange(24))
    points = cell_type.ideal
    np.testing.assert_allclose(cell_volumes(points, collapsed_cells(nodes, cell_type)), cell_type.volume)


def test_what_is_no_linear_cell_is_not_recognized():
    assert recognized(np.array([[0, 1, 2, 3, 4, 5, 6, 6], [0, 1, 2, 3, 0, 1, 2, 3], [0, 1, 2, 2, 0, 4, 5, 5]])) == []
