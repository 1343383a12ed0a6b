"""Faces of cells as they are drawn."""

import numpy as np
import pytest
from matplotlib.image import imread
from meshes.mixed import four_types
from meshes.quadratic_cells import curved_cylinder, random_cells, shapes

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import HEXAHEDRON20, HEXAHEDRON27
from hexconformal.mesh import CellBlock, blocks_of, boundary_quads, collapsed_table
from hexconformal.plots import canvas
from hexconformal.plots.drawn_faces import outer_faces
from hexconformal.plots.volume_plots import before_after

QUADRATIC = pytest.mark.parametrize("nodes", [20, 27])


def areas(faces):
    """(f,) of the pieces, in triangles."""
    a, b, c, d = np.moveaxis(faces.points.reshape(-1, 3)[faces.pieces()], 1, 0)
    halves = np.linalg.norm(np.cross(b - a, c - a), axis=1) + np.linalg.norm(np.cross(c - a, d - a), axis=1)
    return halves.reshape(len(faces.corners), -1).sum(axis=1) / 2


@QUADRATIC
def test_a_curved_cylinder_is_drawn_as_one(nodes):
    mesh = curved_cylinder(nodes)
    everything = np.ones(len(collapsed_table(mesh.blocks)), dtype=bool)
    faces = outer_faces(mesh.points, mesh.blocks, everything, tolerance=2e-4)
    diagonal, missed = 12**0.5, (np.pi / 8) ** 4 / 32
    places = faces.points.reshape(-1, 3)
    radius = np.hypot(*places[:, :2].T)
    around = np.isclose(np.hypot(*mesh.points[faces.corners][..., :2].T), 1.0).all(axis=0)
    # So much a parabola through three places of an eighth of a circle misses it at most.
    on_side = np.hypot(*faces.points[around][..., :2].T)
    assert 0.5 * missed < np.abs(on_side - 1).max() < missed
    assert radius.max() < 1 + missed
    # Middles of the pieces miss the curved faces by the tolerance at most.
    middles = np.hypot(*places[faces.pieces()].mean(axis=1)[np.repeat(around, faces.steps**2), :2].T)
    assert np.abs(middles - 1).max() < missed + 2e-4 * diagonal
    assert areas(faces)[around].sum() == pytest.approx(2 * np.pi * 2, rel=1e-3)
    assert areas(faces)[~around].sum() == pytest.approx(2 * np.pi, rel=2e-3)
    # Straight cells of the same corners have a tenth less.
    straight = outer_faces(mesh.points, blocks_of(hc.HexMesh(mesh.points, collapsed_table(mesh.blocks))), everything)
    assert straight.steps == 1
    assert areas(straight)[around].sum() < 0.98 * 2 * np.pi * 2


@QUADRATIC
def test_pieces_follow_the_shape_functions_in_a_mesh_that_is_cut_open(nodes):
    mesh = curved_cylinder(nodes)
    x = mesh.points[mesh.blocks[0].cells]
    kept = x[:, :8].mean(axis=1)[:, 0] < 0.1
    faces = outer_faces(mesh.points, mesh.blocks, kept)
    assert set(faces.owners.tolist()) == set(np.flatnonzero(kept).tolist())
    cut = boundary_quads(collapsed_table(mesh.blocks)[kept])[0]
    np.testing.assert_array_equal(faces.corners, cut)
    cell_type, t = mesh.blocks[0].cell_type, np.linspace(0, 1, faces.steps + 1)
    for face, owner in zip(faces.points, faces.owners, strict=True):
        # Every place of the lattice is one of the cell, on one of its sides.
        sides = [np.insert(np.array(uv), axis, side) for axis in range(3) for side in (0, 1) for uv in _pairs(t)]
        there = shapes(cell_type, np.array(sides)) @ x[owner]
        nearest = np.abs(face[:, None] - there).max(axis=2).min(axis=1)
        assert nearest.max() < 1e-12


