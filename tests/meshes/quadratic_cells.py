"""Quadratic hexahedra for tests: random ones, and det J by the shape functions of VTK."""

import itertools

import numpy as np
from vtkmodules.vtkCommonDataModel import vtkQuadraticHexahedron, vtkTriQuadraticHexahedron

from hexconformal import elevated
from hexconformal.elements import BETWEEN, HEXAHEDRON20, HEXAHEDRON27
from hexconformal.generate import cylinder

QUADRATIC = [HEXAHEDRON20, HEXAHEDRON27]
_VTK = {HEXAHEDRON20: vtkQuadraticHexahedron, HEXAHEDRON27: vtkTriQuadraticHexahedron}


def random_cells(cell_type, count, amount, seed=0):
    """(count, k, 3) unit cubes whose nodes are moved by up to `amount` along each axis."""
    return cell_type.ideal + np.random.default_rng(seed).uniform(-amount, amount, (count, len(cell_type.nodes), 3))


def places_of_nodes(cell_type):
    """(k, 3) reference coordinates of the nodes, as VTK has them."""
    return np.array(_VTK[cell_type]().GetParametricCoords()).reshape(-1, 3)


def vtk_shapes(cell_type, xi):
    """(q, k) shape functions of VTK."""
    cell, out = _VTK[cell_type](), np.empty((len(xi), len(cell_type.nodes)))
    for place, row in zip(xi.tolist(), out, strict=True):
        cell.InterpolateFunctions(place, row)
    return out


def vtk_gradients(cell_type, xi):
    """(q, k, 3) their derivatives."""
    cell, out = _VTK[cell_type](), np.empty((len(xi), 3, len(cell_type.nodes)))
    for place, rows in zip(xi.tolist(), out, strict=True):
        cell.InterpolateDerivs(place, rows.ravel())
    return out.transpose(0, 2, 1)


def lattice(steps):
    """(steps^3, 3) places in the unit cube."""
    return np.array(list(itertools.product(np.linspace(0, 1, steps), repeat=3)))


def frames(cell_type, x, xi):
    """(m, q, 3, 3) J of cells (m, k, 3) at places (q, 3)."""
    return np.einsum("cai,qaj->cqij", x, vtk_gradients(cell_type, xi))


def sampled_determinants(cell_type, x, steps):
    """(m, steps^3) det J."""
    parts = np.array_split(x, max(len(x) // 200, 1))
    return np.concatenate([np.linalg.det(frames(cell_type, part, lattice(steps))) for part in parts])


def curved_cylinder(nodes, core=2, layers=1, axial=2):
    """A cylinder of radius 1 from z = 0 to 2, with the nodes of its side on the circle; eight cells go round it."""
    points, cells = cylinder(core, layers, axial)
    mesh = elevated((points, cells), nodes)
    rim, points = np.isclose(np.hypot(*points[:, :2].T), 1.0), mesh.points.copy()
    for place, corners in enumerate(BETWEEN[: nodes - 8], start=8):
        on_rim = rim[mesh.blocks[0].cells[:, corners]].all(axis=1)
        middles = np.unique(mesh.blocks[0].cells[on_rim, place])
        points[middles, :2] /= np.hypot(*points[middles, :2].T)[:, None]
    return mesh.replaced(points)
