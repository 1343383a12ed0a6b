"""Crack fronts: the ends of slits are edges, however closed; folded quads are not."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import WEDGE, collapsed_cells
from hexconformal.geometry import edge_table, find_features, hausdorff, kept_edges
from hexconformal.geometry.features.crack_fronts import crack_fronts
from hexconformal.mesh.topology import boundary_quads


def slit(points, cells, depth=0.5):
    """A mesh of the unit cube with a slit from x = 0 to x = depth at half its height; its front comes with it."""
    lips = np.flatnonzero(np.isclose(points[:, 2], 0.5) & (points[:, 0] < depth - 1e-9))
    twins = np.arange(len(points))
    twins[lips] = len(points) + np.arange(len(lips))
    upper = points[cells].mean(axis=1)[:, 2] > 0.5
    front = np.flatnonzero(np.isclose(points[:, 2], 0.5) & np.isclose(points[:, 0], depth))
    return np.concatenate([points, points[lips]]), np.where(upper[:, None], twins[cells], cells), front


def graded(jitter=0.0):
    """A cube with a slit whose front would move by a tenth if it could slide in the plane of the slit."""
    points, cells = generate.box((6, 4, 4))
    shift = np.random.default_rng(0).uniform(-jitter, jitter, points.shape)
    shift[((points < 1e-9) | (points > 1 - 1e-9)).any(axis=1)] = 0.0
    shift[np.isclose(points[:, 2], 0.5), 2] = shift[np.isclose(points[:, 0], 0.5), 0] = 0.0
    points = points + shift
    points[:, 0] **= 1.3  # cells are short at the mouth, long behind the front
    return slit(points, cells, 0.5**1.3)


@pytest.mark.parametrize("opening", [0.0, 0.04])
def test_the_front_of_a_slit_is_found_closed_and_open(opening):
    points, cells, front = graded()
    points = points.copy()
    upper = np.isin(np.arange(len(points)), cells[points[cells].mean(axis=1)[:, 2] > 0.5])
    lips = np.isclose(points[:, 2], 0.5) & (points[:, 0] < points[front[0], 0] - 1e-9)
    points[lips, 2] += np.where(upper[lips], opening, -opening) * (points[front[0], 0] - points[lips, 0])
    edges = kept_edges(points, boundary_quads(cells)[0], cells)
    assert sorted(np.unique(edges)) == sorted(front)
    assert len(edges) == len(front) - 1


def test_a_front_between_hexahedra_and_wedges_is_found():
    points, cells, front = graded()
    lower = points[cells].mean(axis=1)[:, 2] < 0.5
    halves = np.concatenate([cells[lower][:, half] for half in ([0, 4, 1, 3, 7, 2], [4, 5, 1, 7, 6, 2])])
    mixed = np.concatenate([cells[~lower], collapsed_cells(halves, WEDGE)])
    edges = kept_edges(points, boundary_quads(mixed)[0], mixed)
    assert sorted(np.unique(edges)) == sorted(front)
    assert len(edges) == len(front) - 1


@pytest.mark.parametrize(
    ("filled", "warp", "front"), [(320.0, 0.0, True), (280.0, 0.0, False), (280.0, 1.0, False), (40.0, 0.0, False)]
)
def test_cells_around_a_front_fill_the_whole_turn(filled, warp, front):
    """A fan of wedges about the z axis that leaves a notch open, whose sides may be warped, or is a sharp blade.

    Nodes of a side move across it, below one way, above the other. So its direction away from the axis stays, and the
    area vectors of the two sides turn until they are opposed, though the notch is as wide as before.
    """
    angles = np.radians(np.linspace(0.0, filled, 9))
    away = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    across = np.stack([-np.sin(angles), np.cos(angles), 0.0 * angles], axis=1)
    across[1:-1] = 0.0
    ring = np.stack([away - warp * across, away + warp * across + [0.0, 0.0, 1.0]])
    points = np.concatenate([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], *ring])
    k = np.arange(2, 10)
    wedges = np.stack([0 * k, k, k + 1, 0 * k + 1, k + 9, k + 10], axis=1)
    cells = collapsed_cells(wedges, WEDGE)
    quads, _ = boundary_quads(cells)
    edges = edge_table(quads)
    found = edges.nodes[edges.manifold[crack_fronts(points, quads, edges, cells)]]
    assert [0, 1] in edges.nodes[edges.manifold].tolist()
    assert found.tolist() == ([[0, 1]] if front else [])


def test_a_quad_folded_onto_its_neighbour_is_no_front():
    points, cells = generate.box((4, 4, 4))
    quads, _ = boundary_quads(cells)
    folded = points.copy()
    top = np.flatnonzero((points[:, 2] == 1.0) & np.isclose(points[:, 0], 0.5))
    folded[top, 0] = 0.05  # behind the row at 0.25: the quads between lie on their neighbours
    assert len(kept_edges(folded, quads, cells)) == 0
    assert len(kept_edges(points, quads, cells)) == 0


def test_a_front_is_a_curve_and_both_sides_are_patches():
    points, cells, front = graded()
    quads, _ = boundary_quads(cells)
    features = find_features(points, quads, cells=cells)
    assert np.isin(features.edges, front).all(axis=1).sum() == len(front) - 1
    assert features.patches.max() + 1 == 5 + 2 + 2
    assert not features.soft
    assert "crack fronts" in features.reason
    rounded = find_features(points, quads, cells=cells, tolerance=0.5)
    assert sorted(np.unique(rounded.edges)) == sorted(front)


@pytest.mark.parametrize("bound", [0.0, 0.005])
def test_a_front_stays_where_it_is(bound):
    points, cells, front = graded(0.05)
    result = hc.regularize((points, cells), hausdorff=bound)
    np.testing.assert_allclose(result.points[front][:, [0, 2]], points[front][:, [0, 2]], rtol=0, atol=1e-12)
    assert result.report.after.scaled_jacobian.min >= result.report.before.scaled_jacobian.min
    quads, _ = boundary_quads(cells)
    assert hausdorff(result.points, points, quads) < 1e-12
    assert result.report.largest_displacement > 0.01


def test_a_front_stays_while_the_mesh_moves():
    points, cells, front = graded()
    wall = np.flatnonzero(points[:, 0] == 1.0)
    motion = hc.MeshMotion((points, cells), moving=wall)
    moved = motion.step(np.tile([0.4, 0.0, 0.0], (len(wall), 1))).points
    np.testing.assert_allclose(moved[front][:, [0, 2]], points[front][:, [0, 2]], rtol=0, atol=1e-12)
    inside = (points[:, 0] > points[front[0], 0] + 0.1) & (points[:, 0] < 1.0)
    assert (moved[inside, 0] > points[inside, 0] + 0.02).any()
