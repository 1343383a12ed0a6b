"""Which sharp edges are creases: not both ways round a sliver, not noise."""

import numpy as np
import pytest
from meshes.surfaces import no_cells, quad_cube, scattered_sphere

import surface
from hexconformal.geometry import CORNER, CURVE, SMOOTH, CreaseSchedule, Faces
from hexconformal.geometry.features.creases import _lead_past, _without_spurs
from surface.constraint.features import find_features


def roof(n=12, rows=4):
    """Two grids of triangles that meet at 127 degrees along n edges of the x axis; ids of the crease."""
    x = np.arange(n + 1.0)
    slopes = [np.stack([x, side * r + 0 * x, -2 * r + 0 * x], axis=1) for side in (-1, 1) for r in range(1, rows + 1)]
    points = np.concatenate([np.stack([x, 0 * x, 0 * x], axis=1), *slopes])
    i = np.arange(n)
    cells = []
    for side in (0, 1):
        lines = [0, *(1 + side * rows + np.arange(rows))]
        for upper, lower in zip(lines, lines[1:], strict=False):
            a, b, c, d = (line * (n + 1) + i + k for line, k in ((upper, 0), (upper, 1), (lower, 1), (lower, 0)))
            new = np.concatenate([np.stack([a, d, b], axis=1), np.stack([b, d, c], axis=1)])
            cells.append(new if side == 0 else new[:, ::-1])
    return points, np.concatenate(cells), np.arange(n + 1)


def inserted(points, triangles, a, b, place):
    """One more node near the edge from a to b: a sliver on the first side, two halves of the cell on the second."""
    new = len(points)
    has = [(triangles == node).any(axis=1) for node in (a, b)]
    first, second = np.flatnonzero(has[0] & has[1])
    tip = triangles[second][~np.isin(triangles[second], [a, b])][0]
    forward = (a, b) in list(zip(triangles[first], np.roll(triangles[first], -1), strict=True))
    cap = [b, a, new] if forward else [a, b, new]
    halves = [[tip, new, a], [tip, b, new]] if forward else [[tip, a, new], [tip, new, b]]
    kept = np.delete(triangles, second, axis=0)
    return np.vstack([points, place]), np.vstack([kept, [cap], halves])


def creases(points, triangles, **options):
    cells = Faces(triangles, no_cells(4))
    features = find_features(points, cells, **options)
    return features, {tuple(edge) for edge in np.sort(features.edges, axis=1)}


def test_a_crease_passes_a_sliver_on_one_side_so_that_its_node_gets_off():
    points, triangles, crease = roof()
    points, triangles = inserted(points, triangles, 5, 6, [5.5, 0.005, 0.01])
    apex = len(points) - 1
    features, edges = creases(points, triangles)
    assert (features.kind[crease[1:-1]] == CURVE).all()
    assert features.kind[apex] == SMOOTH
    assert (5, 6) in edges
    assert not {(5, apex), (6, apex)} & edges
    result = surface.remesh((points, triangles))
    assert result.report.before.min_angle < 2
    assert result.report.after.min_angle > 20
    # The crease is where it was.
    assert np.abs(result.points[crease, 1:]).max() < 1e-9
    assert result.report.turned == 0


def test_a_crease_that_is_given_goes_as_it_is_given():
    points, triangles, _ = roof()
    points, triangles = inserted(points, triangles, 5, 6, [5.5, 0.005, 0.01])
    apex = len(points) - 1
    features, edges = creases(points, triangles, angle=None, edges=np.array([[5, apex], [apex, 6]]))
    assert {(5, apex), (6, apex)} <= edges
    assert features.kind[apex] == CURVE


def test_of_two_creases_side_by_side_one_stays():
    # A narrow facet of two needles between them: two edges of each are sharp, and meet where others do.
    points, triangles, _ = roof()
    # Node 5 is split into two, a little apart down both slopes; nodes 4 and 6 stay.
    other = len(points)
    points = np.vstack([points, points[5] + [0.0, 0.02, -0.04]])
    points[5] += [0.0, -0.02, -0.04]
    beyond = points[triangles].mean(axis=1)[:, 1] > 0
    triangles = np.where((triangles == 5) & beyond[:, None], other, triangles)
    triangles = np.vstack([triangles, [[4, 5, other], [5, 6, other]]])
    features, edges = creases(points, triangles)
    assert (features.kind[[4, 6]] == CURVE).all()
    assert len({(4, 5), (4, other)} & edges) == len({(5, 6), (6, other)} & edges) == 1
    assert sorted(features.kind[[5, other]]) == [SMOOTH, CURVE]
    result = surface.remesh((points, triangles))
    assert result.report.before.min_angle < 5
    assert result.report.after.min_angle > 20
    assert result.report.turned == 0


def test_sharp_edges_of_a_rough_surface_are_no_creases():
    points, triangles = scattered_sphere(400, seed=1)
    rng = np.random.default_rng(2)
    rough = points * (1 + 0.12 * rng.standard_normal((len(points), 1)))
    features, _ = creases(rough, triangles)
    assert (features.kind == SMOOTH).all()


