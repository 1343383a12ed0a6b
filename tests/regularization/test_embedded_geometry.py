"""What a mesh carries beside its hexahedra is kept by regularization: baffles, bars, sets, single nodes."""

import numpy as np
import pytest
import pyvista as pv
from independent_distance import finely_measured
from meshes.hexahedra import wavy_layers

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import find_interfaces

N = 8
STRAIGHT, CELLS = generate.box((N, N, N))
GRID = np.rint(N * STRAIGHT).astype(int)
NUMBER = {tuple(place): number for number, place in enumerate(GRID)}


def node(x, y, z):
    return NUMBER[x, y, z]


def carrying(points, quads=(), lines=(), vertices=(), tags=None, **point_data):
    """A grid of hexahedra with quadrilaterals, lines and vertices."""
    parts = [(12, CELLS), (9, np.reshape(quads, (-1, 4))), (3, np.reshape(lines, (-1, 2)))]
    parts.append((1, np.reshape(vertices, (-1, 1))))
    cells = np.concatenate([np.insert(rows, 0, rows.shape[1], axis=1).ravel() for _, rows in parts]).astype(np.int64)
    grid = pv.UnstructuredGrid(cells, np.repeat([t for t, _ in parts], [len(rows) for _, rows in parts]), points)
    if tags is not None:
        grid.cell_data["tag"] = np.concatenate([np.zeros(len(CELLS), int), tags])
    for name, values in point_data.items():
        grid.point_data[name] = values
    return grid


def shaken(still=(), amount=0.35, seed=3):
    """Inner nodes moved, but for some."""
    points = generate.jittered(STRAIGHT, CELLS, amount, seed=seed)[0]
    still = np.asarray(still, dtype=np.int64)
    points[still] = STRAIGHT[still]
    return points


def regularized(grid, **options):
    found = hc.regularize(grid, **options)
    assert found.report.after.invalid == 0
    assert found.report.after.scaled_jacobian.mean > found.report.before.scaled_jacobian.mean
    return found


BAFFLE = [
    [node(x, y, 4), node(x + 1, y, 4), node(x + 1, y + 1, 4), node(x, y + 1, 4)]
    for x in range(2, 6)
    for y in range(2, 6)
]


@pytest.mark.parametrize("options", [{}, {"hausdorff": 0.0}, {"boundary": "fixed"}])
def test_a_baffle_stays_in_its_plane_with_its_rim(options):
    points = shaken(np.unique(BAFFLE))
    # Its inner nodes not where they would be best, but in the plane.
    inner = [node(x, y, 4) for x in range(3, 6) for y in range(3, 6)]
    points[inner, :2] += 0.03 * np.random.default_rng(0).uniform(-1, 1, (len(inner), 2))
    result = regularized(carrying(points, BAFFLE), **options)
    nodes = np.unique(BAFFLE)
    assert np.abs(result.points[nodes, 2] - 0.5).max() < 1e-15
    outside = np.setdiff1d(nodes, inner)
    on_rim = np.abs(result.points[outside, :2] - 0.5).max(axis=1)
    np.testing.assert_allclose(on_rim, 0.25, atol=1e-12)
    assert np.abs(result.points[inner] - points[inner]).max() > 0.005
    corners = [node(x, y, 4) for x in (2, 6) for y in (2, 6)]
    np.testing.assert_allclose(result.points[corners], points[corners], atol=1e-12)
    ignored = regularized(carrying(points, BAFFLE), interfaces="ignore", **options)
    assert not any("kept as patches" in note for note in ignored.report.notes)


def test_two_baffles_of_different_tags_keep_the_line_between_them():
    points = shaken(np.unique(BAFFLE))
    line = [node(4, y, 4) for y in range(3, 6)]
    points[line, 1] += 0.04
    left = np.array([STRAIGHT[quad].mean(axis=0)[0] < 0.5 for quad in BAFFLE])
    result = regularized(carrying(points, BAFFLE, tags=np.where(left, 1, 2)))
    assert np.abs(result.points[line, 0] - 0.5).max() < 1e-12
    assert np.abs(result.points[line, 1] - points[line, 1]).max() > 0.005


