"""Checks of meshes of several types of cells before they are measured or worked on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..mesh import FaceTable, MixedMesh, face_table, with_wedges_upright
from .face_checks import check_hanging, check_pieces, check_sides, first_faces
from .finding import Finding, error, warning
from .node_order import mirrored_cells
from .point_checks import check_numbers, check_places, repeated_rows
from .quadratic_checks import check_quadratic

__all__ = ["check_mixed", "split_quads"]

_FLAT_VOLUME = 1e-10  # relative to the product of the edges at a corner


def check_mixed(mesh: MixedMesh) -> tuple[Finding, ...]:
    """The findings of :func:`hexconformal.check`, errors first.

    Examples
    --------
    >>> from hexconformal.elements import WEDGE
    >>> turned = MixedMesh.of_types(WEDGE.ideal, {"wedge": [[3, 4, 5, 0, 1, 2]]})
    >>> check_mixed(turned)[0].message[:66]
    'wedges with their two triangles in the reverse order: 1 (ids 0); t'
    """
    found = check_numbers(mesh)
    if not found:
        found = [*_check_repeated(mesh), *_check_flat(mesh), *check_places(mesh, "cell")]
        if not any(finding.kind == "repeated nodes" for finding in found):
            upright = with_wedges_upright(mesh)
            found += [*_check_wedges(mesh, upright), *_check_faces(upright), *check_quadratic(mesh)]
    return tuple(sorted(found, key=lambda finding: finding.severity))


def _check_repeated(mesh: MixedMesh) -> list[Finding]:
    """Nodes that a cell has twice, and cells that are there twice."""
    found = []
    for block in mesh.blocks:
        nodes = np.sort(block.cells, axis=1)
        twice = block.places[(nodes[:, 1:] == nodes[:, :-1]).any(axis=1)]
        if len(twice):
            text = f"{block.cell_type.plural} with a repeated node: {first_ids(twice, mesh.cell_labels)}"
            found.append(error("repeated nodes", twice, f"{text}; give them the type of what they are"))
        again = block.places[repeated_rows(nodes)]
        if len(again):
            text = f"{block.cell_type.plural} with the same nodes as an earlier one"
            text = f"{text}: {first_ids(again, mesh.cell_labels)}; remove them"
            found.append(error("duplicate cells", again, text))
    return found


def _check_flat(mesh: MixedMesh) -> list[Finding]:
    flat = []
    for block in mesh.blocks:
        corners = np.arange(len(block.cell_type.neighbours))
        edges = (
            mesh.points[block.cells[:, block.cell_type.neighbours]] - mesh.points[block.cells[:, corners]][:, :, None]
        )
        sizes = np.linalg.norm(edges, axis=3).prod(axis=2)
        flat.append(block.places[(np.abs(np.linalg.det(edges)) <= _FLAT_VOLUME * sizes).all(axis=1)])
    ids = np.sort(np.concatenate(flat))
    return [warning("flat cells", ids, f"cells without volume: {first_ids(ids, mesh.cell_labels)}")] if len(ids) else []


def _check_wedges(mesh: MixedMesh, upright: MixedMesh) -> list[Finding]:
    """Wedges in the order of another format, which are taken as they are meant."""
    for block, turned in zip(mesh.blocks, upright.blocks, strict=True):
        if block is not turned and not np.array_equal(block.cells, turned.cells):
            text = f"wedges with their two triangles in the reverse order: {first_ids(block.places, mesh.cell_labels)}"
            advice = "they are taken the other way round, as most would have negative volume; orient() turns them"
            return [warning("reversed wedges", block.places, f"{text}; {advice}")]
    return []


def _check_faces(mesh: MixedMesh) -> list[Finding]:
    table = mesh.table
    faces = face_table(table)
    found = check_sides(mesh, faces)
    if any(finding.kind == "no boundary" for finding in found):
        return found
    found += [*_check_order(mesh, faces), *check_pieces(mesh, table)]
    split = np.flatnonzero(split_quads(faces))
    if len(split):
        cells = np.unique(faces.cells[split, 0])
        text = f"quadrilaterals that meet two triangles: {len(split)} ({first_faces(mesh, faces, split)})"
        text = f"{text}, of cells {first_ids(cells, mesh.cell_labels)}"
        found.append(
            warning("split faces", cells, f"{text}; they touch only where they are flat; put pyramids between")
        )
    return [*found, *check_hanging(mesh, faces)]


def _check_order(mesh: MixedMesh, faces: FaceTable) -> list[Finding]:
    """Cells that are inside out by their connections, not because the mesh is tangled."""
    try:
        mirrored = mirrored_cells(mesh, faces)
    except MeshError as problem:
        return [error("mirrored", [], str(problem))]
    found = []
    for block in mesh.blocks:
        ids = block.places[mirrored[block.places]]
        if len(ids):
            text = f"{block.cell_type.plural} whose nodes are in the reverse order of their neighbours'"
            text = f"{text}: {first_ids(ids, mesh.cell_labels)}; orient() turns them round"
            found.append(error("mirrored", ids, text))
    return found


def split_quads(faces: FaceTable) -> NDArray[np.bool_]:
    """(f,) quadrilaterals on the boundary in whose place there are two triangles on the other side.

    Examples
    --------
    >>> cells = {"pyramid": [[0, 1, 2, 3, 4]], "tetra": [[0, 2, 1, 5], [0, 3, 2, 5]]}
    >>> table = face_table(MixedMesh.of_types(np.zeros((6, 3)), cells).table)
    >>> table.quads[split_quads(table)]
    array([[0, 3, 2, 1]])
    """
    alone, triangles = faces.counts == 1, faces.quads[:, 2] == faces.quads[:, 3]
    result = np.zeros(len(faces.counts), dtype=bool)
    quads, beside = np.flatnonzero(alone & ~triangles), np.sort(faces.quads[alone & triangles, :3], axis=1)
    if len(quads) and len(beside):
        thirds = [np.sort(faces.quads[quads][:, [i, (i + 1) % 4, (i + 2) % 4]], axis=1) for i in range(4)]
        numbers = np.unique(np.concatenate([beside, *thirds]), axis=0, return_inverse=True)[1].ravel()
        known = np.isin(numbers[len(beside) :], numbers[: len(beside)]).reshape(4, -1)
        result[quads] = (known[0] & known[2]) | (known[1] & known[3])
    return result
