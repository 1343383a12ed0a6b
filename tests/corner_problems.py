"""Minimizations on whole meshes, with nodes free or held, and convex blocks in full."""

import numpy as np
from meshes.hexahedra import off_boundary
from scipy import sparse

from hexconformal import generate
from hexconformal.energy import Assembly, Objective
from hexconformal.formulation.formulation import Formulation
from hexconformal.solver import AdmissibleDirections

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


def formulation_of(points, cells, projectors=None, **others):
    """The formulation with cubes for targets, all nodes free or with a projector each."""
    projectors = all_free(points) if projectors is None else projectors
    nodes = np.flatnonzero((projectors != np.eye(3)).any(axis=(1, 2)))
    admissible = AdmissibleDirections(nodes, projectors[nodes])
    return Formulation(cells, len(points), CUBES, admissible, **others)


def fixed_boundary(points, cells):
    """The formulation with cubes for targets, of which only inner nodes move."""
    return formulation_of(points, cells, boundary_held(points, cells))


def convex(term, points, cells, diagonals=False):
    """Value, gradient and convex blocks of a term, the blocks as an array (3n, 3n)."""
    assembly = Assembly.of_cells(cells, np.ones(len(points), dtype=bool), diagonals)
    value, gradient, _ = Objective((term,)).convex(points, assembly)
    return value, gradient, dense(assembly.matrix)


def dense(matrix):
    """The block matrix as an array (3n, 3n)."""
    n = len(matrix.indptr) - 1
    lower = sparse.bsr_array((matrix.data, matrix.indices, matrix.indptr), shape=(3 * n, 3 * n)).toarray()
    # The blocks of the diagonal are stored whole.
    return lower + lower.T - np.kron(np.eye(n), np.ones((3, 3))) * lower
