"""Small hexahedral meshes, and a cell, that tests work on."""

import meshio
import numpy as np
import pyvista as pv

from hexconformal.elements import CORNERS

# All corners, Gauss points and the 27 lattice points are positive, yet det J is negative inside.
INVALID_INSIDE = np.array(
    [
        [0.453, 0.234, -0.698],
        [1.711, 0.42, 0.308],
        [0.585, 1.63, 0.519],
        [-0.611, 1.154, 0.528],
        [-0.452, 0.014, 1.021],
        [0.565, 0.229, 1.464],
        [0.71, 1.419, 0.628],
        [0.459, 1.749, 1.71],
    ]
)


def block(k):
    """Points and cells of k^3 unit cubes."""
    i = np.arange((k + 1) ** 3).reshape(k + 1, k + 1, k + 1)
    corner = [i[x : x + k, y : y + k, z : z + k].ravel() for x, y, z in CORNERS]
    axes = np.meshgrid(*[np.arange(k + 1.0)] * 3, indexing="ij")
    return np.stack(axes, -1).reshape(-1, 3), np.stack(corner, axis=1)


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
