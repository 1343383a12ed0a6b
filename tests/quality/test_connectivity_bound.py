"""What the smallest scaled Jacobian around a node inside cannot exceed, beside what can be reached there."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

import hexconformal as hc
from hexconformal.generate import ball, box, cylinder
from hexconformal.mesh import boundary_quads
from hexconformal.quality import connectivity_bound, connectivity_bounds, scaled_jacobian_around_a_node


def determinants(directions, triangles):
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return np.linalg.det(unit[triangles])


def best(start, triangles):
    """The largest smallest determinant of unit edges, one of each cell, that is found from a start."""
    size = start.size

    def constraints(x):
        return determinants(x[:size].reshape(-1, 3), triangles) - x[-1]

    first = np.append(start.ravel(), determinants(start, triangles).min())
    found = minimize(
        lambda x: -x[-1], first, method="SLSQP", constraints={"type": "ineq", "fun": constraints},
        options={"maxiter": 300, "ftol": 1e-12},
    )  # fmt: skip
    return determinants(found.x[:size].reshape(-1, 3), triangles).min()


@pytest.mark.parametrize("count", [4, 6, 8, 10, 12, 14, 20])
def test_no_node_that_can_be_found_exceeds_the_bound(count):
    # Seen from a node its cells are triangles of a sphere: those of convex hulls of points on it.
    rng, reached = np.random.default_rng(count), 0.0
    for _ in range(12):
        directions = rng.normal(size=(count // 2 + 2, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        triangles = ConvexHull(directions).simplices
        flipped = np.linalg.det(directions[triangles]) < 0.0
        triangles[flipped] = triangles[flipped][:, ::-1]
        reached = max(reached, best(directions, triangles))
    bound = scaled_jacobian_around_a_node(count)
    assert reached <= bound + 1e-9
    if count in (4, 6, 8, 10):
        assert reached == pytest.approx(bound, abs=1e-6)


@pytest.mark.parametrize("count", [4, 6, 12, 16])
def test_a_corner_with_its_share_of_the_solid_angle_has_no_larger_determinant(count):
    edges = np.random.default_rng(0).normal(size=(400_000, 3, 3))
    edges /= np.linalg.norm(edges, axis=2, keepdims=True)
    sizes = np.abs(np.linalg.det(edges))
    angles = 2.0 * np.arctan2(sizes, 1.0 + sum((edges[:, i] * edges[:, i - 1]).sum(axis=1) for i in range(3)))
    share = 4.0 * np.pi / count
    there = angles >= share if count < 8 else angles <= share
    cosine = np.cos((share + np.pi) / 3.0) / (1.0 - np.cos((share + np.pi) / 3.0))
    regular = np.linalg.det(np.full((3, 3), cosine) + (1.0 - cosine) * np.eye(3)) ** 0.5
    assert 0.97 * regular < sizes[there].max() <= regular
    assert scaled_jacobian_around_a_node(count) <= regular + 1e-12


def on_boundary(points, cells):
    out = np.zeros(len(points), dtype=bool)
    out[boundary_quads(cells)[0]] = True
    return out


def test_the_fewest_cells_at_a_node_inside_count():
    points, cells = ball(2, 2)
    bound, node, count = connectivity_bound(cells, on_boundary(points, cells))
    assert (bound, count) == (scaled_jacobian_around_a_node(4), 4)
    assert (cells == node).sum() == 4
    points, cells = cylinder(2, 2, 3)
    assert connectivity_bound(cells, on_boundary(points, cells))[::2] == (pytest.approx(np.sqrt(0.75)), 6)


def test_every_cell_has_the_least_bound_of_its_nodes():
    points, cells = ball(2, 2)
    boundary = on_boundary(points, cells)
    counts = np.bincount(cells.ravel())
    of_nodes = [
        1.0 if at else scaled_jacobian_around_a_node(k) for at, k in zip(boundary, counts.tolist(), strict=True)
    ]
    assert np.array_equal(connectivity_bounds(cells, boundary), np.array(of_nodes)[cells].min(axis=1))
    assert (connectivity_bounds(cells, boundary) < 1.0).any()


def test_nodes_of_the_boundary_and_of_other_cells_say_nothing():
    points, cells = box((1, 1, 1))
    assert connectivity_bound(cells, on_boundary(points, cells)) == (1.0, None, 0)
    points, cells = ball(2, 2)
    inside = on_boundary(points, cells)
    wedges = cells[(cells == connectivity_bound(cells, inside)[1]).any(axis=1)].copy()
    wedges[:, [3, 7]] = wedges[:, [2, 6]]
    other = np.concatenate([cells, wedges])
    assert connectivity_bound(other, inside)[1] not in wedges


def test_two_bodies_that_share_a_node_have_no_such_bound():
    points, cells = box((2, 2, 2))
    other = cells + len(points)
    other[other == len(points) + 13] = 13  # the node in the middle
    report = hc.regularize((np.concatenate([points, points + 5.0]), np.concatenate([cells, other])), max_iterations=0)
    assert not [one for one in report.report.notes if "smallest scaled Jacobian" in one]
    both = np.concatenate([points, 2.0 * points - 0.5])  # the other is twice as large around the same middle
    report = hc.regularize((both, np.concatenate([cells, other]))).report
    assert report.after.scaled_jacobian.min == pytest.approx(1.0)
    assert not [one for one in report.notes if "smallest scaled Jacobian" in one]


def test_a_run_says_where_nothing_better_can_be():
    points, cells = ball(3, 2)
    shaken = hc.generate.jittered(points, cells, 0.1)
    report = hc.regularize(shaken).report
    (note,) = [one for one in report.notes if "smallest scaled Jacobian" in one]
    bound = scaled_jacobian_around_a_node(4)
    assert bound * 0.998 < report.after.scaled_jacobian.min <= bound
    assert f"cannot exceed {bound:.4f}, as 4 hexahedra meet at node" in note
    node = int(note.rpartition(" ")[2])
    assert (cells == node).sum() == 4
    left = hc.regularize(shaken, max_iterations=1).report
    assert not [one for one in left.notes if "smallest scaled Jacobian" in one]


def test_what_is_told_is_of_the_mesh_that_is_returned(monkeypatch):
    run = hc.Regularization(hc.generate.jittered(*ball(3, 2), 0.1))
    list(run)
    monkeypatch.setattr(run, "_final_points", lambda: (run._normalized.points, []))
    report = run.result().report
    assert report.after.scaled_jacobian.min < 0.7
    assert report.energy_after == report.energy_before
    assert not [one for one in report.notes if "smallest scaled Jacobian" in one]
