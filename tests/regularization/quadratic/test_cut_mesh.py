"""Quadratic hexahedra cut into linear ones."""

import numpy as np
import pytest
from meshes.mixed import cut_into_pyramids, cut_into_tetrahedra, cut_up
from meshes.quadratic_cells import QUADRATIC, raised, shapes

import hexconformal as hc
from hexconformal.elements import EDGES, FACES, QUADRATIC_TYPES, cell_parts, cell_volumes
from hexconformal.geometry import edge_table
from hexconformal.mesh import boundary_quads, face_table
from hexconformal.mesh.face_rows import face_keys
from hexconformal.regularization.quadratic.cut_mesh import CutMesh

each_type = pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)
# Meshes of each linear type.
LINEAR = {
    "hexahedron": lambda: hc.as_volume_mesh(hc.generate.box((2, 2, 1))),
    "wedge": lambda: cut_up(*hc.generate.box((2, 2, 1)), np.full(4, "wedge")),
    "pyramid": lambda: cut_into_pyramids(*hc.generate.box((2, 2, 1))),
    "tetra": lambda: cut_into_tetrahedra(*hc.generate.box((2, 2, 1))),
}
each_number = pytest.mark.parametrize("nodes", [20, 27])


def bent(nodes, n=(2, 2, 1), amount=0.05):
    """A box of quadratic cells, all nodes of which are moved; seen from a shuffled numbering."""
    mesh = hc.elevated(hc.generate.box(n), nodes)
    rng = np.random.default_rng(2)
    points = mesh.points + rng.uniform(-amount, amount, mesh.points.shape)
    order = rng.permutation(len(points))
    name = f"hexahedron{nodes}"
    return hc.MixedMesh.of_types(points[order], {name: np.argsort(order)[mesh.blocks[0].cells]})


@each_number
@pytest.mark.parametrize("parts", [2, 4])
def test_nodes_of_parts_are_where_the_shape_functions_put_them(nodes, parts):
    mesh = bent(nodes)
    cut, block = CutMesh(mesh, parts), mesh.blocks[0]
    x = cut.places(mesh.points)
    np.testing.assert_array_equal(x[: len(mesh.points)], mesh.points)
    table = cell_parts(QUADRATIC_TYPES[f"hexahedron{nodes}"], parts)
    weights = shapes(QUADRATIC_TYPES[f"hexahedron{nodes}"], table.places)
    expected = np.einsum("qa,car->cqr", weights, mesh.points[block.cells])[:, table.cells].reshape(-1, 8, 3)
    np.testing.assert_allclose(x[cut.cells], expected, atol=1e-14)
    # Neighbours share their nodes: as many as a grid of parts has.
    assert cut.count == len(x) == np.prod(parts * np.array([2, 2, 1]) + 1)
    assert len(face_table(cut.cells).quads) == len(np.unique(np.sort(face_table(cut.cells).quads), axis=0))
    assert len(boundary_quads(cut.cells)[0]) == parts**2 * len(boundary_quads(mesh.table)[0])


@each_number
def test_shares_are_those_of_the_places(nodes):
    mesh = bent(nodes)
    cut = CutMesh(mesh, 4)
    chosen = np.random.default_rng(0).permutation(cut.count)[:50]
    np.testing.assert_allclose(cut.matrix(chosen) @ mesh.points, cut.places(mesh.points)[chosen], atol=1e-14)


@each_number
@pytest.mark.parametrize("kind", ["faces", "edges"])
def test_parts_of_faces_and_edges_lie_on_them(nodes, kind):
    mesh = bent(nodes)
    cut, table = CutMesh(mesh, 4), FACES if kind == "faces" else EDGES
    wanted = np.array([row[np.random.default_rng(1).permutation(len(row))] for row in mesh.table[1][table]])
    parts = getattr(cut, kind)(wanted)
    assert parts.each == (16 if kind == "faces" else 4)
    x = cut.places(mesh.points)
    corners = [np.unique(parts.nodes[parts.each * k : parts.each * (k + 1)]) for k in range(len(wanted))]
    assert all(np.isin(row, found).all() for row, found in zip(wanted, corners, strict=True))
    # On the grid of each the polynomials give back the nodes of the parts.
    u, v = np.moveaxis(parts.places, 2, 0)
    one, other = (np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1) for t in (u, v))
    grids = np.repeat(parts.grids, parts.each, axis=0)
    factors = one[:, :, :, None] * (other[:, :, None, :] if kind == "faces" else 1.0)
    np.testing.assert_allclose(np.einsum("pjab,pabr->pjr", factors, x[grids]), x[parts.nodes], atol=1e-14)
    np.testing.assert_array_equal(parts.matching(parts.nodes[::-1]), np.arange(len(parts.nodes))[::-1])


