"""Matching of a skin with the features of a surface: pieces, paths, sheets, and where nodes go."""

import numpy as np
import pyvista as pv

from hexconformal import generate
from hexconformal.geometry import Skin, SurfaceLocator, find_features, match_features
from hexconformal.geometry.matching.patches import matched_sheets
from hexconformal.geometry.matching.paths import find_paths
from hexconformal.geometry.matching.pieces import curve_pieces
from hexconformal.geometry.matching.schedule import MatchingSchedule
from hexconformal.mesh import boundary_quads


def skin_of(points, cells, tags=None):
    return Skin(points, boundary_quads(cells)[0], cells, tags)


def surface_of(dataset):
    return SurfaceLocator.from_pyvista(dataset)


def box_surface():
    return surface_of(pv.Box((0, 1, 0, 1, 0, 1)))


def jittered(points, amount, seed=0):
    return points + np.random.default_rng(seed).uniform(-amount, amount, points.shape)


def test_pieces_know_the_angle_that_the_solid_takes_up():
    tube, around = generate.box((3, 3, 1))
    around = around[~(np.abs(tube[around].mean(axis=1)[:, :2] - 0.5) < 0.05).all(axis=1)]
    surface = SurfaceLocator(tube, boundary_quads(around)[0])
    pieces = curve_pieces(surface, find_features(tube, surface.faces))
    inside = np.array([(np.abs(tube[piece.nodes][:, :2] - 0.5) < 0.2).all() for piece in pieces])
    upright = np.array([np.ptp(tube[piece.nodes][:, 2]) > 0.5 for piece in pieces])
    sectors = np.array([piece.sectors for piece in pieces])
    np.testing.assert_allclose(sectors[inside & upright], 3.0)
    np.testing.assert_allclose(sectors[~(inside & upright)], 1.0)


def test_closed_curves_are_cut_into_pieces_that_are_nearly_straight():
    surface = surface_of(pv.Cylinder(resolution=60))
    pieces = curve_pieces(surface, find_features(surface.points, surface.faces))
    assert {piece.curve for piece in pieces} == {0, 1}
    for piece in pieces:
        x = surface.points[piece.nodes]
        length = np.linalg.norm(np.diff(x, axis=0), axis=1).sum()
        assert np.linalg.norm(x[-1] - x[0]) >= 0.7 * length
    # Each node of both circles begins or goes on in one piece.
    assert sum(len(piece.nodes) - 1 for piece in pieces) == 120


def test_paths_are_the_rows_of_the_box_however_its_nodes_are_off():
    points, cells = generate.box((6, 5, 4))
    surface = box_surface()
    pieces = curve_pieces(surface, find_features(surface.points, surface.faces))
    for seed in range(5):
        # More than half a cell: many nodes are nearer to an edge than those that belong on it.
        skin = skin_of(jittered(points, 0.1, seed), cells)
        paths = find_paths(skin, surface.points, pieces, MatchingSchedule())
        assert len(paths) == 12
        for path in paths:
            ends = surface.points[list(path.piece.ends)]
            x = points[path.nodes]
            axis = np.argmax(np.abs(ends[1] - ends[0]))
            np.testing.assert_allclose(x[[0, -1]], ends)
            np.testing.assert_allclose(np.delete(x, axis, axis=1), np.delete(ends[[0]], axis, axis=1) + 0 * x[:, :2])
            assert len(x) == (6, 5, 4)[axis] + 1


def test_no_two_paths_share_a_node_but_at_their_ends():
    points, cells = generate.cylinder(5, 3, 6)
    height, radius = np.ptp(points[:, 2]), np.linalg.norm(points[:, :2], axis=1).max()
    there = pv.Cylinder(center=points.mean(axis=0), direction=(0, 0, 1), radius=radius, height=height, resolution=50)
    surface = surface_of(there)
    pieces = curve_pieces(surface, find_features(surface.points, surface.faces))
    paths = find_paths(skin_of(jittered(points, 0.05), cells), surface.points, pieces, MatchingSchedule())
    assert len(paths) == len(pieces)
    inner = np.concatenate([path.nodes[1:-1] for path in paths])
    ends = np.concatenate([path.nodes[[0, -1]] for path in paths])
    assert len(np.unique(inner)) == len(inner)
    assert not np.isin(inner, ends).any()


