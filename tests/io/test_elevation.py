"""Linear hexahedra made quadratic, and quadratic ones in files."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import block, jittered_box

import hexconformal as hc
from hexconformal.mesh import boundary_quads

each_number = pytest.mark.parametrize("nodes", [20, 27])


@each_number
def test_the_shape_stays_and_nodes_are_shared(nodes):
    points, cells = jittered_box(3)
    mesh = hc.elevated((points, cells), nodes)
    # A grid of 3 cells a side has 4^3 nodes, 3 (3 4^2) edges, 3 (3^2 4) faces.
    assert len(mesh.points) == 64 + 144 + (108 + 27 if nodes == 27 else 0)
    np.testing.assert_array_equal(mesh.points[:64], points)
    np.testing.assert_array_equal(mesh.blocks[0].cells[:, :8], cells)
    assert len(np.unique(mesh.cells)) == len(mesh.points)
    assert [finding.kind for finding in hc.check(mesh)] == ["higher order"]
    np.testing.assert_allclose(hc.quality(mesh).volume, hc.quality((points, cells)).volume, rtol=1e-13)


def test_arrays_come_along():
    points, cells = block(2)
    mask = points[:, 0] == 0
    mesh = hc.HexMesh(
        points, cells, {"height": points[:, 2], "v": points, "side": mask, "tag": np.full(27, 5)}, {"p": np.arange(8)}
    )
    raised = hc.elevated(mesh, 27)
    np.testing.assert_allclose(raised.point_data["height"], raised.points[:, 2], atol=1e-15)
    np.testing.assert_allclose(raised.point_data["v"], raised.points, atol=1e-15)
    np.testing.assert_array_equal(raised.point_data["side"], raised.points[:, 0] == 0)
    assert raised.point_data["side"].dtype == bool
    assert set(raised.point_data["tag"]) == {5}
    np.testing.assert_array_equal(raised.cell_data["p"], mesh.cell_data["p"])


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.complex64])
def test_the_largest_number_stays_what_it_is_between_corners(kind):
    points, cells = block(1)
    largest = np.full(8, np.finfo(kind).max, dtype=kind)
    raised = hc.elevated(hc.HexMesh(points, cells, {"none": largest}), 27).point_data["none"]
    assert raised.dtype == kind
    np.testing.assert_array_equal(raised, largest[0])


def test_what_is_not_linear_is_refused():
    with pytest.raises(hc.OptionError, match="must be 20 or 27, not 21"):
        hc.elevated(block(1), 21)
    with pytest.raises(hc.MeshError, match="must be linear, and there are 1 hexahedron of 20"):
        hc.elevated(hc.elevated(block(1), 20), 27)


def test_cells_that_have_no_order_two_are_refused():
    points, cells = block(1)
    with pytest.raises(hc.MeshError, match=r"outside 0\.\.7: 1 \(ids 0\); ids start at 1 here, subtract 1"):
        hc.elevated((points, cells + 1))
    with pytest.raises(hc.MeshError, match=r"outside 0\.\.7: 1 \(ids 0\)"):
        hc.elevated((points, cells - 1))
    wedge = cells[:, [0, 1, 2, 2, 4, 5, 6, 6]]
    with pytest.raises(hc.MeshError, match=r"a repeated node, such as wedges, have no order 2 here: 1 \(ids 1\)"):
        hc.elevated((points, np.concatenate([cells, wedge])))


@pytest.mark.parametrize(
    ("nodes", "extension"),
    [(20, "vtu"), (20, "vtk"), (20, "inp"), (20, "e"), (20, "msh"), (20, "med"), (20, "bdf"), (20, "xdmf")]
    + [(27, "vtu"), (27, "vtk"), (27, "e"), (27, "msh"), (27, "xdmf")],
)
def test_files_keep_the_order_of_nodes(nodes, extension, tmp_path):
    mesh = hc.elevated(jittered_box(2), nodes)
    mesh = mesh.replaced(mesh.points + np.random.default_rng(0).uniform(-0.02, 0.02, mesh.points.shape))
    hc.write(tmp_path / f"curved.{extension}", mesh)
    back = hc.quality(tmp_path / f"curved.{extension}")
    np.testing.assert_allclose(back.minimum_jacobian, hc.quality(mesh).minimum_jacobian, atol=1e-9)
    assert list(back.by_type()) == [f"hexahedron{nodes}"]


def test_a_deck_of_abaqus(tmp_path):
    # Nodes as the manual numbers them: bottom, top, then in the middle of bottom, top and vertical edges.
    x = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    x += [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
    x += [(-0.5, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    rows = "".join(f"{n + 11}, {a}, {b}, {c}\n" for n, (a, b, c) in enumerate(x))
    nodes = ", ".join(str(n + 11) for n in range(15)) + ",\n" + ", ".join(str(n + 26) for n in range(5))
    path = tmp_path / "deck.inp"
    path.write_text(f"*NODE\n{rows}*ELEMENT, TYPE=C3D20R\n77, {nodes}\n")
    measured = hc.quality(path)
    assert measured.labels.tolist() == [77]
    assert measured.valid.all()
    # One vertical edge bulges out by .5: faces beside it gain a third of .5 * 4 z (1 - z), of which 2/3 on average.
    assert measured.volume[0] == pytest.approx(8 + 0.5 * 2 * (2 / 3) * 2 / 2, rel=1e-12)


def _with_company():
    """Two cells a side, with the faces, an edge and a set of one side, a quadrilateral and a triangle across a cell."""
    points, cells = block(2)
    side = np.flatnonzero(points[:, 0] == 0.0)
    quads = boundary_quads(cells)[0]
    quads = quads[(points[quads, 0] == 0.0).all(axis=1)]
    across = [cells[0, [0, 1, 6, 7]]]
    return meshio.Mesh(
        points,
        [("hexahedron", cells), ("quad", np.concatenate([quads, across])), ("line", quads[:1, :2])]
        + [("triangle", quads[:1, :3])],
        point_data={"tag": np.arange(27)},
        cell_data={"n": [np.arange(8), np.arange(5), np.array([7]), np.array([9])]},
        point_sets={"side": side},
        cell_sets={"some": [np.array([1, 3]), np.array([0, 4]), np.array([0]), np.array([], dtype=int)]},
    )


@each_number
def test_sets_and_faces_come_along(nodes):
    source = _with_company()
    mesh = hc.elevated(source, nodes)
    out = mesh.to_source_type()
    types = [block.type for block in out.cells]
    assert types == [f"hexahedron{nodes}", "quad8" if nodes == 20 else "quad9", "quad", "line3", "triangle"]
    # A side of two by two faces has 9 corners, 12 edges and 4 faces.
    side = np.flatnonzero(out.points[:, 0] == 0.0)
    assert len(side) == (21 if nodes == 20 else 25)
    np.testing.assert_array_equal(out.point_sets["side"], side)
    faces, line = out.points[out.cells[1].data], out.points[out.cells[3].data[0]]
    np.testing.assert_allclose(faces[:, 4:8], (faces[:, :4] + np.roll(faces[:, :4], -1, axis=1)) / 2)
    np.testing.assert_allclose(faces[:, 8:], faces[:, None, :4].mean(axis=2)[:, : nodes == 27])
    np.testing.assert_allclose(line[2], line[:2].mean(axis=0))
    assert all(np.isin(out.cells[number].data, mesh.cells).all() for number in (1, 3))
    assert [part.tolist() for part in out.cell_data["n"]] == [list(range(8)), [0, 1, 2, 3], [4], [7], [9]]
    assert [np.asarray(part).tolist() for part in out.cell_sets["some"]] == [[1, 3], [0], [0], [0], []]
    told = " ".join(mesh.notes)
    assert "1 quad cells, no faces of solid ones, stay as they are" in told
    assert "1 triangle cells, no faces of solid ones, stay as they are" in told
    assert f"point array 'tag' is 0 at {len(out.points) - 27} nodes between corners where it differs" in told
    assert source.cells[1].type == "quad", "what was handed in stays"
    np.testing.assert_array_equal(mesh.origin.cell_groups["some"], np.isin(np.arange(8), [1, 3]))


def test_sets_of_the_boundary_stay_there():
    points, cells = block(1)
    mesh = hc.elevated(meshio.Mesh(points, [("hexahedron", cells)], point_sets={"all": np.arange(8)}), 27)
    assert len(mesh.to_source_type().point_sets["all"]) == 26
    inside = np.array([13])
    points, cells = block(2)
    mesh = hc.elevated(
        meshio.Mesh(points, [("hexahedron", cells)], point_sets={"all": np.arange(27), "in": inside}), 27
    )
    found = mesh.to_source_type().point_sets
    assert len(found["all"]) == 125
    np.testing.assert_array_equal(found["in"], inside)


def test_partners_have_partners_between_them():
    points, cells = block(2)
    low, high = (np.flatnonzero(points[:, 0] == x) for x in (points[:, 0].min(), points[:, 0].max()))
    link = [2, (1, 2), None, np.column_stack([high, low])]
    source = meshio.Mesh(points, [("hexahedron", cells)], gmsh_periodic=[link])
    mesh = hc.elevated(source, 27)
    (pairs,) = mesh.origin.coupled_pairs
    ways = mesh.points[pairs.nodes[:, 0]] - mesh.points[pairs.nodes[:, 1]]
    assert len(ways) == 25
    np.testing.assert_allclose(ways, ways[:1].repeat(25, axis=0), atol=1e-15)


def test_partners_that_are_replaced_are_none_any_more():
    points, cells = block(2)
    low, high = (np.flatnonzero(points[:, 0] == x) for x in (points[:, 0].min(), points[:, 0].max()))
    link = [2, (1, 2), None, np.column_stack([high, low])]
    curved = hc.elevated(meshio.Mesh(points, [("hexahedron", cells)], gmsh_periodic=[link]), 27).to_source_type()
    assert len(curved.gmsh_periodic[0][-1]) == 25
    mesh = hc.elevated(hc.as_hex_mesh(curved, linearize=True), 20)
    (pairs,) = mesh.origin.coupled_pairs
    ways = mesh.points[pairs.nodes[:, 0]] - mesh.points[pairs.nodes[:, 1]]
    # A side of two by two faces has 9 corners and 12 edges.
    assert len(np.unique(pairs.nodes, axis=0)) == len(ways) == 21
    np.testing.assert_allclose(ways, ways[:1].repeat(21, axis=0), atol=1e-15)
    np.testing.assert_array_equal(mesh.to_source_type().gmsh_periodic[0][-1], pairs.nodes)


@each_number
def test_where_partners_have_no_edge_between_them_there_is_no_further_pair(nodes):
    points, cells = block(1)
    own = cells[0]
    pairs = own[[[0, 4], [1, 6]]]  # an edge, and the diagonal of a face
    source = meshio.Mesh(points, [("hexahedron", cells)], gmsh_periodic=[[2, (1, 2), None, pairs]])
    (found,) = hc.elevated(source, nodes).origin.coupled_pairs
    np.testing.assert_array_equal(found.nodes, pairs)


def test_a_set_that_loses_nodes_between_corners_is_told():
    curved = hc.elevated(block(2), 20)
    middles, side = np.arange(27, 81), np.flatnonzero(curved.points[:, 0] == curved.points[:, 0].min())
    source = meshio.Mesh(
        curved.points, [("hexahedron20", curved.blocks[0].cells)], point_sets={"middles": middles, "side": side}
    )
    mesh = hc.elevated(hc.as_hex_mesh(source, linearize=True), 27)
    found = mesh.to_source_type().point_sets
    assert len(found["middles"]) == 0
    assert len(found["side"]) == 25
    assert "point set 'middles' has 54 nodes fewer, as not all of their corners are in it" in mesh.notes
    assert not any("'side'" in note for note in mesh.notes)


@pytest.mark.parametrize("kind", ["meshio", "pyvista"])
def test_nodes_that_came_between_corners_give_way(kind):
    curved = hc.elevated(_with_company() if kind == "meshio" else _grid(), 20)
    source = curved.to_source_type()
    again = hc.elevated(hc.as_hex_mesh(source, linearize=True), 27)
    assert len(again.points) == 125
    assert set(again.cells) == set(range(125))
    assert "54 nodes between corners that came are replaced" in " ".join(again.notes)
    lines = again.origin.carried_cells(2).nodes
    quads = again.origin.carried_cells(4).nodes
    assert len(lines) == 1
    assert len(quads) == 5
    assert hc.quality(again).volume.sum() == pytest.approx(hc.quality(curved).volume.sum())


def _grid():
    mesh = _with_company()
    flat = np.concatenate([np.insert(b.data, 0, b.data.shape[1], axis=1).ravel() for b in mesh.cells])
    codes = {"hexahedron": 12, "quad": 9, "line": 3, "triangle": 5}
    types = np.concatenate([np.full(len(b.data), codes[b.type]) for b in mesh.cells])
    grid = pv.UnstructuredGrid(flat, types, mesh.points)
    grid.point_data["x"] = mesh.points[:, 0]
    grid.cell_data["n"] = np.concatenate(mesh.cell_data["n"])
    grid.field_data["about"] = np.array([1.5])
    return grid


def test_a_grid_stays_one():
    out = hc.elevated(_grid(), 27).to_source_type()
    assert isinstance(out, pv.UnstructuredGrid)
    assert out.celltypes.tolist() == [29] * 8 + [28] * 4 + [9, 21, 5]
    np.testing.assert_allclose(out.point_data["x"], out.points[:, 0], atol=1e-15)
    np.testing.assert_array_equal(out.cell_data["n"], _grid().cell_data["n"])
    assert out.field_data["about"].tolist() == [1.5]


@pytest.mark.parametrize("extension", ["inp", "e", "vtu", "msh"])
def test_files_have_sets_and_faces_of_order_two(extension, tmp_path):
    source = _with_company()
    source.cells[1].data = source.cells[1].data[:4]
    source.cells, source.point_data, source.cell_data = source.cells[:3], {}, {}
    source.cell_sets = {"some": [np.array([1, 3]), np.array([], dtype=int), np.array([], dtype=int)]}
    path = tmp_path / f"linear.{extension}"
    told = hc.write(path, hc.as_hex_mesh(source))
    raised = hc.elevated(path, 20)
    more = hc.write(tmp_path / f"curved.{extension}", raised)
    back = hc.as_volume_mesh(tmp_path / f"curved.{extension}")
    assert len(back.points) == 81
    np.testing.assert_allclose(hc.quality(back).volume, hc.quality(raised).volume)
    for corners, count in ((2, 1), (4, 4)):
        assert len(back.origin.carried_cells(corners).nodes) == count
    sets = {"side": 21} if extension in ("inp", "e") else {}
    assert {name: mask.sum() for name, mask in back.origin.node_sets.items()} == sets
    if extension in ("inp", "e"):
        assert back.origin.cell_groups["some"].tolist() == [False, True, False, True, False, False, False, False]
    elif extension == "vtu":
        assert np.count_nonzero(back.point_data["side"]) == 21
        assert np.count_nonzero(back.cell_data["some"]) == 2
    else:
        assert {"point set 'side'", "cell set 'some'"} <= set(told)
    assert all("all of the file" in text or "integer type" in text or "type of elements" in text for text in more)


def test_elements_with_reduced_integration_keep_it(tmp_path):
    path = tmp_path / "linear.inp"
    hc.write(path, hc.generate.box((3, 1, 1)))
    head, body = path.read_text().split("*ELEMENT, TYPE=C3D8\n")
    first, second, third = body.strip().splitlines()
    ends = [f"*ELEMENT, TYPE=C3D8R\n{first}", f"*ELEMENT, TYPE=C3D8I\n{second}", f"*ELEMENT, TYPE=C3D8R\n{third}"]
    ends += ["*ELEMENT, TYPE=S4\n9, 1, 2, 6, 5", "*ELEMENT, TYPE=MASS, ELSET=M\n10, 1\n"]
    path.write_text(head + "\n".join(ends))
    raised = hc.elevated(path, 20)
    assert not any("stay in the deck" in note for note in raised.notes)
    told = hc.write(tmp_path / "curved.inp", raised)
    lines = (tmp_path / "curved.inp").read_text().splitlines()
    starts = {line.split("=")[1]: lines[k + 1 :] for k, line in enumerate(lines) if line.startswith("*ELEMENT")}
    assert list(starts) == ["C3D20R", "C3D20", "S8R"]
    assert [int(starts[name][0].split(",")[0]) for name in starts] == [1, 2, 9]
    assert int(starts["C3D20R"][2].split(",")[0]) == 3
    changed = [f"the type of elements {old} (now {new})" for old, new in (("C3D8R", "C3D20R"), ("S4", "S8R"))]
    assert set(changed) <= set(told)
    assert any("1 elements of type MASS" in text for text in told)
    assert np.abs(hc.as_volume_mesh(tmp_path / "curved.inp").points - raised.points).max() == 0.0


def test_labels_go_on(tmp_path):
    points, cells = block(1)
    rows = "".join(f"{10 * n + 5}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(points))
    path = tmp_path / "deck.inp"
    path.write_text(f"*NODE\n{rows}*ELEMENT, TYPE=C3D8\n9, {', '.join(str(10 * n + 5) for n in cells[0])}\n*MATERIAL\n")
    mesh = hc.elevated(path)
    assert mesh.node_labels.tolist() == [*range(5, 85, 10), *range(76, 88)]
    assert mesh.cell_labels.tolist() == [9]
    told = hc.write(tmp_path / "curved.inp", mesh)
    assert "1 *MATERIAL of the abaqus file" in told
    again = hc.as_volume_mesh(tmp_path / "curved.inp")
    np.testing.assert_array_equal(again.node_labels, mesh.node_labels)


def test_a_cell_in_two_groups_is_kept_or_told(tmp_path):
    points, cells = block(2)
    source = meshio.Mesh(
        points,
        [("hexahedron", cells)],
        cell_data={"gmsh:physical": [np.ones(8, dtype=int)]},
        field_data={"body": np.array([1, 3]), "half": np.array([2, 3])},
        cell_sets={"body": [np.arange(8)], "half": [np.arange(4)]},
    )
    assert hc.write(tmp_path / "a.msh", source) == ["cell set 'half'"]
    assert hc.write(tmp_path / "a.e", source) == []
    assert hc.as_hex_mesh(tmp_path / "a.e").cell_groups()["half"].sum() == 4


def _bent(kind, nodes):
    """A mesh whose nodes between corners are elsewhere, as an object of a kind."""
    mesh = hc.elevated(block(2), nodes)
    points = mesh.points + np.random.default_rng(0).uniform(-0.03, 0.03, mesh.points.shape)
    cells = mesh.blocks[0].cells
    return {
        "meshio": lambda: meshio.Mesh(points, [(f"hexahedron{nodes}", cells)]),
        "pyvista": lambda: pv.UnstructuredGrid({{20: 25, 27: 29}[nodes]: cells}, points),
        "arrays": lambda: (points, {f"hexahedron{nodes}": cells}),
        "ours": lambda: mesh.replaced(points),
        "taken in": lambda: hc.as_volume_mesh(meshio.Mesh(points, [(f"hexahedron{nodes}", cells)])),
    }[kind](), points


KINDS = ["meshio", "pyvista", "arrays", "ours", "taken in"]


@each_number
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_stays_curved(kind, nodes, tmp_path):
    source, points = _bent(kind, nodes)
    assert hc.write(tmp_path / "curved.vtu", source) == []
    np.testing.assert_array_equal(hc.as_volume_mesh(tmp_path / "curved.vtu").points, points)


@each_number
@pytest.mark.parametrize("kind", KINDS)
def test_every_mesh_can_be_taken_by_its_corners(kind, nodes):
    source, points = _bent(kind, nodes)
    linear = hc.as_hex_mesh(source, linearize=True)
    np.testing.assert_array_equal(linear.points, points)
    np.testing.assert_array_equal(linear.cells, hc.elevated(block(2), nodes).blocks[0].cells[:, :8])
    assert "edges straightened" in " ".join(linear.notes)
    back = hc.as_volume_mesh(linear.to_source_type())
    assert isinstance(back, hc.MixedMesh)
    straight = hc.elevated((points[:27], linear.cells), nodes)
    np.testing.assert_allclose(hc.quality(back).volume, hc.quality(straight).volume, rtol=1e-12)
    assert hc.as_volume_mesh(linear, linearize=True) is linear
    assert len(hc.elevated(linear, 27).points) == 125


def test_the_way_to_take_corners_is_told():
    with pytest.raises(hc.MeshError, match=r"there are 8 hexahedra of 20 nodes: linearize=True"):
        hc.elevated(hc.elevated(block(2), 20), 27)