def test_parts_of_a_box_are_a_box():
    cut = CutMesh(hc.elevated(hc.generate.box((2, 1, 1)), 27), 4)
    linear = cut.linear()
    report = hc.quality(linear)
    np.testing.assert_allclose(report.volume, 1 / 64 / 2)
    np.testing.assert_allclose(report.scaled_jacobian, 1)
    assert len(edge_table(boundary_quads(linear.cells)[0]).nonmanifold) == 0


def test_types_that_do_not_fit_are_refused():
    fine = hc.elevated(hc.generate.box((1, 1, 1)), 27)
    coarse = hc.elevated(hc.generate.box((2, 1, 1)), 20)
    second = coarse.points[coarse.blocks[0].cells[1]]
    twenty_seven = fine.points * [0.5, 1, 1]
    points, ids = np.unique(np.concatenate([twenty_seven, second]).round(9), axis=0, return_inverse=True)
    cells = {"hexahedron27": ids[:27][fine.blocks[0].cells], "hexahedron20": ids[27:][None]}
    mesh = hc.MixedMesh.of_types(points, cells)
    with pytest.raises(hc.MeshError, match="faces of cells do not fit"):
        CutMesh(mesh, 4)


def different(faces):
    return np.unique(face_keys(faces), axis=0)


@pytest.mark.parametrize("parts", [2, 4])
@each_type
def test_parts_fill_the_cell_and_their_faces_look_out_of_it(cell_type, parts):
    table = cell_parts(cell_type, parts)
    assert len(table.cells) == parts**3 or cell_type.linear.name == "pyramid"
    x = table.reference @ (cell_type.ideal[cell_type.neighbours[0]] - cell_type.ideal[0])
    volumes = cell_volumes(x, table.cells)
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(cell_type.volume)
    # All that is outside is a part of a face, n^2 of each, and no place is inside another part's edge.
    quads = boundary_quads(table.cells)[0]
    np.testing.assert_array_equal(different(quads), different(table.faces.reshape(-1, 4)))
    for face, corners in zip(x[table.faces], cell_type.faces, strict=True):
        areas = np.cross(face[:, 2] - face[:, 0], face[:, 3] - face[:, 1]) / 2
        a, b, c, d = cell_type.ideal[[*corners, corners[-1]][:4]]
        np.testing.assert_allclose(areas.sum(axis=0), np.cross(c - a, d - b) / 2, atol=1e-14)
        assert (areas @ areas[0] > 0).all()


@each_type
def test_of_each_type_parts_of_faces_are_on_them_and_shared_by_neighbours(cell_type):
    name = cell_type.linear.name
    mesh, outside, _ = raised(LINEAR[name](), {name: len(cell_type.nodes)})
    points = mesh.points + np.random.default_rng(2).uniform(-0.01, 0.01, mesh.points.shape)
    mesh = mesh.replaced(points)
    cut = CutMesh(mesh, 4)
    x, quads = cut.places(points), boundary_quads(mesh.table)[0]
    np.testing.assert_allclose(hc.quality(cut.linear()).volume.sum(), hc.quality(mesh).volume.sum(), rtol=0.01)
    parts = cut.faces(quads)
    np.testing.assert_array_equal(different(parts.nodes), different(boundary_quads(cut.cells)[0]))
    # On the grid of each the polynomials give back the nodes of the parts.
    u, v = np.moveaxis(parts.places, 2, 0)
    one, other = (np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1) for t in (u, v))
    grids = np.repeat(parts.grid_points(x), parts.each, axis=0)
    np.testing.assert_allclose(np.einsum("pja,pjb,pabr->pjr", one, other, grids), x[parts.nodes], atol=1e-13)
    np.testing.assert_array_equal(parts.halves, quads[:, 2] == quads[:, 3])
    assert set(np.flatnonzero(outside)) == set(parts.grids[parts.grids >= 0].tolist()) & set(range(len(points)))
