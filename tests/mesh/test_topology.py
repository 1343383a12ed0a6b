"""Faces, boundaries and pieces of connected cells."""

import numpy as np
import pytest
from meshes.hexahedra import block

from hexconformal.elements.hexahedron import FACES
from hexconformal.mesh.topology import boundary_quads, components, face_table


def shuffled(k, seed=0):
    rng = np.random.default_rng(seed)
    points, cells = block(k)
    names = rng.permutation(len(points))
    moved = np.empty_like(points)
    moved[names] = points
    return moved, names[cells][rng.permutation(len(cells))]


def test_boundary_quads_against_counting_sets():
    points, cells = shuffled(4)
    quads, owners = boundary_quads(cells)
    seen = {}
    for number, cell in enumerate(cells.tolist()):
        for face in FACES.tolist():
            seen.setdefault(frozenset(cell[i] for i in face), []).append(number)
    expected = {nodes: cells[0] for nodes, cells in seen.items() if len(cells) == 1}
    assert {frozenset(quad): owner for quad, owner in zip(quads.tolist(), owners.tolist(), strict=True)} == expected
    assert (np.diff(owners) >= 0).all()
    # Outward: the vector areas enclose the volume, and each points away from its cell.
    corners = points[quads]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
    assert np.einsum("ij,ij", normals, corners.mean(axis=1)) / 3 == pytest.approx(64)
    out = corners.mean(axis=1) - points[cells[owners]].mean(axis=1)
    assert (np.einsum("ij,ij->i", normals, out) > 0).all()


def test_face_table_pairs_neighbours():
    _, cells = shuffled(3)
    cells[7] = cells[7, [4, 5, 6, 7, 0, 1, 2, 3]]
    table = face_table(cells)
    assert len(table.quads) == 3 * 3 * 3 * 4
    assert (table.uses == 2).sum() == 54
    for quad, (one, other), turn in zip(table.quads, table.cells, table.orientation, strict=True):
        assert set(quad) <= set(cells[one])
        if other < 0:
            assert turn == 0
        else:
            assert set(quad) <= set(cells[other])
            assert turn == (-1 if 7 in (one, other) else 1)


def test_components_number_the_pieces_in_order():
    _, cells = block(2)
    count, labels = components(np.vstack([cells + 27, cells, cells + 54])[[0, 8, 16, 1, 9, 17]])
    assert count == 3
    assert labels.tolist() == [0, 1, 2, 0, 1, 2]
    _, shuffled_cells = shuffled(3)
    assert components(shuffled_cells)[0] == 1
