"""The block matrix: what it leaves out."""

import numpy as np
import pytest
from meshes.hexahedra import off_boundary

from hexconformal import generate
from hexconformal.energy.block_matrix import Assembly, BlockMatrix, block_places


def test_matrices_leave_out_what_is_held():
    points, cells = generate.box((3, 3, 3))
    free = off_boundary(points, cells)
    matrix = BlockMatrix.of_cells(cells, free)
    assert matrix.indptr[-1] == len(matrix.indices) == 8 + 12 + 12  # nodes, edges, diagonals of faces of one cell
    assert (np.diff(matrix.indptr)[~free] == 0).all()
    assert (block_places(cells, free, matrix) >= 0).sum() == 8 * 8 + 12 * 4 + 12 * 2


@pytest.mark.parametrize("diagonals", [False, True])
def test_diagonals_of_cells_have_blocks_where_they_are_asked_for(diagonals):
    points, cells = generate.box((2, 1, 1))
    assembly = Assembly.of_cells(cells, np.ones(len(points), dtype=bool), diagonals)
    assert (assembly.places < 0).sum() == (0 if diagonals else 4 * len(cells))
    # Every place is that of its pair: the later node's row, the earlier one's column.
    matrix, pairs = assembly.matrix, [(a, b) for a in range(8) for b in range(a + 1)]
    rows = np.repeat(np.arange(len(points)), np.diff(matrix.indptr))
    for cell, places in zip(cells, assembly.places, strict=True):
        for (a, b), place in zip(pairs, places, strict=True):
            if place >= 0:
                assert (rows[place], matrix.indices[place]) == (max(cell[a], cell[b]), min(cell[a], cell[b]))
