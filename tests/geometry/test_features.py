"""Feature curves, corners and patches: exact where geometry says so, steady where it is noisy, none on stairs."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import skin
from meshes.surfaces import quad_cube

from hexconformal import as_hex_mesh
from hexconformal.common.errors import OptionError
from hexconformal.generate import ball, box, cylinder
from hexconformal.geometry import Faces
from hexconformal.geometry.features import find_features
from hexconformal.io.vtk_mesh import from_vtk
from hexconformal.mesh import find_embedded
from hexconformal.mesh.topology import boundary_quads


def edge_set(features):
    return set(map(tuple, np.sort(features.edges, axis=1).tolist()))


def counts(features):
    return features.curves.max(initial=-1) + 1, len(features.corners), features.patches.max() + 1


def carved(inside, n=12):
    """The cells of a grid over [-1, 1]^3 whose centres are inside."""
    points, cells = box((n, n, n), (2, 2, 2), (-1, -1, -1))
    return points, cells[inside(points[cells].mean(axis=1))]


def tube(sides, layers=6):
    """A prism with a regular polygon for a base, its side quads only."""
    t = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    points = np.concatenate([np.column_stack([np.cos(t), np.sin(t), np.full(sides, z)]) for z in range(layers + 1)])
    i, k = np.meshgrid(np.arange(sides), np.arange(layers))
    i, k = i.ravel(), k.ravel()
    j = (i + 1) % sides
    return points, np.column_stack([k * sides + i, k * sides + j, (k + 1) * sides + j, (k + 1) * sides + i])


def test_cube_has_its_edges_corners_and_faces():
    points, quads = skin(box((3, 4, 5)))
    features = find_features(points, quads, tolerance=0.005 * 3**0.5)
    assert counts(features) == (12, 8, 6)
    assert not features.soft
    on = ((points == 0) | (points == 1)).sum(axis=1)
    assert set(features.corners) == set(np.flatnonzero(on == 3))
    assert (on[features.edges] >= 2).all()
    assert len(features.edges) == 4 * (3 + 4 + 5)
    # Every curve is straight, every patch flat.
    for curve in range(12):
        assert (np.ptp(points[features.edges[features.curves == curve].ravel()], axis=0) > 0).sum() == 1
    for patch in range(6):
        assert (np.ptp(points[quads[features.patches == patch].ravel()], axis=0) > 0).sum() == 2


def test_single_hexahedron():
    assert counts(find_features(*skin(box((1, 1, 1))))) == (12, 8, 6)


def test_cylinder_has_two_rims():
    points, quads = skin(cylinder())
    features = find_features(points, quads)
    assert counts(features) == (2, 0, 3)
    assert not features.soft
    ends = points[features.edges]
    np.testing.assert_allclose(np.hypot(ends[..., 0], ends[..., 1]), np.hypot(*points[:, :2].T).max(), rtol=1e-12)
    assert (np.ptp(ends[..., 2], axis=1) == 0).all()


def test_ball_is_smooth():
    features = find_features(*skin(ball()))
    assert counts(features) == (0, 0, 1)
    assert features.soft
    assert "smooth" in features.reason


def test_threshold():
    points, quads = tube(12)  # 30 degrees at each of its edges
    long = {tuple(sorted(e)) for e in zip(range(0, 72, 12), range(12, 84, 12), strict=True)}
    assert not long & edge_set(find_features(points, quads))
    # A wedge of 30 degrees, flat on both sides, is a matter of the threshold.
    flat = skin(box((6, 6, 6)))
    bent = flat[0].copy()
    bent[:, 2] += np.abs(bent[:, 0] - 0.5) * np.tan(np.radians(15))
    ridge = np.flatnonzero((flat[0][:, 0] == 0.5) & (flat[0][:, 2] == 1))
    assert not np.isin(find_features(bent, flat[1]).edges, ridge).all(axis=1).any()
    assert np.isin(find_features(bent, flat[1], angle=25).edges, ridge).all(axis=1).sum() == 6


def test_a_coarse_cylinder_is_no_prism():
    # 45 degrees between neighbours all around: curvature; 60 degrees: a prism.
    assert len(find_features(*tube(8), mode="keep").edges) == 2 * 8
    assert len(find_features(*tube(6), mode="keep").edges) == 2 * 6 + 6 * 6


def test_weak_parts_of_a_crease_are_found_from_its_strong_ones():
    # A ridge that fades from 50 to 28 degrees.
    points, quads = skin(box((6, 12, 2), (1, 2, 0.5)))
    slope = np.tan(np.radians(np.interp(points[:, 1], [0, 2], [25, 14])))
    bent = points - np.outer(np.abs(points[:, 0] - 0.5) * slope, [0, 0, 1])
    ridge = np.flatnonzero((points[:, 0] == 0.5) & (points[:, 2] == 0.5))
    assert np.isin(find_features(bent, quads).edges, ridge).all(axis=1).sum() == 12


@pytest.mark.parametrize("seed", range(5))
def test_noise_changes_nothing(seed):
    points, quads = skin(box((8, 8, 8)))
    noisy = points + np.random.default_rng(seed).normal(size=points.shape) * 0.02
    assert edge_set(find_features(noisy, quads)) == edge_set(find_features(points, quads))


@pytest.mark.parametrize("seed", range(3))
def test_folded_quads_are_no_features(seed):
    # Nodes swim within their faces, in a band so wide that quads turn over.
    points, quads = skin(box((10, 10, 10)))
    swim = np.random.default_rng(seed).uniform(-0.09, 0.09, points.shape)
    deep = ((points > 0.15) & (points < 0.85)).sum(axis=1) == 2
    folded = points + np.where((points > 0) & (points < 1) & deep[:, None], swim, 0)
    x = folded[quads]
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    corners = np.cross(np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x)
    assert ((corners * normal[:, None]).sum(axis=2) < 0).any()
    assert edge_set(find_features(folded, quads)) == edge_set(find_features(points, quads))


@pytest.mark.parametrize(
    "inside",
    [lambda x: (x**2).sum(axis=1) < 0.9, lambda x: (x[:, :2] ** 2).sum(axis=1) < 0.9, lambda x: x.sum(axis=1) < 0],
)
def test_stair_steps_are_soft(inside):
    points, quads = skin(carved(inside))
    features = find_features(points, quads)
    assert features.soft
    assert "stair steps" in features.reason
    assert not find_features(points, quads, mode="keep").soft


def test_steps_of_a_part_are_kept():
    points, quads = skin(carved(lambda x: (np.abs(x[:, 0]) < 0.5) | (x[:, 2] < 0)))
    features = find_features(points, quads)
    assert not features.soft
    assert counts(features) == (24, 16, 10)


def test_what_the_surface_may_swallow_is_soft():
    points, quads = skin(box((5, 5, 5)))
    assert not find_features(points, quads, tolerance=0.005 * 3**0.5).soft
    wide = find_features(points, quads, tolerance=0.08)
    assert wide.soft
    assert "0.4 edge lengths" in wide.reason
    # Half an edge of a fine mesh is still nothing beside the part.
    assert not find_features(*skin(box((40, 40, 40))), tolerance=0.0125).soft
    assert find_features(points, quads, mode="soft").soft


def test_curves_that_end_nowhere_are_left_out_unless_asked_for():
    # A ridge in the middle of the top of a block, flat at both ends.
    points, quads = skin(box((10, 20, 4), (1, 2, 0.4)))
    height = 0.25 * np.clip(1 - np.abs(points[:, 0] - 0.5) / 0.2, 0, 1) * (np.abs(points[:, 1] - 1) < 0.55)
    bent = points + np.outer(height * (points[:, 2] > 0.39), [0, 0, 1])
    keep, auto = find_features(bent, quads, mode="keep"), find_features(bent, quads)
    top = np.flatnonzero((points[:, 0] == 0.5) & (points[:, 2] > 0.39))
    assert np.isin(keep.edges, top).all(axis=1).sum() >= 8
    assert not auto.soft
    assert edge_set(auto) <= edge_set(keep)
    assert counts(find_features(points, quads)) == (12, 8, 6)


def test_tags_add_to_angles():
    points, quads = skin(box((4, 4, 4)))
    center = points[quads].mean(axis=1)
    tags = (center[:, 2] > 0.5).astype(int)
    features, edges_of_box = find_features(points, quads, tags=tags), find_features(points, quads)
    ring = np.flatnonzero(points[:, 2] == 0.5)
    added = edge_set(features) - edge_set(edges_of_box)
    assert edge_set(edges_of_box) <= edge_set(features)
    assert len(added) == 16
    assert np.isin(list(added), ring).all()
    # The ring ends where it crosses the edges of the cube, and these end there.
    assert counts(features) == (12 + 4 + 4, 8 + 4, 6 + 4)
    assert not features.soft
    assert "by tags and angle" in features.reason
    for patch in range(10):
        assert len(np.unique(tags[features.patches == patch])) == 1
    # Tags are kept where sharp edges may be rounded off, and where there are none.
    rounded = find_features(points, quads, tags=tags, tolerance=0.5)
    assert edge_set(rounded) == added
    assert not rounded.soft
    smooth, round_quads = skin(ball())
    tags = (smooth[round_quads].mean(axis=1)[:, 2] > 0.0).astype(int)
    tagged = find_features(smooth, round_quads, tags=tags)
    assert counts(tagged)[2] == 2
    assert "none by angle: the surface is smooth" in tagged.reason


@pytest.mark.parametrize("tagged_sides", ["bottom", "bottom, top and walls"])
def test_one_tagged_face_turns_off_no_sharp_edge(tagged_sides):
    points, quads = skin(box((4, 4, 4)))
    z = points[quads].mean(axis=1)[:, 2]
    tags = np.where(z == 0.0, 2, -1) if tagged_sides == "bottom" else np.where(z == 0.0, 2, np.where(z == 1.0, 3, 4))
    features = find_features(points, quads, tags=tags)
    assert edge_set(features) == edge_set(find_features(points, quads))
    assert counts(features) == (12, 8, 6)


def test_short_creases_between_tagged_curves_are_kept():
    # The vertical edges are cut to three edges each; alone they would be noise.
    points, quads = skin(box((3, 3, 9)))
    tags = (points[quads].mean(axis=1)[:, 2] * 3).astype(int)
    assert edge_set(find_features(points, quads)) <= edge_set(find_features(points, quads, tags=tags))


def test_boxes_that_share_an_edge_or_a_corner():
    points, cells = box((4, 4, 2))
    center = points[cells].mean(axis=1)
    checker = (center[:, 0] < 0.5) == (center[:, 1] < 0.5)
    quads = boundary_quads(cells[checker])[0]
    features = find_features(points, quads)
    shared = np.flatnonzero((points[:, :2] == 0.5).all(axis=1))
    assert np.isin(features.edges, shared).all(axis=1).sum() == 2
    assert set(shared[[0, -1]]) <= set(features.corners)
    assert shared[1] not in features.corners  # half-way along the shared edge
    assert features.patches.max() + 1 == 2 * 6
    points, cells = box((2, 2, 2))
    quads = boundary_quads(cells[[0, 7]])[0]
    assert 13 in find_features(points, quads).corners
    soft = find_features(points, quads, mode="soft", angle=179.0)
    assert soft.corners.tolist() == [13]


def test_two_pieces_do_not_mix():
    one, two = box((3, 3, 3)), cylinder()
    points = np.concatenate([one[0], two[0] + 5])
    quads = boundary_quads(np.concatenate([one[1], two[1] + len(one[0])]))[0]
    assert counts(find_features(points, quads)) == (14, 8, 9)


def test_same_features_in_every_unit_and_order():
    points, quads = skin(cylinder())
    points = points + np.random.default_rng(0).normal(size=points.shape) * 0.01
    plain = edge_set(find_features(points, quads))
    for scale, shift in ((1e-6, 0.0), (1e6, 0.0), (1.0, 2e4)):
        assert edge_set(find_features(points * scale + shift, quads)) == plain
    rng = np.random.default_rng(1)
    new = rng.permutation(len(points))
    moved = np.empty_like(points)
    moved[new] = points
    mixed = new[rng.permutation(quads)]
    other = find_features(moved, np.stack([np.roll(q, i % 4) for i, q in enumerate(mixed)]))
    assert edge_set(other) == {tuple(sorted((new[a], new[b]))) for a, b in plain}


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"mode": "hard"}, "'auto', 'keep' or 'soft'"),
        ({"angle": 0.0}, "between 0 and 180"),
        ({"tolerance": -1.0}, "must be 0 or more"),
        ({"tolerance": float("nan")}, "must be 0 or more"),
        ({"tags": [1, 2]}, "one per boundary face"),
    ],
)
def test_options_that_make_no_sense(options, text):
    with pytest.raises(OptionError, match=text):
        find_features(*skin(box((1, 1, 1))), **options)


EXPECTED = {
    "hs_swivel2_7494": (False, 15),
    "msq_1000hex_block_internal_bias": (False, 6),
    "msq_hex_5_tangled": (False, 6),
    "msq_pave1": (False, 10),
    "msq_pave3": (False, 4),
    "xu_t1_block": (False, 11),
    "xu_t1_hanger": (False, 13),
    "xu_t3_fandisk": (False, 15),
    "xu_t1_bunny": (True, 1),
    "xu_t3_kitty": (True, 1),
    "xu_t4_bird": (True, 1),
    "xu_t5_bird": (True, 1),
    "xu_t5_bone": (True, 1),
}


@pytest.mark.parametrize(("name", "curves"), [("xu_t1_block", 20), ("xu_t5_bone", 0)])
def test_creases_of_a_few_edges_that_end_nowhere_are_noise_also_if_all_are_kept(shared, name, curves):
    path = shared / "meshes" / "hex" / f"{name}_input.vtu"
    if not path.exists():
        pytest.skip("this mesh is not on this machine")
    mesh = meshio.read(path)
    features = find_features(*skin((mesh.points, mesh.cells_dict["hexahedron"].astype(np.int64))), mode="keep")
    assert len(np.unique(features.curves)) == curves


@pytest.mark.parametrize("name", EXPECTED)
def test_real_meshes(shared, name):
    path = shared / "meshes" / "hex" / f"{name}_input.vtu"
    if not path.exists():
        pytest.skip("this mesh is not on this machine")
    mesh = meshio.read(path)
    features = find_features(*skin((mesh.points, mesh.cells_dict["hexahedron"].astype(np.int64))))
    assert (features.soft, features.patches.max() + 1) == EXPECTED[name]


def tagged(name="gmsh:physical", missing=()):
    """A block with quads of three tags on its skin, handed over in another order and turned round."""
    points, cells = box((2, 2, 2))
    quads = boundary_quads(cells)[0]
    center = points[quads].mean(axis=1)
    tags = np.where(center[:, 2] == 1, 7, np.where(center[:, 2] == 0, 8, 9))
    carried = np.setdiff1d(np.random.default_rng(0).permutation(len(quads)), missing)
    blocks = [("quad", quads[carried][:, ::-1]), ("hexahedron", cells), ("line", [[0, 1]])]
    data = {name: [tags[carried], np.full(len(cells), 3), np.array([4])]}
    return meshio.Mesh(points, blocks, cell_data=data), quads, tags


def assert_same_partition(one, other):
    """The same faces have the same number in both, whatever these are."""
    pairs = np.unique(np.stack([one, other], axis=1), axis=0)
    assert len(pairs) == len(np.unique(one)) == len(np.unique(other))


@pytest.mark.parametrize("name", ["gmsh:physical", "gmsh:geometrical", "medit:ref", "nastran:ref"])
def test_surface_tags_of_meshio(name):
    source, quads, tags = tagged(name)
    assert_same_partition(find_embedded(as_hex_mesh(source), quads).skin_kinds, tags)


def test_surface_tags_of_pyvista():
    source, quads, tags = tagged()
    grid = pv.from_meshio(source)
    assert_same_partition(find_embedded(as_hex_mesh(grid), quads).skin_kinds, tags)
    features = find_features(source.points, quads, tags=find_embedded(as_hex_mesh(grid), quads).skin_kinds)
    assert counts(features) == (12, 8, 6)


@pytest.mark.parametrize("kind", ["quad8", "quad9"])
@pytest.mark.parametrize("to_pyvista", [False, True])
def test_surface_tags_of_quadrilaterals_of_second_order(kind, to_pyvista):
    source, quads, tags = tagged()
    corners, points = source.cells[0].data, source.points
    between = [points[corners[:, [k, (k + 1) % 4]]].mean(axis=1) for k in range(4)] + [points[corners].mean(axis=1)]
    middles = np.stack(between[: int(kind[4:]) - 4], axis=1)
    new = len(points) + np.arange(middles.size // 3).reshape(len(corners), -1)
    source.points = np.vstack([points, middles.reshape(-1, 3)])
    source.cells[0] = meshio.CellBlock(kind, np.column_stack([corners, new]))
    mesh = as_hex_mesh(pv.from_meshio(source) if to_pyvista else source)
    assert_same_partition(find_embedded(mesh, quads).skin_kinds, tags)
    if to_pyvista:
        assert_same_partition(find_embedded(from_vtk(pv.from_meshio(source)), quads).skin_kinds, tags)


def test_surface_tags_of_a_file(tmp_path):
    source, quads, tags = tagged()
    source.cell_data["gmsh:geometrical"] = [array * 0 + 1 for array in source.cell_data["gmsh:physical"]]
    meshio.write(tmp_path / "part.msh", source, file_format="gmsh22", binary=True)
    # The geometrical tags are all the same and so say nothing.
    assert_same_partition(find_embedded(as_hex_mesh(tmp_path / "part.msh"), quads).skin_kinds, tags)


def test_surface_tags_where_there_are_none_or_not_all():
    points, cells = box((2, 2, 2))
    quads = boundary_quads(cells)[0]
    for source in ((points, cells), meshio.Mesh(points, [("hexahedron", cells)])):
        assert not find_embedded(as_hex_mesh(source), quads).skin_kinds.any()
    kinds = find_embedded(as_hex_mesh(tagged("velocity")[0]), quads).skin_kinds
    assert (kinds == kinds[0]).all()
    source, quads, tags = tagged(missing=[0, 5])
    tags[[0, 5]] = -1
    assert_same_partition(find_embedded(as_hex_mesh(source), quads).skin_kinds, tags)


def test_faces_of_both_kinds_have_the_features_of_their_shape():
    # A cube of quadrilaterals, half of them cut in two.
    points, faces = quad_cube(6)
    cut, kept = faces.quads[::2], faces.quads[1::2]
    mixed = Faces(np.concatenate([cut[:, [0, 1, 2]], cut[:, [0, 2, 3]]]), kept)
    features = find_features(points, mixed)
    on = (np.abs(points) == 1).sum(axis=1)
    np.testing.assert_array_equal(features.corners, np.flatnonzero(on == 3))
    np.testing.assert_array_equal(np.unique(features.edges), np.flatnonzero(on >= 2))
    assert (features.kind == np.maximum(on - 1, 0)).all()
    assert features.curves.max() + 1 == 12
    assert features.patches.max() + 1 == 6
    sides = [
        set(features.patches[mixed.any_of((points[:, k] == sign) & (on == 1))]) for k in range(3) for sign in (-1, 1)
    ]
    assert all(len(side) == 1 for side in sides)
