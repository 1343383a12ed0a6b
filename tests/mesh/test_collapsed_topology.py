"""Faces, boundary and depths of meshes in which cells of other types are collapsed hexahedra."""

import numpy as np
import pytest
from meshes.mixed import collapsed_tables, cut_block, jittered_inside, mixed_block

from hexconformal import HexMesh
from hexconformal.elements import CELL_TYPES, cell_volumes, collapsed_cells
from hexconformal.generate import box
from hexconformal.geometry import Faces, edge_table, enclosed_volume, face_area_vectors, find_features, hausdorff
from hexconformal.geometry.features.crack_fronts import crack_fronts
from hexconformal.mesh import (
    boundary_quads,
    collapsed_mesh,
    face_table,
    turned_over,
    with_wedges_upright,
)
from hexconformal.mesh.topology import boundary_depths


def test_a_mirrored_neighbour_is_seen_across_triangles_too():
    mesh = cut_block(1)
    cells = collapsed_mesh(mesh).cells.copy()
    cells[2] = collapsed_cells(mesh.blocks[0].cells[2:3][:, [0, 2, 1, 3]], CELL_TYPES["tetra"])[0]
    table = face_table(cells)
    touching = (table.counts == 2) & (table.cells == 2).any(axis=1)
    assert touching.sum() >= 2
    np.testing.assert_array_equal(table.orientation[table.counts == 2] == -1, touching[table.counts == 2])


def test_the_boundary_has_triangles_first_and_encloses_the_cells():
    points, cells = collapsed_tables()
    quads, owners = boundary_quads(cells)
    triangles = quads[:, 2] == quads[:, 3]
    assert triangles[: triangles.sum()].all()
    assert 0 < triangles.sum() < len(quads)
    assert (cells[owners][:, None, :] == quads[:, :, None]).any(axis=2).all()
    faces = Faces.of(quads)
    assert (len(faces.triangles), len(faces.quads)) == (triangles.sum(), (~triangles).sum())
    assert enclosed_volume(points, quads) == pytest.approx(cell_volumes(points, cells).sum(), rel=1e-12)
    assert (edge_table(faces).counts == 2).all()
    assert hausdorff(points + [0.0, 0.0, 0.3], points, quads) == pytest.approx(0.3, rel=1e-6)


def test_area_vectors_of_faces_in_any_order():
    points, cells = collapsed_tables()
    quads, _ = boundary_quads(cells)
    order = np.random.default_rng(0).permutation(len(quads))
    found, expected = face_area_vectors(points, quads[order]), face_area_vectors(points, Faces.of(quads))[order]
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_tables_with_triangles_behind_are_refused():
    with pytest.raises(ValueError, match="triangles must come"):
        Faces.of(np.array([[0, 1, 2, 3], [4, 5, 6, 6]]))


def test_a_face_turned_over_has_its_normal_the_other_way():
    points = np.random.default_rng(0).normal(size=(4, 3))
    for face in (np.array([[0, 1, 2, 2]]), np.array([[0, 1, 2, 3]]), np.array([[0, 1, 2]])):
        np.testing.assert_allclose(
            face_area_vectors(points, turned_over(face)), -face_area_vectors(points, face), rtol=1e-14
        )


def test_depths_are_those_of_the_cells_behind():
    for name, cell_type in CELL_TYPES.items():
        if name == "hexahedron":
            continue
        cells = collapsed_cells(np.arange(len(cell_type.nodes))[None], cell_type)
        quads, _ = boundary_quads(cells)
        x = cell_type.ideal
        inside = [np.setdiff1d(np.arange(len(x)), face) for face in quads]
        normals = np.cross(x[quads[:, 2]] - x[quads[:, 0]], x[quads[:, 3]] - x[quads[:, 1]])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        deepest = [
            np.abs((x[nodes] - x[face[0]]) @ normal).max()
            for nodes, face, normal in zip(inside, quads, normals, strict=True)
        ]
        np.testing.assert_allclose(boundary_depths(x, cells, *boundary_quads(cells)), deepest, rtol=1e-12)


def test_a_box_of_all_types_has_its_twelve_edges_and_no_crack():
    mesh = collapsed_mesh(mixed_block(2))
    quads, _ = boundary_quads(mesh.cells)
    features = find_features(mesh.points, quads, cells=mesh.cells)
    assert (len(np.unique(features.curves)), len(features.corners), features.soft) == (12, 8, False)


def test_a_slit_between_tetrahedra_has_a_front():
    # Two layers of cubes, cut into tetrahedra, that do not hang together on one half of the plane between them.
    block = collapsed_mesh(cut_block(2))
    points, cells = block.points, block.cells.copy()
    low = points.min(axis=0)
    size = np.ptp(points, axis=0)
    x = (points - low) / size
    slit = np.flatnonzero((np.abs(x[:, 2] - 0.5) < 1e-9) & (x[:, 0] < 0.4))
    above = x[cells].mean(axis=1)[:, 2] > 0.5
    new = np.arange(len(points))
    new[slit] = len(points) + np.arange(len(slit))
    cells[above] = new[cells[above]]
    points = np.concatenate([points, points[slit]])
    quads, _ = boundary_quads(cells)
    edges = edge_table(quads)
    found = edges.nodes[edges.manifold[crack_fronts(points, quads, edges, cells)]]
    middle = (points[found] - low) / size
    assert len(found) == 2
    np.testing.assert_allclose(middle[:, :, 0], 0.5)
    np.testing.assert_allclose(middle[:, :, 2], 0.5)


def test_wedges_are_taken_upright_whichever_way_they_come():
    mesh = jittered_inside(mixed_block(2), 0.1)
    wedge = next(k for k, block in enumerate(mesh.blocks) if block.cell_type.name == "wedge")
    turned = {block.cell_type.name: block.cells for block in mesh.blocks}
    turned["wedge"] = turned["wedge"][:, [3, 4, 5, 0, 1, 2]]
    other = type(mesh).of_types(mesh.points, turned)
    np.testing.assert_array_equal(collapsed_mesh(other).cells, collapsed_mesh(mesh).cells)
    assert with_wedges_upright(mesh).blocks[wedge].cells is mesh.blocks[wedge].cells


def test_a_hexahedral_mesh_is_its_own_table():
    mesh = HexMesh(*box((2, 1, 1)))
    assert collapsed_mesh(mesh) is mesh
