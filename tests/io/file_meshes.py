"""Meshes that are written to files: distorted ones with all kinds of arrays, and curved cells."""

import meshio
import numpy as np
from hex_meshes import block

from hexconformal import as_hex_mesh


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
    from hexconformal.io.convert import to_pyvista

    return to_pyvista(mesh)[0].cast_to_unstructured_grid()


EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]


FACES = [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 1, 2, 3), (4, 5, 6, 7)]


PARENTS = [*EDGES, *FACES, tuple(range(8))]
