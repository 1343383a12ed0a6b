"""Meshes of several types of cells, whose faces fit."""

from functools import partial

import numpy as np
import pyvista as pv

from hexconformal.elements import HEXAHEDRON, rows_by_type
from hexconformal.elements import shape_gradients as hexahedral_gradients
from hexconformal.generate import box
from hexconformal.mesh import MixedMesh, blocks_of, collapsed_mesh, face_table
from meshes.hexahedra import block
from meshes.linear_cells import shape_gradients


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


def cut_up(points, cells, kinds):
    """Hexahedra cut into cells of a kind each: into two "wedge", or 12 "tetra" around the centre, or not at all.

    Towards others than tetrahedra there is a pyramid instead of two of these. The triangles of wedges lie in the faces
    across y, where there must be wedges or the boundary.
    """
    found = {"tetra": [], "hexahedron": [], "pyramid": [], "wedge": []}
    table, centres = face_table(cells), []
    whole = (kinds[table.cells] != "tetra") & (table.cells >= 0)
    quads = set(map(frozenset, table.quads[whole.any(axis=1)].tolist()))
    for cube, kind in zip(cells.tolist(), kinds, strict=True):
        if kind == "wedge":
            # The triangles lie in the faces across y, the same way in all cubes.
            found["wedge"] += [[cube[i] for i in row] for row in ((0, 4, 1, 3, 7, 2), (4, 5, 1, 7, 6, 2))]
        elif kind == "hexahedron":
            found["hexahedron"].append(cube)
        else:
            centre = len(points) + len(centres)
            centres.append(points[cube].mean(axis=0))
            for face in HEXAHEDRON.faces:
                a, b, c, d = (cube[node] for node in face)
                if frozenset((a, b, c, d)) in quads:
                    found["pyramid"].append([d, c, b, a, centre])
                    continue
                # Along the diagonal through the smallest node, which both sides see.
                first = int(np.argmin([a, b, c, d]))
                a, b, c, d = ([a, b, c, d] * 2)[first : first + 4]
                found["tetra"] += [[a, c, b, centre], [a, d, c, centre]]
    points = np.vstack([points, np.reshape(centres, (-1, 3))])
    return MixedMesh.of_types(points, {name: np.array(rows) for name, rows in found.items() if rows})


def mixed_block(n=3):
    """A bar of 4 n by n by n cubes: wedges, hexahedra, pyramids with tetrahedra, and tetrahedra; n^2 of each layer."""
    points, cubes = box((4 * n, n, n), (4.0 * n, float(n), float(n)))
    layer = np.rint(points[cubes].min(axis=1)[:, 0]).astype(int)
    return cut_up(points, cubes, np.array(["wedge", "hexahedron", "tetra", "tetra"])[layer // n])


def smallest_determinants(mesh, per_side=7):
    """Smallest det J of each cell at many places, by shape functions that the tests write out themselves."""
    smallest = []
    s = np.linspace(0.0, 1.0, per_side)
    cube = np.stack(np.meshgrid(s, s, s, indexing="ij"), -1).reshape(-1, 3)
    for one in blocks_of(mesh):
        xi = cube if one.cell_type.name in ("hexahedron", "pyramid") else cube[cube[:, 0] + cube[:, 1] <= 1 + 1e-12]
        if one.cell_type.name == "tetra":
            xi = np.array([[0.2, 0.2, 0.2]])
        of_type = hexahedral_gradients if one.cell_type is HEXAHEDRON else partial(shape_gradients, one.cell_type)
        gradients = of_type(xi)
        jacobians = np.einsum("qai,cak->cqki", gradients, mesh.points[one.cells])
        smallest.append(np.linalg.det(jacobians).min(axis=1))
    return np.concatenate(smallest)


def jittered_inside(mesh, amount, seed=0):
    """The mesh with nodes moved by up to `amount` along each axis, along the faces, edges and corners of its box."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    moves = np.random.default_rng(seed).uniform(-amount, amount, mesh.points.shape)
    return mesh.replaced(points=mesh.points + moves * ((mesh.points > low) & (mesh.points < high)))


def collapsed_tables():
    """Points and cells (m, 8) of the four types in one table, their nodes moved a little; the faces fit."""
    mesh = collapsed_mesh(jittered_inside(mixed_block(2), 0.15))
    order = np.concatenate([one.rows if isinstance(one.rows, np.ndarray) else np.arange(len(mesh.cells))[one.rows]
                            for one in rows_by_type(mesh.cells)])  # fmt: skip
    return mesh.points.copy(), mesh.cells[order]


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
    return cut_into_tetrahedra(*block(n))


def cut_into_tetrahedra(points, cells):
    """Hexahedra, each cut into six tetrahedra around a diagonal: faces fit where all cells run the same way."""
    paths = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
    return MixedMesh.of_types(points, {"tetra": np.concatenate([cells[:, path] for path in paths])})


def cut_into_pyramids(points, cells):
    """Hexahedra, each cut into six pyramids whose apex is its middle."""
    apexes = len(points) + np.arange(len(cells))
    pyramids = [np.column_stack([cells[:, face[::-1]], apexes]) for face in HEXAHEDRON.faces]
    return MixedMesh.of_types(np.vstack([points, points[cells].mean(axis=1)]), {"pyramid": np.concatenate(pyramids)})


def faces_by_nodes(mesh):
    """Of each face, by its set of nodes, the places of its cells and the nodes as each goes round it, one at a time."""
    faces = {}
    for one in blocks_of(mesh):
        for place, cell in zip(one.places.tolist(), one.cells.tolist(), strict=True):
            for face in one.cell_type.faces:
                nodes = [cell[k] for k in face]
                faces.setdefault(frozenset(nodes), []).append((place, nodes))
    return {nodes: sorted(owners) for nodes, owners in faces.items()}
