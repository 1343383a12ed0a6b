"""Meshes of several types of cells, whose faces fit."""

import numpy as np
import pyvista as pv

from hexconformal.elements import HEXAHEDRON
from hexconformal.mesh import MixedMesh, blocks_of
from meshes.hexahedra import block


def four_types(amount=0.0, seed=0):
    """A row of three cubes: a hexahedron, six pyramids of which five are cut into tetrahedra, two wedges."""
    i = np.arange(16).reshape(4, 2, 2)
    points = np.stack(np.meshgrid(np.arange(4.0), np.arange(2.0), np.arange(2.0), indexing="ij"), -1).reshape(-1, 3)
    cubes = [[i[x + a, b, c] for a, b, c in HEXAHEDRON.ideal.astype(int)] for x in range(3)]
    points = np.vstack([points, [1.5, 0.5, 0.5]])
    pyramids, tetrahedra = [], []
    for number, face in enumerate(HEXAHEDRON.faces):
        a, b, c, d = (cubes[1][node] for node in face)
        if number < 2:  # towards the hexahedron and the wedges
            pyramids.append([d, c, b, a, 16])
        else:
            tetrahedra += [[a, c, b, 16], [a, d, c, 16]]
    c = cubes[2]
    # The triangles of the wedges lie in the faces across y, so that the middle cube sees a quadrilateral.
    wedges = [[c[0], c[4], c[1], c[3], c[7], c[2]], [c[4], c[5], c[1], c[7], c[6], c[2]]]
    cells = {"tetra": tetrahedra, "hexahedron": [cubes[0]], "wedge": wedges, "pyramid": pyramids}
    points += np.random.default_rng(seed).uniform(-amount, amount, points.shape)
    return MixedMesh.of_types(points, {name: np.array(rows) for name, rows in cells.items()})


def shuffled_grid(mesh, seed=0):
    """A pyvista grid of a mesh, its cells in any order and two quadrilaterals among them; (m,) rows of its cells."""
    cells, types = [], []
    for one in blocks_of(mesh):
        cells += one.cells.tolist()
        types += [one.cell_type.vtk] * len(one.cells)
    cells += [mesh.blocks[1].cells[0][:4].tolist()] * 2
    types += [9, 9]
    order = np.random.default_rng(seed).permutation(len(cells))
    table = np.concatenate([[len(cells[k]), *cells[k]] for k in order])
    return pv.UnstructuredGrid(table, np.array(types)[order], mesh.points)


def cut_block(n=3):
    """n^3 cubes, each cut into six tetrahedra around a diagonal."""
    points, cells = block(n)
    paths = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
    return MixedMesh.of_types(points, {"tetra": np.concatenate([cells[:, path] for path in paths])})
