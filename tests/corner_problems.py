"""Corner energies of whole meshes, with nodes free or held."""

import numpy as np
from hexconformal.energy.corner_energy import CornerEnergy
from meshes.hexahedra import off_boundary
from scipy import sparse

from hexconformal import generate

CUBES = np.empty((0, 1, 3, 3))


def jittered_cubes(n=4, amount=0.25, seed=1):
    """A block of n^3 unit cubes, its inner nodes jittered."""
    points, cells = generate.jittered(*generate.box((n, n, n)), amount, seed=seed)
    return n * points, cells


def all_free(points):
    """Projectors that let every node move."""
    return np.tile(np.eye(3), (len(points), 1, 1))


def boundary_held(points, cells):
    """Projectors that hold the nodes on the boundary."""
    return all_free(points) * off_boundary(points, cells)[:, None, None]


def fixed_boundary_energy(points, cells):
    """The energy with cubes for targets, of which only inner nodes move."""
    return CornerEnergy(cells, CUBES, boundary_held(points, cells))


def dense(matrix):
    """The block matrix as an array (3n, 3n)."""
    n = len(matrix.indptr) - 1
    lower = sparse.bsr_array((matrix.data, matrix.indices, matrix.indptr), shape=(3 * n, 3 * n)).toarray()
    # The blocks of the diagonal are stored whole.
    return lower + lower.T - np.kron(np.eye(n), np.ones((3, 3))) * lower
