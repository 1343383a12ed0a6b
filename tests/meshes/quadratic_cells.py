"""Quadratic cells for tests: random ones, and det J by shape functions of VTK, or by formulas of their own."""

import itertools

import numpy as np
from vtkmodules.vtkCommonDataModel import (
    vtkBiQuadraticQuadraticWedge,
    vtkQuadraticHexahedron,
    vtkQuadraticTetra,
    vtkQuadraticWedge,
    vtkTriQuadraticHexahedron,
)

from hexconformal import elevated
from hexconformal.elements import (
    BETWEEN,
    HEXAHEDRON20,
    HEXAHEDRON27,
    PYRAMID13,
    PYRAMID14,
    TETRAHEDRON10,
    WEDGE15,
    WEDGE18,
    between,
)
from hexconformal.generate import cylinder
from hexconformal.mesh import MixedMesh, blocks_of, boundary_quads, face_edges

HEXAHEDRA = [HEXAHEDRON20, HEXAHEDRON27]
QUADRATIC = [*HEXAHEDRA, WEDGE15, WEDGE18, PYRAMID13, PYRAMID14, TETRAHEDRON10]
_VTK = {
    HEXAHEDRON20: vtkQuadraticHexahedron,
    HEXAHEDRON27: vtkTriQuadraticHexahedron,
    WEDGE15: vtkQuadraticWedge,
    WEDGE18: vtkBiQuadraticQuadraticWedge,
    TETRAHEDRON10: vtkQuadraticTetra,
}
# Of a pyramid the corners of its base and its apex: what VTK calls its coordinates are those of a cube.
_PYRAMID = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]) / 1.0


def random_cells(cell_type, count, amount, seed=0):
    """(count, k, 3) ideals whose nodes are moved by up to `amount` along each axis."""
    return cell_type.ideal + np.random.default_rng(seed).uniform(-amount, amount, (count, len(cell_type.nodes), 3))


def places_of_nodes(cell_type):
    """(k, 3) reference coordinates of the nodes, as VTK has them."""
    if cell_type not in _VTK:
        return np.array([*_PYRAMID, *(_PYRAMID[list(among)].mean(axis=0) for among in between(cell_type))])
    return np.array(_VTK[cell_type]().GetParametricCoords()).reshape(-1, 3)


def reference_places(cell_type, xi):
    """(q, 3) reference coordinates of places in the unit cube."""
    u, v, w = np.asarray(xi, dtype=float).T
    name = cell_type.name.rstrip("0123456789")
    if name == "hexahedron":
        return np.stack([u, v, w], axis=1)
    if name == "wedge":
        return np.stack([u * (1 - v), v, w], axis=1)
    if name == "pyramid":
        return np.stack([u * (1 - w), v * (1 - w), w], axis=1)
    return np.stack([u * (1 - v) * (1 - w), v * (1 - w), w], axis=1)


def _rational(r, s, t, nodes):
    """Shape functions of pyramids of 13 or 14 nodes, rational in the reference coordinates."""
    c = 1 - t
    linear = [(c - r) * (c - s) / c, r * (c - s) / c, r * s / c, (c - r) * s / c]
    base = [4 * r * (c - r) * (c - s) / c, 4 * r * s * (c - s) / c, 4 * r * (c - r) * s / c]
    base.append(4 * s * (c - s) * (c - r) / c)
    upward = [4 * t * one for one in linear]
    middle = 16 * r * s * (c - r) * (c - s) / c**2 if nodes == 14 else 0 * r
    corners = [linear[k] - (base[k] + base[k - 1] + upward[k]) / 2 + middle / 4 for k in range(4)]
    every = [*corners, t * (2 * t - 1), *(one - middle / 2 for one in base), *upward, middle]
    return np.stack(every[:nodes], axis=-1)


def shapes(cell_type, reference):
    """(q, k) shape functions at reference coordinates."""
    if cell_type not in _VTK:
        return _rational(*np.asarray(reference).T, len(cell_type.nodes))
    cell, out = _VTK[cell_type](), np.empty((len(reference), len(cell_type.nodes)))
    for place, row in zip(np.asarray(reference).tolist(), out, strict=True):
        cell.InterpolateFunctions(place, row)
    return out


def gradients(cell_type, reference):
    """(q, k, 3) their derivatives."""
    if cell_type not in _VTK:
        steps = np.asarray(reference).T[:, :, None] + 1e-200j * np.eye(3)[:, None]
        return _rational(*steps, len(cell_type.nodes)).imag.transpose(0, 2, 1) / 1e-200
    cell, out = _VTK[cell_type](), np.empty((len(reference), 3, len(cell_type.nodes)))
    for place, rows in zip(np.asarray(reference).tolist(), out, strict=True):
        cell.InterpolateDerivs(place, rows.ravel())
    return out.transpose(0, 2, 1)


def lattice(steps):
    """(steps^3, 3) places in the unit cube."""
    return np.array(list(itertools.product(np.linspace(0, 1, steps), repeat=3)))


def places(cell_type, steps):
    """(steps^3, 3) places in the unit cube, of pyramids up to right below the apex, where formulas divide by zero."""
    return lattice(steps) * ([1, 1, 1 - 1e-6] if cell_type in (PYRAMID13, PYRAMID14) else [1, 1, 1])


def frames(cell_type, x, xi):
    """(m, q, 3, 3) derivatives of cells (m, k, 3) by reference coordinates, at places (q, 3) in the cube."""
    return np.einsum("cai,qaj->cqij", x, gradients(cell_type, reference_places(cell_type, xi)))


def sampled_determinants(cell_type, x, steps):
    """(m, steps^3) their determinants."""
    parts, xi = np.array_split(x, max(len(x) // 200, 1)), places(cell_type, steps)
    return np.concatenate([np.linalg.det(frames(cell_type, part, xi)) for part in parts])


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


def raised(mesh, nodes):
    """A mesh of linear cells with nodes between corners, of each type so many as `nodes` says by its name.

    Also tells which nodes lie on the boundary, and between which corners each of the further ones is.
    """
    numbers, cells = {}, {}
    points = list(mesh.points)
    for block in blocks_of(mesh):
        name = f"{block.cell_type.name}{nodes[block.cell_type.name]}"
        (cell_type,) = (one for one in QUADRATIC if one.name == name)
        columns = [*block.cells.T]
        for among in between(cell_type):
            columns.append([])
            for corners in block.cells[:, list(among)].tolist():
                key = frozenset(corners)
                if key not in numbers:
                    numbers[key] = len(points)
                    points.append(mesh.points[corners].mean(axis=0))
                columns[-1].append(numbers[key])
        cells[name] = np.stack(columns, axis=1)
    result = MixedMesh.of_types(np.array(points), cells)
    quads = boundary_quads(result.table)[0]
    outside = np.zeros(len(points), dtype=bool)
    outside[quads] = True
    for among in (*face_edges(quads).tolist(), *quads.tolist()):
        outside[numbers.get(frozenset(among), quads[0, 0])] = True
    return result, outside, numbers


def rounded(mesh, outside, numbers, axes):
    """The mesh with the nodes between corners of its boundary at distance 1 in some coordinates there, too."""
    points = mesh.points.copy()
    round_there = np.isclose(np.linalg.norm(points[:, axes], axis=1), 1.0)
    for corners, node in numbers.items():
        if outside[node] and round_there[list(corners)].all():
            points[node, axes] /= np.linalg.norm(points[node, axes])
    return mesh.replaced(points)
