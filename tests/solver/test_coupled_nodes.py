"""Coupled displacements are a linear space: projections are orthogonal, and systems are solved in it."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import formulation_of
from meshes.coupled import QUARTER, periodic_box, sector

from hexconformal.energy import Assembly, CornerWeights, Patch
from hexconformal.mesh import boundary_quads
from hexconformal.solver import (
    UNCOUPLED,
    AdmissibleDirections,
    BlockPreconditioner,
    LaplacePreconditioner,
    boundary_directions,
    coupled_groups,
    solve_blocks,
)
from hexconformal.solver.step_rounding import round_direction

EYE = np.eye(3)


def ring():
    """A sector coupled by rotation, whose flat ends are slid along, one node held, one slanted."""
    points, cells, pairs = sector((2, 3, 2), 0.2)
    groups = coupled_groups(pairs, np.tile(QUARTER, (len(pairs), 1, 1)))
    sums = np.zeros((len(points), 3, 3))
    for height in (0.0, 1.0):
        sums[points[:, 2] == height] += np.diag([0.0, 0.0, 1.0])
    sums[pairs[4, 0]] += EYE
    slanted = np.array([0.6, 0.0, 0.8])
    sums[pairs[3, 1]] += np.outer(slanted, slanted)
    return points, cells, pairs, AdmissibleDirections.from_normal_sums(sums, coupled=groups)


def box(shape=(2, 2, 2)):
    points, cells, pairs = periodic_box(shape, 0.2)
    groups = coupled_groups(pairs, np.tile(EYE, (len(pairs), 1, 1)))
    fixed = np.zeros(points.shape, dtype=bool)
    fixed[0, 1] = True
    return points, cells, pairs, AdmissibleDirections.from_normal_sums(np.zeros((len(points), 3, 3)), fixed, groups)


def narrow():
    """A box in which nodes of one cell are coupled."""
    return box((1, 2, 2))


def matrix_of(linear, count):
    """The matrix (3 n, 3 n) of a map of fields."""
    return np.column_stack([linear(e.reshape(count, 3)).ravel() for e in np.eye(3 * count)])


@pytest.mark.parametrize("problem", [ring, box])
def test_the_projection_is_orthogonal_and_its_image_is_what_was_asked_for(problem):
    points, _, pairs, admissible = problem()
    p = matrix_of(admissible.project, len(points))
    np.testing.assert_allclose(p, p.T, atol=1e-14)
    np.testing.assert_allclose(p @ p, p, atol=1e-14)
    # The space by its equations: d_first = R d_second, and n d = 0.
    turn = QUARTER if problem is ring else EYE
    rows = []
    for first, second in pairs:
        for k in range(3):
            row = np.zeros((len(points), 3))
            row[first, k] += 1.0
            row[second] -= turn[k]
            rows.append(row.ravel())
    projectors = admissible.all_projectors(len(points))
    for node in range(len(points)):
        for normal in EYE - projectors[node]:
            row = np.zeros((len(points), 3))
            row[node] = normal
            rows.append(row.ravel())
    expected = np.eye(p.shape[0]) - np.linalg.pinv(np.array(rows), 1e-9) @ np.array(rows)
    np.testing.assert_allclose(p, expected, atol=1e-12)
    np.testing.assert_array_equal(admissible.free(len(points)), projectors.any(axis=(1, 2)))


def test_what_one_of_a_group_may_not_do_none_may():
    _, _, pairs, admissible = ring()
    projectors = admissible.all_projectors(int(pairs.max()) + 1)
    assert not projectors[pairs[4]].any()
    for first, second in pairs:
        np.testing.assert_allclose(projectors[first], QUARTER @ projectors[second] @ QUARTER.T, atol=1e-15)
    normal = QUARTER @ [0.6, 0.0, 0.8]
    np.testing.assert_allclose(EYE - projectors[pairs[3, 0]], np.outer(normal, normal), atol=1e-15)


def test_groups_chain_pairs_in_several_directions():
    points, _, _, admissible = box()
    groups = admissible.coupled
    sizes = np.diff(np.append(groups.starts, len(groups.nodes)))
    assert sorted(sizes) == [2] * 3 + [4] * 3 + [8]
    field = np.random.default_rng(0).normal(size=points.shape)
    together = groups.averaged(field)
    corners = ((points[:, None] - points[groups.nodes[groups.starts[sizes == 8]]]).round(9) % 1.0 == 0.0).all(axis=2)
    np.testing.assert_allclose(together[corners[:, 0]], np.tile(field[corners[:, 0]].mean(axis=0), (8, 1)))


def test_a_cycle_that_turns_holds_what_it_turns():
    # Three nodes in a ring of quarter turns about z: what comes back is turned by three quarters.
    groups = coupled_groups(np.array([[0, 1], [1, 2], [2, 0]]), np.tile(QUARTER, (3, 1, 1)))
    admissible = AdmissibleDirections.from_normal_sums(np.zeros((3, 3, 3)), coupled=groups)
    np.testing.assert_array_equal(admissible.all_projectors(3), np.tile(np.diag([0.0, 0.0, 1.0]), (3, 1, 1)))
    # Four of them close.
    groups = coupled_groups(np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), np.tile(QUARTER, (4, 1, 1)))
    assert not groups.normals.any()


@pytest.mark.parametrize("problem", [ring, box, narrow])
def test_blocks_are_solved_in_the_coupled_space(problem):
    points, cells, _, admissible = problem()
    count = len(points)
    formulation = formulation_of(points, cells)
    objective = formulation.objective(CornerWeights())
    free = admissible.free(count)
    assembly = Assembly.of_cells(cells, free, diagonals=True)
    _, gradient, _ = objective.convex(points, assembly)
    projectors, groups = admissible.all_projectors(count), admissible.coupled
    matrix = assembly.matrix
    full = np.zeros((count, 3, count, 3))
    for i in range(count):
        for k in range(matrix.indptr[i], matrix.indptr[i + 1]):
            j = matrix.indices[k]
            full[i, :, j] = matrix.data[k]
            full[j, :, i] = matrix.data[k].T
    full = full.reshape(3 * count, -1)
    condensed = groups.condensed(matrix)
    spread = matrix_of(groups.spread, count)
    np.testing.assert_allclose(matrix_of(groups.gathered, count), spread.T, atol=1e-15)
    left = spread.T @ full @ spread
    of_rows = [
        (i, condensed.indices[k], condensed.data[k]) for i in range(count) for k in range(*condensed.indptr[i : i + 2])
    ]
    for i, j, block in of_rows:
        np.testing.assert_allclose(left[3 * i : 3 * i + 3, 3 * j : 3 * j + 3], block, atol=1e-10)
    p = matrix_of(admissible.project, count)
    solution = solve_blocks(matrix, -gradient, projectors, 1e-13, 2000, 0.0, coupled=groups)
    expected = -np.linalg.pinv(p @ full @ p, 1e-10) @ (p @ gradient.ravel())
    # What is not determined (the mesh as a whole, periodic) has no force on it.
    np.testing.assert_allclose(p @ full @ (solution.ravel() - expected), 0.0, atol=1e-8 * np.abs(gradient).max())
    np.testing.assert_allclose(admissible.project(solution), solution, atol=1e-14 * np.abs(solution).max())


@pytest.mark.parametrize("problem", [ring, box])
def test_preconditioners_are_definite_in_the_coupled_space(problem):
    points, cells, _, admissible = problem()
    count = len(points)
    formulation = formulation_of(points, cells)
    assembly = Assembly.of_cells(cells, admissible.free(count))
    formulation.objective(CornerWeights()).convex(points, assembly)
    laplacian = _laplacian(cells, count)
    p = matrix_of(admissible.project, count)
    rank = round(np.trace(p))
    blocks = BlockPreconditioner(assembly.matrix, admissible.all_projectors(count), 1e-3, admissible.coupled)
    for way in (blocks, LaplacePreconditioner(laplacian, admissible, np.ones(count, dtype=bool))):
        m = p @ matrix_of(lambda field, way=way: way(admissible.project(field)), count)
        np.testing.assert_allclose(m, m.T, atol=1e-5 * np.abs(m).max())
        values = np.linalg.eigvalsh((m + m.T) / 2)
        assert (values[-rank:] > 1e-9 * values[-1]).all()
        assert np.abs(values[:-rank]).max() < 1e-5 * values[-1]


def test_the_hierarchy_of_a_large_periodic_mesh_solves_for_coupled_fields():
    points, cells, pairs = periodic_box((9, 9, 9), 0.1)
    groups = coupled_groups(pairs, np.tile(EYE, (len(pairs), 1, 1)))
    admissible = AdmissibleDirections.from_normal_sums(np.zeros((len(points), 3, 3)), coupled=groups)
    laplacian = _laplacian(cells, len(points))
    way = LaplacePreconditioner(laplacian, admissible, np.ones(len(points), dtype=bool))
    load = groups.averaged(np.random.default_rng(0).normal(size=points.shape))
    load -= load.mean(axis=0)
    found = np.zeros_like(load)
    for _ in range(25):
        residual = load - groups.averaged(8.0 * (laplacian @ found))
        found += way(residual)
    residual -= residual.mean(axis=0)
    assert np.abs(residual).max() < 1e-3 * np.abs(load).max()
    np.testing.assert_array_equal(found[pairs[:, 0]], found[pairs[:, 1]])


def _laplacian(cells, count):
    from hexconformal.energy import DistortionTerm

    return DistortionTerm(cells, count).laplacian()


def test_a_patch_keeps_groups_that_move_as_a_whole_and_holds_others():
    points, cells, pairs, admissible = ring()
    count = len(points)
    moving = np.zeros(count, dtype=bool)
    moving[pairs[0]] = True
    moving[pairs[1, 0]] = True
    patch = Patch.around(moving, cells, points)
    part = admissible.restricted(patch)
    local = patch.local
    np.testing.assert_array_equal(np.sort(part.coupled.nodes), np.sort(local[pairs[0]]))
    assert not part.all_projectors(len(patch.nodes))[local[pairs[1, 0]]].any()
    closed = admissible.coupled.closed(moving)
    assert closed[pairs[1]].all()
    assert closed.sum() == 4


def test_a_formulation_moves_partners_of_the_nodes_of_a_patch():
    points, cells, pairs, admissible = ring()
    formulation = replace(formulation_of(points, cells), admissible=admissible)
    moving = np.zeros(len(points), dtype=bool)
    moving[pairs[0, 0]] = True
    part, nodes = formulation.restricted(moving, points)
    np.testing.assert_array_equal(nodes[part.free], np.sort(pairs[0]))
    assert not formulation.inner[pairs].any()
    held = formulation.without(np.arange(len(cells)) == 0).admissible
    some = cells[0][np.isin(cells[0], pairs)]
    both = np.unique(pairs[np.isin(pairs, some).any(axis=1)])
    assert not held.free(len(points))[both].any()


def test_without_groups_everything_is_as_it_was():
    points, cells, _, _ = box()
    directions = boundary_directions(points, boundary_quads(cells)[0])
    assert directions.coupled is UNCOUPLED
    field = np.ones((5, 3))
    for same in (UNCOUPLED.gathered, UNCOUPLED.spread, UNCOUPLED.averaged):
        assert same(field) is field
    assert UNCOUPLED.together(field, 2 * field) is field
    matrix = Assembly.of_cells(cells, np.ones(len(points), dtype=bool)).matrix
    assert UNCOUPLED.condensed(matrix) is matrix


def test_partners_are_rounded_alike():
    points, cells, pairs = periodic_box((3, 3, 3), 0.2)
    groups = coupled_groups(pairs, np.tile(EYE, (len(pairs), 1, 1)))
    direction = groups.averaged(np.random.default_rng(0).normal(size=points.shape))
    rounded = round_direction(direction, points, cells, 2.0**-4, groups)
    np.testing.assert_array_equal(rounded[pairs[:, 0]], rounded[pairs[:, 1]])
    np.testing.assert_array_equal(groups.averaged(rounded), rounded)
    alone = round_direction(direction, points, cells, 2.0**-4)
    assert (alone[pairs[:, 0]] != alone[pairs[:, 1]]).any()


def test_what_has_drifted_apart_is_put_together_and_what_stayed_stays():
    points, _, pairs = sector((2, 3, 2), 0.2)
    groups = coupled_groups(pairs, np.tile(QUARTER, (len(pairs), 1, 1)))
    rng = np.random.default_rng(0)
    moved = points + groups.averaged(0.1 * rng.normal(size=points.shape)) + 1e-9 * rng.normal(size=points.shape)
    moved[pairs[0]] = points[pairs[0]]
    together = groups.together(moved, points)
    change = together - points
    np.testing.assert_allclose(change[pairs[:, 0]], change[pairs[:, 1]] @ QUARTER.T, atol=1e-15)
    np.testing.assert_array_equal(together[pairs[0]], points[pairs[0]])
    np.testing.assert_allclose(together, moved, atol=1e-8)
    others = np.setdiff1d(np.arange(len(points)), pairs)
    np.testing.assert_array_equal(together[others], moved[others])


def test_partners_agree_on_what_is_a_plane_where_rounding_decides():
    count = 200
    pairs = np.arange(2 * count).reshape(-1, 2)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    groups = coupled_groups(pairs, np.tile(turn, (count, 1, 1)))
    sums = np.zeros((2 * count, 3, 3))
    # Two normals of which it is open whether they are one.
    for k, angle in enumerate(2e-6 * (1.0 + 1e-4 * np.linspace(-1.0, 1.0, count))):
        for normal in (EYE[0], np.cos(angle) * EYE[0] + np.sin(angle) * EYE[1]):
            sums[pairs[k, 0]] += np.outer(normal, normal)
    projectors = AdmissibleDirections.from_normal_sums(sums, coupled=groups).all_projectors(2 * count)
    ranks = np.trace(projectors, axis1=1, axis2=2).round()
    assert set(ranks) == {1.0, 2.0}
    turned = turn @ projectors[pairs[:, 1]] @ turn.T
    np.testing.assert_allclose(projectors[pairs[:, 0]], turned, atol=1e-9)


def test_coupled_nodes_inside_are_not_moved_one_by_one():
    points, cells, _ = periodic_box((3, 3, 3), 0.1)
    inside = np.flatnonzero(formulation_of(points, cells).inner)
    groups = coupled_groups(inside[None, :2], EYE[None])
    admissible = AdmissibleDirections(np.empty(0, np.int64), np.empty((0, 3, 3)), groups)
    coupled = replace(formulation_of(points, cells), admissible=admissible)
    np.testing.assert_array_equal(np.flatnonzero(coupled.inner), inside[2:])