def test_a_straight_crease_of_a_rough_surface_is_one():
    points, triangles, crease = roof()
    beside = np.setdiff1d(np.arange(len(points)), crease)
    points[beside, 2] += 0.6 * np.random.default_rng(0).standard_normal(len(beside))
    features, edges = creases(points, triangles)
    assert {(i, i + 1) for i in crease[:-1]} <= edges
    assert (features.kind[crease[1:-1]] == CURVE).all()


def test_a_crease_that_ends_in_a_face_is_long():
    # Unit edges somewhere else, and a chain of 24 fine ones: three at each end lead nowhere.
    far = np.stack([np.arange(200.0), np.full(200, 50.0), np.zeros(200)], axis=1)
    for step, expected in ((0.3, 0), (0.9, 18)):
        chain = np.stack([step * np.arange(25), np.zeros(25), np.zeros(25)], axis=1)
        edges = np.stack([np.arange(224), np.arange(1, 225)], axis=1)
        edges = edges[edges[:, 1] != 25]
        sharp = edges[:, 1] < 25
        assert _without_spurs(np.concatenate([chain, far]), edges, sharp, CreaseSchedule()).sum() == expected
    # A ring that is as fine, such as the rim of a hole, has no end.
    t = 2 * np.pi * np.arange(25) / 25
    ring = 0.3 / (2 * np.sin(np.pi / 25)) * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    closed = np.concatenate([edges, [[0, 24]]])
    assert _without_spurs(np.concatenate([ring, far]), closed, (closed < 25).all(axis=1), CreaseSchedule()).sum() == 25


def test_flat_facets_have_creases_however_many_their_corners():
    # A box of twelve triangles, and one of six squares: all their nodes are corners.
    points, cells = quad_cube(1)
    halves = np.concatenate([cells.quads[:, [0, 1, 2]], cells.quads[:, [0, 2, 3]]])
    for box in (Faces(halves, no_cells(4)), cells):
        assert (find_features(points, box).kind == CORNER).all()


def drum(n):
    """A cylinder of n sides; the caps are cut into triangles ear by ear, so that many have two edges of the rim."""
    t = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(t), np.sin(t)], axis=1)
    points = np.concatenate([np.column_stack([rim, np.full(n, z)]) for z in (0.0, 0.3)])
    i = np.arange(n)
    j = (i + 1) % n
    cells = [np.stack([i, j, j + n], axis=1), np.stack([i, j + n, i + n], axis=1)]
    left = list(range(n))
    while len(left) > 2:
        ears = [(left[k], left[k + 1], left[(k + 2) % len(left)]) for k in range(0, len(left) - 1, 2)]
        cells += [np.array(ears)[:, ::-1], np.array(ears) + n]
        left = left[::2]
    return points, np.concatenate(cells)


@pytest.mark.parametrize("n", [64, 256])
def test_the_rim_of_a_round_cap_stays_whole(n):
    points, triangles = drum(n)
    features, _ = creases(points, triangles)
    assert (features.kind == CURVE).all()
    assert len(features.edges) == 2 * n


def test_a_wedge_that_ends_in_needles_keeps_all_its_edges():
    x = np.arange(21.0)
    points = np.concatenate([np.stack([x, y + 0 * x, z + 0 * x], axis=1) for y, z in ((0, 1), (-0.07, 0), (0.07, 0))])
    i = np.arange(20)
    sides = [(0, 21), (21, 42), (42, 0)]
    cells = [np.stack(c, axis=1) for a, b in sides for c in ((i + a, i + b, i + a + 1), (i + a + 1, i + b, i + b + 1))]
    triangles = np.concatenate([*cells, [[0, 42, 21], [20, 41, 62]]])
    features, edges = creases(points, triangles)
    assert {(0, 21), (0, 42), (21, 42), (20, 41), (20, 62), (41, 62)} <= edges
    assert len(np.unique(features.patches)) == 5


def test_a_crease_between_others_does_not_lose_its_corner():
    points = np.array([[0.0, 0, 0], [6, 0, 0], [0, 1, 0]])
    near = {0: {1, 2}, 1: {0, 3, 4}, 2: {0, 5, 6}}
    assert not _lead_past(points, near, 0, 1, 2)
    assert near == {0: {1, 2}, 1: {0, 3, 4}, 2: {0, 5, 6}}


def test_a_zigzag_along_a_sliver_is_straightened_and_an_arc_is_not():
    for ends, straight in (([0.0, 0.0], True), ([-0.06, -0.06], False)):
        points = np.array([[-1, ends[0], 0], [0, 0, 0], [0.5, 0.02, 0], [1, 0, 0], [2, ends[1], 0]])
        near = {0: {1}, 1: {0, 2}, 2: {1, 3}, 3: {2, 4}, 4: {3}}
        assert _lead_past(points, near, 1, 2, 3) is straight
        assert near[1] == ({0, 3} if straight else {0, 2})
