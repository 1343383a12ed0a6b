"""Meshes as libraries and files hold them: other cells beside the hexahedra, arrays of all kinds, curved cells."""

import meshio
import numpy as np
import pyvista as pv

from hexconformal import as_hex_mesh, generate
from hexconformal.io.convert import to_pyvista
from meshes.hexahedra import block


def mixed_meshio():
    """Quads, hexahedra, lines, hexahedra again, a vertex; an unreferenced point; data, sets and tags of all sorts."""
    points, cells = block(2)
    points = np.vstack([points, [[9, 9, 9]]])
    blocks = [
        ("quad", cells[:3, :4]),
        ("hexahedron", cells[:5]),
        ("line", cells[:2, :2]),
        ("hexahedron", cells[5:]),
        ("vertex", np.array([[27]])),
    ]
    sizes = [len(nodes) for _, nodes in blocks]
    return meshio.Mesh(
        points,
        blocks,
        point_data={"T": np.linspace(0, 1, 28), "v": np.arange(84.0).reshape(28, 3)},
        cell_data={
            "gmsh:physical": [np.full(size, 10 + j) for j, size in enumerate(sizes)],
            "p": [np.arange(size) + 0.5 for size in sizes],
        },
        field_data={"fluid": np.array([11, 3])},
        point_sets={"inlet": np.array([0, 5])},
        cell_sets={"some": [np.array([1]), np.array([0, 4]), np.array([], int), np.array([2]), np.array([], int)]},
    )


def mixed_grid():
    """An unstructured grid whose hexahedra and quadrilaterals alternate."""
    points, cells = block(2)
    flat, types = [], []
    for cell in cells:
        flat += [8, *cell, 4, *cell[:4]]
        types += [12, 9]
    grid = pv.UnstructuredGrid(np.array(flat), np.array(types), points.astype(np.float32))
    grid.cell_data["id"] = np.arange(16)
    grid.point_data["v"] = points
    grid.field_data["units"] = ["mm"]
    return grid


def cube_beside_pyramid():
    """An unstructured grid of a hexahedron and a pyramid on it."""
    points, cells = generate.box((1, 1, 1))
    nodes = np.concatenate([[8], cells[0], [5], cells[0][4:], [8]])
    return pv.UnstructuredGrid(nodes, [12, 14], np.concatenate([points, [[0.5, 0.5, 2.0]]]))


def awkward_mesh():
    """A distorted block with an unreferenced point, quads, and arrays of every kind."""
    points, cells = block(2)
    rng = np.random.default_rng(0)
    points = np.vstack([points + 0.1 * rng.random(points.shape), [[np.pi, 1e-7, -1e3]]])
    source = meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[:4, :4]), ("line", cells[:2, :2])])
    mesh = as_hex_mesh(source)
    return mesh.replaced(
        point_data={"f": rng.random(28), "v": rng.random((28, 3)), "i": rng.integers(-9, 9, 28)},
        cell_data={"f": rng.random(8), "v": rng.random((8, 3)), "i": rng.integers(1, 9, 8)},
    )


def as_grid(mesh):
    """A mesh as an unstructured grid of pyvista."""
    return to_pyvista(mesh)[0].cast_to_unstructured_grid()


# Corners between which the further nodes of a curved cell lie, in the order of VTK.
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
FACES = [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 1, 2, 3), (4, 5, 6, 7)]
PARENTS = [*EDGES, *FACES, tuple(range(8))]