@pytest.mark.parametrize("options", [{}, {"hausdorff": 0.0}, {"boundary": "fixed"}])
def test_a_straight_bar_stays_straight_and_its_ends_where_they_are(options):
    bar = [node(x, 4, 4) for x in range(2, 7)]
    points = shaken(bar)
    points[bar[1:-1], 0] += [0.04, -0.03, 0.05]
    result = regularized(carrying(points, lines=[bar[k : k + 2] for k in range(4)]), **options)
    np.testing.assert_allclose(result.points[bar, 1:], 0.5, atol=1e-15)
    np.testing.assert_array_equal(result.points[bar[::4]], points[bar[::4]])
    assert np.abs(result.points[bar, 0] - points[bar, 0]).max() > 0.01
    assert any("kept as curves" in note for note in result.report.notes)


def test_a_bent_bar_stays_near_where_it_was():
    bar = [node(x, 4, 4) for x in range(9)]
    points = shaken(bar)
    x = points[bar, 0]
    points[bar, 2] = 0.5 + 0.06 * np.sin(np.pi * x)
    lines = [bar[k : k + 2] for k in range(8)]
    result = regularized(carrying(points, lines=lines), hausdorff=0.005)
    finer = np.concatenate([np.linspace(points[a], points[b], 50) for a, b in lines])
    apart = np.linalg.norm(result.points[bar][:, None] - finer, axis=2).min(axis=1)
    assert apart.max() <= 0.005 * 3**0.5
    assert np.abs(result.points[bar] - points[bar]).max() > 1e-4
    free = regularized(carrying(points, lines=lines), interfaces="ignore", hausdorff=0.005)
    assert np.linalg.norm(free.points[bar][:, None] - finer, axis=2).min(axis=1).max() > 0.02


def test_vertices_and_nodes_of_small_sets_stay():
    tip, probe = node(4, 4, 4), node(2, 5, 3)
    marked = np.zeros(len(STRAIGHT), dtype=bool)
    marked[probe] = True
    points = shaken()
    result = regularized(carrying(points, vertices=[tip], probe=marked))
    np.testing.assert_array_equal(result.points[[tip, probe]], points[[tip, probe]])
    other = regularized(carrying(points, vertices=[tip], probe=marked), interfaces="ignore")
    assert (np.abs(other.points[[tip, probe]] - points[[tip, probe]]).max(axis=1) > 1e-3).all()


def test_the_outline_of_a_set_of_nodes_on_a_face_is_kept():
    clamped = (STRAIGHT[:, 2] == 0) & (STRAIGHT[:, 0] <= 0.25)
    line = np.flatnonzero((STRAIGHT[:, 2] == 0) & (STRAIGHT[:, 0] == 0.25))
    points = shaken()
    points[line] = STRAIGHT[line]
    # Cells beside the line are pressed, so that it would rather go elsewhere.
    inside = (STRAIGHT[:, 0] > 0) & (STRAIGHT[:, 0] < 0.25)
    points[inside, 0] *= 0.7
    result = regularized(carrying(points, clamped=clamped))
    assert np.abs(result.points[line, 0] - 0.25).max() < 1e-12


def test_shells_on_an_interface_tell_nothing_but_their_outline():
    mesh = wavy_layers(6)
    between = find_interfaces(mesh.cells, mesh.cell_data["material"])
    with_shells = hc.HexMesh(mesh.points, mesh.cells, cell_data=mesh.cell_data)
    plain = hc.regularize(with_shells)
    faces = np.insert(between.quads, 0, 4, axis=1).ravel()
    cells = np.concatenate([np.insert(mesh.cells, 0, 8, axis=1).ravel(), faces])
    types = np.repeat([12, 9], [len(mesh.cells), len(between.quads)])
    grid = pv.UnstructuredGrid(cells, types, mesh.points)
    material = np.concatenate([mesh.cell_data["material"], np.full(len(between.quads), -1)])
    grid.cell_data["material"] = material
    carried = hc.regularize(grid)
    np.testing.assert_allclose(carried.points, plain.points, atol=1e-9)
    assert finely_measured(carried.points, mesh.points, between.quads, 8) <= 0.005 * 3**0.5