def test_sheets_are_told_by_what_is_beside_their_curves():
    # The sides of a plate of a tenth of a cell: by distance a node may belong to either side.
    points, cells = generate.box((6, 6, 1), (1.0, 1.0, 0.02))
    surface = surface_of(pv.Box((0, 1, 0, 1, 0, 0.02)))
    pieces = curve_pieces(surface, find_features(surface.points, surface.faces))
    skin = skin_of(jittered(points, 0.02, seed=4), cells)
    paths = find_paths(skin_of(points, cells), surface.points, pieces, MatchingSchedule())
    found = matched_sheets(SurfaceLocator(skin.points, skin.quads), surface, paths)
    assert found.alike.all()
    assert len(found.alike) == 6
    heights = points[skin.quads].mean(axis=1)[:, 2]
    for end in (0.0, 0.02):
        ours = np.unique(found.ours[np.abs(heights - end) < 1e-12])
        flat = (np.abs(surface.points[surface.faces][..., 2] - end) < 1e-6).all(axis=1)
        assert len(ours) == 1
        assert (found.theirs[flat] == ours[0]).all()


def test_nothing_is_matched_where_there_are_no_curves():
    points, cells = generate.ball(3, 2)
    surface = surface_of(pv.Sphere(radius=1.0))
    features = find_features(surface.points, surface.faces)
    assert match_features(skin_of(points, cells), surface, features, 1e-6) is None


def test_folded_patches_come_out_unfolded():
    points, cells = generate.box((6, 6, 6))
    surface = box_surface()
    skin = skin_of(jittered(points, 0.13, seed=2), cells)
    matching = match_features(skin, surface, find_features(surface.points, surface.faces), 1e-9)
    for x, folded in ((skin.points, True), (matching.points, False)):
        corners = x[skin.quads]
        normals = np.cross(np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners)
        outward = points[skin.quads].mean(axis=1) - 0.5
        outward = np.sign(outward) * (np.abs(outward) > 0.5 - 1e-9)
        assert (np.einsum("qki,qi->qk", normals, outward) <= 0).any() == folded


def test_curves_around_what_the_mesh_has_otherwise_are_left_out():
    # A square tube: the mesh has no hole, its lids over both ends would be drawn to the walls of the hole.
    points, cells = generate.box((6, 6, 6))
    tube, around = generate.box((3, 3, 1))
    around = around[~(np.abs(tube[around].mean(axis=1)[:, :2] - 0.5) < 0.05).all(axis=1)]
    surface = SurfaceLocator(tube, boundary_quads(around)[0])
    features = find_features(tube, surface.faces)
    matching = match_features(skin_of(points, cells), surface, features, 1e-9)
    assert len(np.unique(features.curves)) == 24
    on_box = ((np.abs(points) < 1e-9) | (np.abs(points - 1) < 1e-9)).sum(axis=1) >= 2
    assert on_box[matching.features.edges].all()


def test_curves_around_what_the_surface_has_not_are_left_out():
    points, cells = generate.box((6, 6, 6))
    whole = pv.Box((0, 1, 0, 1, 0, 1)).triangulate().subdivide(2)
    faces = whole.faces.reshape(-1, 4)[:, 1:]
    middle = np.abs(np.asarray(whole.points)[faces].mean(axis=1) - [0.5, 0.5, 1.0]).max(axis=1) < 0.26
    surface = SurfaceLocator(np.asarray(whole.points, float), faces[~middle])
    features = find_features(surface.points, surface.faces)
    matching = match_features(skin_of(points, cells), surface, features, 1e-9)
    on_box = ((np.abs(points) < 1e-9) | (np.abs(points - 1) < 1e-9)).sum(axis=1) >= 2
    assert len(np.unique(features.curves)) > 12
    assert on_box[matching.features.edges].all()
    assert len(matching.features.corners) == 8