def _pairs(t):
    return [(u, v) for u in t for v in t]


def test_edges_are_the_curves_between_corners_each_once():
    mesh = curved_cylinder(20)
    faces = outer_faces(mesh.points, mesh.blocks, np.ones(len(mesh.blocks[0].cells), dtype=bool))
    corners = faces.corners
    pairs = {frozenset(pair) for quad in corners.tolist() for pair in zip(quad, quad[1:] + quad[:1], strict=True)}
    edges = faces.points.reshape(-1, 3)[faces.edges()]
    assert edges.shape == (len(pairs), faces.steps + 1, 3)
    ends = {frozenset(map(tuple, ends.round(9).tolist())) for ends in edges[:, [0, -1]]}
    assert ends == {frozenset(tuple(mesh.points[node].round(9).tolist()) for node in pair) for pair in pairs}
    rim = (np.abs(np.hypot(*edges[:, [0, -1], :2].T) - 1) < 1e-9).all(axis=0)
    assert np.abs(np.hypot(*edges[rim][..., :2].T) - 1).max() < 1e-3


def test_edges_between_faces_of_different_values():
    points, cells = generate.box((2, 1, 1))
    faces = outer_faces(points, blocks_of(hc.HexMesh(points, cells)), np.ones(2, dtype=bool))
    between = faces.points.reshape(-1, 3)[faces.edges(faces.owners)]
    assert between.shape == (4, 2, 3)
    np.testing.assert_allclose(between[..., 0], 0.5)


def test_linear_cells_of_all_types_are_their_faces():
    mesh = four_types()
    count = len(collapsed_table(mesh.blocks))
    faces = outer_faces(mesh.points, mesh.blocks, np.ones(count, dtype=bool))
    assert faces.steps == 1
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    a, b, c = high - low
    assert areas(faces).sum() == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-12)
    np.testing.assert_array_equal(faces.points[:, 0], mesh.points[faces.corners[:, 0]])
    assert (faces.edges()[:, 0] != faces.edges()[:, 1]).all()


def test_tangled_cells_have_no_more_than_so_many_pieces():
    x = random_cells(HEXAHEDRON27, 1, 50.0)[0]
    block = CellBlock(HEXAHEDRON27, np.arange(27)[None], np.arange(1))
    assert outer_faces(x, [block], np.ones(1, dtype=bool), 1e-9).steps == 12
    x[3] = np.nan
    assert outer_faces(x, [block], np.ones(1, dtype=bool)).steps == 1
    point = CellBlock(HEXAHEDRON20, np.arange(20)[None], np.arange(1))
    assert outer_faces(np.zeros((20, 3)), [point], np.ones(1, dtype=bool)).steps == 1


def test_pictures_show_curved_cells(tmp_path, rendering):
    """The silhouette of a cylinder of eight cells around, beside that of the same with straight edges."""
    curved = curved_cylinder(27)
    straight = hc.elevated((curved.points, collapsed_table(curved.blocks)), 27)
    points = curved.points.copy()
    points[curved.blocks[0].cells] = straight.points[straight.blocks[0].cells]
    before_after(tmp_path / "c.png", curved, curved.replaced(points))
    picture = imread(tmp_path / "c.png")[..., :3]
    shown = picture[int(0.12 * len(picture)) : int(0.85 * len(picture))].min(axis=-1) < 0.97
    left, right = np.split(shown, [shown.shape[1] // 2], axis=1)
    assert left.sum() > 1.02 * right.sum()


def test_what_lies_in_a_surface_is_in_front_of_it(tmp_path, rendering):
    with canvas.plotter_of([-1.0, 1.0] * 3) as plotter:
        lift = canvas._lift(plotter)
        moved = canvas.to_pixels(plotter, np.array([np.zeros(3), lift]))
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-6)
    assert lift @ canvas.VIEW_DIRECTION > 0
