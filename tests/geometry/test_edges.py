"""Edges of triangles and quadrilaterals, and the faces beside them, against dictionaries."""

from collections import defaultdict

import numpy as np
import pytest
from meshes.surfaces import icosphere, mixed_sphere, no_cells, quad_sphere

from hexconformal.geometry import Faces, edge_table


def beside(faces):
    """The faces at each edge, and in which direction each runs along it."""
    found = defaultdict(list)
    for number, nodes in enumerate([*faces.triangles.tolist(), *faces.quads.tolist()]):
        for a, b in zip(nodes, nodes[1:] + nodes[:1], strict=True):
            found[min(a, b), max(a, b)].append((number, a < b))
    return found


@pytest.mark.parametrize("surface", [icosphere(1), quad_sphere(3), mixed_sphere(3)])
def test_every_edge_comes_once_with_its_faces(surface):
    faces = surface[1]
    # One triangle is turned round, and one face is missing.
    triangles = faces.triangles.copy()
    triangles[:1] = triangles[:1, ::-1]
    faces = Faces(triangles[: len(triangles) - (len(faces.quads) == 0)], faces.quads[:-1])
    table, expected = edge_table(faces), beside(faces)
    assert table.nodes.tolist() == [list(edge) for edge in sorted(expected)]
    assert table.counts.tolist() == [len(expected[edge]) for edge in sorted(expected)]
    for edge, sides, opposed in zip(table.nodes[table.manifold], table.sides, table.opposed, strict=True):
        (one, forward), (other, back) = expected[tuple(edge.tolist())]
        assert sides.tolist() == [one, other]
        assert opposed == (forward != back)
    assert len(table.nonmanifold) + len(table.manifold) == len(expected)
    # The table tells the edge behind each corner.
    behind = faces.corners[faces.around(1)]
    np.testing.assert_array_equal(np.sort([faces.corners, behind], axis=0).T, table.nodes[table.of_corners])
    rows = zip(table.of_faces(faces), (faces.triangles, faces.quads), strict=True)
    for edges, nodes in rows:
        np.testing.assert_array_equal(table.nodes[edges][:, 0], np.sort(nodes[:, :2], axis=1))


def test_faces_of_more_than_one_kind_are_numbered_triangles_first():
    faces = Faces(np.array([[0, 1, 2], [2, 1, 3]]), np.array([[1, 4, 5, 3]]))
    assert faces.owners.tolist() == [0] * 3 + [1] * 3 + [2] * 4
    assert faces.around(-1).tolist() == [2, 0, 1, 5, 3, 4, 9, 6, 7, 8]
    assert faces.any_of(np.arange(6) == 3).tolist() == [False, True, True]
    assert faces.corners_of(np.array([True, False, True])).tolist() == [0, 1, 2, 1, 4, 5, 3]
    assert faces.over_corners(np.maximum, faces.corners).tolist() == [2, 3, 5]
    assert edge_table(Faces(faces.triangles, no_cells(4))).counts.tolist() == [1, 1, 2, 1, 1]
