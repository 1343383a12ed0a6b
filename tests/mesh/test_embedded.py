"""What a mesh carries beside its hexahedra: patches inside, curves, sets on the boundary, held nodes."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from vtk_datasets import plain

import hexconformal as hc
from hexconformal import generate
from hexconformal.io import as_hex_mesh, from_vtk
from hexconformal.mesh import boundary_quads, face_table, find_embedded

POINTS, CELLS = generate.box((4, 4, 4))
SKIN = boundary_quads(CELLS)[0]
TABLE = face_table(CELLS)
INNER = TABLE.quads[TABLE.counts == 2]


def centres(quads):
    return POINTS[quads].mean(axis=1)


WALL = INNER[centres(INNER)[:, 0] == 0.5]  # the 16 faces of the plane in the middle
FLOOR = centres(SKIN)[:, 2] == 0
X, Y, Z = POINTS.T


def source(*blocks, **options):
    """A meshio.Mesh of the box and of other cells."""
    return meshio.Mesh(POINTS, [*blocks, ("hexahedron", CELLS)], **options)


def found(mesh, skin=SKIN):
    return find_embedded(as_hex_mesh(mesh), skin)


def of_nodes(**sets):
    """What sets of nodes, given as masks, say."""
    return found(source(point_sets={name: np.flatnonzero(mask) for name, mask in sets.items()}))


def same_sets(rows, others):
    """Whether two tables have the same rows, whatever their order and that of the nodes in them."""
    return sorted(map(sorted, np.asarray(rows).tolist())) == sorted(map(sorted, np.asarray(others).tolist()))


def partition(labels):
    return np.unique(labels, return_inverse=True)[1].ravel()


def same_partition(labels, others):
    """Whether labels tell the same things apart."""
    pairs = len(np.unique(np.stack([partition(labels), partition(others)]), axis=1).T)
    return pairs == len(np.unique(labels)) == len(np.unique(others))


def assert_empty(embedded):
    assert embedded.quads.shape == (0, 4)
    assert embedded.edges.shape == (0, 2)
    assert not embedded.skin_kinds.any()
    assert embedded.skin_kinds.shape == (len(SKIN),)
    assert (len(embedded.kinds), len(embedded.edge_kinds), len(embedded.held), embedded.notes) == (0, 0, 0, ())


@pytest.mark.parametrize(
    "mesh", [(POINTS, CELLS), source(), pv.from_meshio(source()), pv.ImageData(dimensions=(5, 5, 5))]
)
def test_hexahedra_alone_carry_nothing(mesh):
    assert_empty(found(mesh))


def forms(mesh):
    """The mesh as what each library has."""
    grid = pv.from_meshio(mesh)
    return [as_hex_mesh(mesh), as_hex_mesh(grid), from_vtk(plain(grid))]


def test_quads_inside_are_patches_whatever_their_order():
    quads = np.roll(WALL, 1, axis=1)[::-1, ::-1]
    for mesh in forms(source(("quad", quads))):
        embedded = find_embedded(mesh, SKIN)
        assert same_sets(embedded.quads, WALL)
        assert len(np.unique(embedded.kinds)) == 1
        assert not embedded.skin_kinds.any()
        assert embedded.notes == ("kept as patches: quadrilaterals (16 quads)",)


def test_kinds_tell_tags_and_sets_apart_and_overlaps_are_refined():
    y, z = centres(WALL)[:, 1:].T
    tags = [np.where(y < 0.5, 3, 7), np.zeros(len(CELLS), int)]
    sets = {"low": [np.flatnonzero(z < 0.5), []], "middle": [np.flatnonzero((y > 0.25) & (y < 0.75)), []]}
    embedded = found(source(("quad", WALL), cell_data={"medit:ref": tags}, cell_sets=sets))
    place = {tuple(sorted(quad)): k for k, quad in enumerate(WALL.tolist())}
    order = [place[tuple(sorted(quad))] for quad in embedded.quads.tolist()]
    expected = (y < 0.5) + 2 * (z < 0.5) + 4 * ((y > 0.25) & (y < 0.75))
    assert same_partition(embedded.kinds, expected[order])
    assert embedded.notes == (
        "kept as patches: quadrilaterals (16 quads), set 'low' (8 quads), set 'middle' (8 quads)",
    )


def test_a_quad_that_is_there_for_two_tags_is_of_a_kind_of_its_own():
    twice = np.concatenate([WALL[:10], WALL[6:]])
    tags = [np.repeat([1, 2], 10), np.zeros(len(CELLS), int)]
    embedded = found(source(("quad", twice), cell_data={"gmsh:physical": tags}))
    assert sorted(np.bincount(embedded.kinds)) == [0, 4, 6, 6]


@pytest.mark.parametrize("kind", ["quad8", "quad9"])
def test_cells_of_second_order_are_taken_by_their_corners(kind):
    more = len(POINTS) + np.arange(5 * 16).reshape(16, 5)[:, : int(kind[4:]) - 4]
    middles = np.repeat(centres(WALL), 5, axis=0)
    points = np.vstack([POINTS, middles])
    line = np.array([[0, 1, len(points) - 1]])
    mesh = meshio.Mesh(points, [(kind, np.column_stack([WALL, more])), ("line3", line), ("hexahedron", CELLS)])
    for form in forms(mesh):
        embedded = find_embedded(form, SKIN)
        assert same_sets(embedded.quads, WALL)
        assert embedded.edges.tolist() == [[0, 1]]


TAGS = np.where(centres(SKIN)[:, 2] == 1, 7, np.where(FLOOR, 8, 9))


def tagged(name, missing=()):
    """Tags of three values on the boundary, its quads in another order and turned round."""
    carried = np.setdiff1d(np.random.default_rng(0).permutation(len(SKIN)), missing)
    data = {name: [TAGS[carried], np.full(len(CELLS), 3)]}
    return source(("quad", SKIN[carried][:, ::-1]), cell_data=data)


@pytest.mark.parametrize(
    "name", ["gmsh:geometrical", "CellEntityIds", "gmsh:physical", "medit:ref", "cell_tags", "tag"]
)
def test_tags_tell_boundary_quads_apart(name):
    for mesh in forms(tagged(name)):
        embedded = find_embedded(mesh, SKIN)
        assert same_partition(embedded.skin_kinds, TAGS)
        assert len(embedded.quads) == 0
        assert embedded.notes == (f"outlines on the boundary are kept of: tags {name!r} (3 kinds)",)


def test_quads_that_are_not_carried_are_of_kind_0_and_other_arrays_tell_nothing():
    missing = np.flatnonzero(FLOOR)[:5]
    embedded = found(tagged("tag", missing))
    halves = tagged("tag")
    halves.cell_data["tag"][0] = halves.cell_data["tag"][0] % 2 + 0.5
    assert len(np.unique(found(halves).skin_kinds)) == 1
    assert np.flatnonzero(embedded.skin_kinds == 0).tolist() == missing.tolist()
    assert len(np.unique(embedded.skin_kinds)) == 4
    assert len(np.unique(found(tagged("pressure")).skin_kinds)) == 1


def test_the_first_array_that_tells_boundary_quads_apart_counts():
    mesh = tagged("gmsh:physical")
    for name, parts in {"gmsh:geometrical": [np.full(len(SKIN), 4), np.zeros(len(CELLS), int)]}.items():
        mesh.cell_data[name] = parts
    mesh.cell_data["tag"] = [np.arange(len(SKIN)), np.zeros(len(CELLS), int)]
    assert len(np.unique(found(mesh).skin_kinds)) == 3


def test_shells_on_a_part_of_the_boundary_have_an_outline():
    embedded = found(source(("quad", SKIN[FLOOR])))
    assert same_partition(embedded.skin_kinds, FLOOR)
    assert embedded.notes == ("outlines on the boundary are kept of: quadrilaterals (16 quads)",)


def test_sets_of_faces_and_of_nodes_refine_tags():
    x = centres(SKIN)[:, 0]
    mesh = tagged("tag")
    order = np.random.default_rng(0).permutation(len(SKIN))
    mesh.cells[0].data[:] = SKIN[order]
    mesh.cell_data["tag"][0][:] = TAGS[order]
    mesh.cell_sets = {"left": [np.flatnonzero(x[order] < 0.5), np.empty(0, int)]}
    mesh.point_sets = {"front": np.flatnonzero(Y == 0)}
    expected = TAGS + 10 * (x < 0.5) + 100 * (centres(SKIN)[:, 1] == 0)
    embedded = found(mesh)
    assert same_partition(embedded.skin_kinds, expected)
    assert embedded.notes[0].endswith("tags 'tag' (8 kinds), set 'left' (48 quads), node set 'front' (16 quads)")


def test_lines_are_curves_and_tags_tell_them_apart():
    column = np.flatnonzero((X == 0.5) & (Y == 0.5))  # inside the box, from its floor to its top
    lines = np.stack([column[1:], column[:-1]], axis=1)
    tags = {"nastran:ref": [np.array([1, 1, 2, 2]), np.zeros(len(CELLS), int)]}
    for mesh in forms(source(("line", lines), cell_data=tags)):
        embedded = find_embedded(mesh, SKIN)
        assert same_sets(embedded.edges, lines)
        assert (embedded.edges[:, 0] < embedded.edges[:, 1]).all()
        of_height = POINTS[embedded.edges].mean(axis=1)[:, 2] < 0.5
        assert same_partition(embedded.edge_kinds, of_height)
        assert embedded.notes == ("kept as curves: lines (4 edges)",)
        assert len(embedded.held) == 0


def test_chains_of_lines_and_of_vertices_of_vtk_are_taken_apart():
    column = np.flatnonzero((X == 0.5) & (Y == 0.5))
    cells = np.concatenate([np.insert(CELLS, 0, 8, axis=1).ravel(), [5, *column], [2, 3, 4]])
    grid = pv.UnstructuredGrid(cells, np.repeat([12, 4, 2], [len(CELLS), 1, 1]), POINTS)
    for mesh in (as_hex_mesh(grid), from_vtk(plain(grid))):
        embedded = find_embedded(mesh, SKIN)
        assert same_sets(embedded.edges, np.stack([column[1:], column[:-1]], axis=1))
        assert embedded.held.tolist() == [3, 4]


def test_cells_that_are_no_face_and_no_edge_hold_their_nodes():
    centre = int(np.flatnonzero((POINTS == 0.5).all(axis=1))[0])
    far = np.array([[0, centre]])
    crooked = np.array([[5, 6, 7, centre]])
    triangle, vertex = np.array([[20, 21, 30]]), np.array([[124]])
    blocks = [("quad", crooked), ("line", far), ("triangle", triangle), ("vertex", vertex)]
    for mesh in forms(source(*blocks)):
        embedded = find_embedded(mesh, SKIN)
        assert embedded.held.tolist() == sorted({5, 6, 7, centre, 0, 20, 21, 30, 124})
        assert len(embedded.quads) == len(embedded.edges) == 0
        assert embedded.notes == (
            "held: quadrilaterals that are no faces of hexahedra (4 nodes), lines that are no edges of hexahedra "
            "(2 nodes), triangles (3 nodes), vertices (1 nodes)",
        )


@pytest.mark.parametrize(("kind", "what"), [("vertex", "vertices"), ("triangle", "triangles")])
def test_cells_on_a_whole_layer_and_more_hold_nothing(kind, what):
    for count, held in ((25, 25), (26, 0)):
        nodes = np.arange(count)
        rows = nodes[:, None] if kind == "vertex" else np.stack([nodes, nodes, np.roll(nodes, 1)], axis=1)
        embedded = found(source((kind, rows)))
        assert len(embedded.held) == held
        fate = "held" if held else "too many to be held, unless `fixed` says so"
        assert embedded.notes == (f"{fate}: {what} ({count} nodes)",)


def test_nodes_that_no_hexahedron_has_are_not_held():
    points = np.vstack([POINTS, [[2.0, 2.0, 2.0], [3.0, 3.0, 3.0]]])
    mesh = meshio.Mesh(points, [("hexahedron", CELLS), ("line", [[124, 125], [125, 126]]), ("vertex", [[126]])])
    assert found(mesh).held.tolist() == [124]
    assert_empty(found(meshio.Mesh(points, [("hexahedron", CELLS)], point_sets={"all": np.arange(127)})))


def test_cells_in_sets_that_are_no_faces_change_nothing_else():
    sets = {"odd": [np.array([0]), np.empty(0, int)], "gmsh:bounding_entities": [np.array([2]), np.array([3])]}
    embedded = found(source(("quad", [[5, 6, 7, 62], *WALL.tolist()]), cell_sets=sets))
    assert len(np.unique(embedded.kinds)) == 1
    assert not embedded.skin_kinds.any()


def test_edges_have_the_lower_id_first_whatever_the_cells():
    last = len(POINTS) - 1
    mesh = meshio.Mesh(POINTS[::-1], [("line", [[0, 1]]), ("hexahedron", last - CELLS)])
    assert found(mesh, last - SKIN).edges.tolist() == [[0, 1]]


def test_a_set_of_nodes_of_a_wall_has_an_outline():
    embedded = of_nodes(floor=Z == 0)
    assert same_partition(embedded.skin_kinds, FLOOR)
    assert (len(embedded.quads), len(embedded.edges), len(embedded.held)) == (0, 0, 0)
    assert embedded.notes == ("outlines on the boundary are kept of: node set 'floor' (16 quads)",)


def test_a_set_of_nodes_of_a_plane_inside_is_a_patch():
    embedded = of_nodes(wall=X == 0.5)
    assert same_sets(embedded.quads, WALL)
    assert not embedded.skin_kinds.any()
    assert len(embedded.edges) == len(embedded.held) == 0
    assert embedded.notes == ("kept as patches: node set 'wall' (16 quads)",)


def test_sets_of_nodes_that_overlap_are_refined():
    embedded = of_nodes(floor=Z == 0, left=(Z == 0) & (X <= 0.5), wall=X == 0.5, low=(X == 0.5) & (Z <= 0.5))
    assert same_partition(embedded.skin_kinds, FLOOR + 1 * (FLOOR & (centres(SKIN)[:, 0] < 0.5)))
    assert same_partition(embedded.kinds, centres(embedded.quads)[:, 2] < 0.5)


@pytest.mark.parametrize("part", [np.ones(len(POINTS), bool), np.zeros(len(POINTS), bool)])
def test_sets_of_all_nodes_and_of_none_say_nothing(part):
    assert_empty(of_nodes(all=part))


def test_a_set_of_a_region_says_no_more_than_its_faces_on_the_boundary():
    embedded = of_nodes(part=X <= 0.5)
    assert same_partition(embedded.skin_kinds, centres(SKIN)[:, 0] < 0.5)
    assert len(embedded.quads) == len(embedded.edges) == len(embedded.held) == 0


def test_a_choice_of_nodes_by_a_ball_holds_nothing():
    embedded = of_nodes(ball=np.linalg.norm(POINTS - 0.5, axis=1) < 0.45)
    assert_empty(embedded)


def test_nodes_that_form_a_chain_on_the_boundary_are_a_curve():
    rim = (X == 0.25) & (Z == 1)
    embedded = of_nodes(rim=rim)
    ids = np.flatnonzero(rim)
    assert same_sets(embedded.edges, np.stack([ids[1:], ids[:-1]], axis=1))
    assert len(embedded.held) == 0
    assert not embedded.skin_kinds.any()
    assert embedded.notes == ("kept as curves: node set 'rim' (4 edges)",)


def test_chains_may_meet():
    ends = (X % 1 == 0).astype(int) + (Y % 1 == 0) + (Z % 1 == 0)
    embedded = of_nodes(frame=ends >= 2)  # the twelve edges of the box
    assert len(embedded.edges) == 12 * 4
    assert len(embedded.held) == 0


def test_a_wall_with_a_chain_and_a_single_node_is_all_three():
    chain, single = (X == 0.5) & (Z == 1), (X == 1) & (Y == 0.5) & (Z == 0.75)
    embedded = of_nodes(mixed=(Z == 0) | chain | single)
    assert same_partition(embedded.skin_kinds, FLOOR)
    ids = np.flatnonzero(chain)
    assert same_sets(embedded.edges, np.stack([ids[1:], ids[:-1]], axis=1))
    assert embedded.held.tolist() == np.flatnonzero(single).tolist()
    assert len(embedded.notes) == 3


def test_single_nodes_are_held_on_the_boundary_and_inside():
    sensors = np.zeros(len(POINTS), bool)
    sensors[[0, 62, 124]] = True  # two corners and the centre
    embedded = of_nodes(sensors=sensors)
    assert embedded.held.tolist() == [0, 62, 124]
    assert embedded.notes == ("held: node set 'sensors' (3 nodes)",)


def test_neighbours_inside_that_make_up_no_face_are_held():
    star = np.linalg.norm(POINTS - 0.5, axis=1) < 0.3
    embedded = of_nodes(star=star)
    assert embedded.held.tolist() == np.flatnonzero(star).tolist()
    assert star.sum() == 7


def test_the_fringe_of_a_choice_on_the_boundary_is_neither_curve_nor_held():
    nodes = (Z == 1) & (X <= 0.5) & (Y <= 0.5)
    fringe = (Z == 1) & (X == 0.75) & (Y == 0.25)
    assert fringe.sum() == 1
    embedded = of_nodes(choice=nodes | fringe)
    assert (embedded.skin_kinds > 0).sum() == 4
    assert len(embedded.edges) == len(embedded.held) == 0


def test_fringes_that_meet_are_no_curve_either():
    i, j = np.rint(4 * X), np.rint(4 * Y)
    squares = ((i < 2) & (j < 2)) | ((i > 1) & (i < 4) & (j > 2))
    fringe = (j == 2) & ((i == 1) | (i == 2))
    embedded = of_nodes(choice=(Z == 1) & (squares | fringe))
    assert (embedded.skin_kinds > 0).sum() == 2
    assert len(embedded.edges) == len(embedded.held) == 0


def test_many_scattered_nodes_are_not_held_and_that_is_told():
    points, cells = generate.box((9, 9, 9))
    checks = np.rint(points * 9).sum(axis=1) % 2 == 0  # no two of them are neighbours
    mesh = hc.HexMesh(points, cells, {"checks": checks})
    embedded = find_embedded(mesh, boundary_quads(cells)[0])
    assert len(embedded.held) == 0
    assert embedded.notes == ("too many to be held, unless `fixed` says so: node set 'checks' (500 nodes)",)


@pytest.mark.parametrize(
    ("values", "counts"),
    [
        (Z == 0, True),
        ((Z == 0).astype(int), False),
        ((Z == 0).astype(np.uint8), False),
        ((Z == 0).astype(float), False),
        (np.stack([Z == 0, X == 0], axis=1), False),
    ],
)
def test_arrays_of_booleans_are_sets_of_nodes_and_no_others(values, counts):
    embedded = find_embedded(hc.HexMesh(POINTS, CELLS, {"floor": values}), SKIN)
    assert embedded.skin_kinds.any() == counts


def test_nothing_depends_on_the_order_of_cells_and_faces():
    rng = np.random.default_rng(1)
    sets = {"floor": Z == 0, "wall": X == 0.5, "rim": (Y == 0.25) & (Z == 1)}
    one = find_embedded(hc.HexMesh(POINTS, CELLS, sets), SKIN)
    order = rng.permutation(len(SKIN))
    other = find_embedded(hc.HexMesh(POINTS, CELLS[rng.permutation(len(CELLS))], sets), SKIN[order])
    assert same_sets(one.quads, other.quads)
    assert same_sets(one.edges, other.edges)
    assert same_partition(one.skin_kinds[order], other.skin_kinds)
    assert one.notes == other.notes


def test_cells_with_nodes_that_are_not_there_are_left_out():
    mesh = source(("quad", [[0, 1, 2, 999]]), ("line", [[-1, 0], [-999, 0]]), ("vertex", [[4000]]))
    embedded = found(mesh)
    assert embedded.held.tolist() == [0, 1, 2]
