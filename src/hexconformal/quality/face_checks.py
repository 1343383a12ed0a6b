"""Checks of faces, whatever the cells are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids
from ..mesh import FaceTable, HexMesh, MixedMesh, components
from .finding import Finding, error, warning
from .node_order import NO_BOUNDARY

__all__ = ["check_hanging", "check_pieces", "check_sides", "first_faces"]

_HANGING_DISTANCE = 1e-6  # relative to the edge, or to the diagonal of the face


def check_sides(mesh: HexMesh | MixedMesh, faces: FaceTable) -> list[Finding]:
    """Faces of more than two cells, and no face of one alone."""
    found = []
    crowded = np.flatnonzero(faces.counts > 2)
    if len(crowded):
        cells = np.unique(faces.cells[crowded])
        text = f"faces shared by more than two cells: {len(crowded)} ({first_faces(mesh, faces, crowded)})"
        found.append(error("crowded faces", cells, f"{text}, of cells {first_ids(cells, mesh.cell_labels)}"))
    if (faces.counts > 1).all():
        found.append(error("no boundary", np.arange(faces.cells.max() + 1), NO_BOUNDARY))
    return found


def check_pieces(mesh: HexMesh | MixedMesh, table: NDArray[np.int64]) -> list[Finding]:
    """Pieces of the mesh, whose cells are (m, 8) in a table, that share no node."""
    count, pieces = components(table)
    if count == 1:
        return []
    first = np.unique(pieces, return_index=True)[1]
    text = f"the mesh is in {count} pieces that share no node; their first cells: {first_ids(first, mesh.cell_labels)}"
    return [warning("pieces", first, text)]


def check_hanging(mesh: HexMesh | MixedMesh, faces: FaceTable) -> list[Finding]:
    """Nodes that tie no cell to the one on whose edge or face they are."""
    hanging = _hanging(mesh.points, faces.quads[faces.counts == 1])
    if len(hanging) == 0:
        return []
    text = f"nodes hanging on an edge or face of another cell: {first_ids(hanging, mesh.node_labels)}"
    return [warning("hanging nodes", hanging, f"{text}; they are not tied to it")]


def first_faces(mesh: HexMesh | MixedMesh, faces: FaceTable, rows: NDArray[np.int64]) -> str:
    """Nodes of the first of some faces, in words."""
    labels = np.arange(len(mesh.points)) if mesh.node_labels is None else mesh.node_labels
    corners = (nodes[: 3 + int(nodes[2] != nodes[3])] for nodes in faces.quads[rows[:3]])
    return "nodes " + ", ".join(str(tuple(labels[nodes].tolist())) for nodes in corners)


def _hanging(points: NDArray[np.float64], quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Boundary nodes in the middle of a boundary edge or face: where cells were split in two."""
    from scipy.spatial import cKDTree

    if len(quads) == 0:
        return np.empty(0, dtype=np.int64)
    after = np.roll(quads, -1, axis=1)
    # Each edge once: its other quad runs along it the other way.
    edge = quads < after
    ends = points[quads[edge]], points[after[edge]]
    middles = np.concatenate([(ends[0] + ends[1]) / 2, points[quads].mean(axis=1)])
    lengths = np.linalg.norm(points[quads[:, 2]] - points[quads[:, 0]], axis=1)
    reach = _HANGING_DISTANCE * np.concatenate([np.linalg.norm(ends[1] - ends[0], axis=1), lengths])
    owner = np.concatenate([np.nonzero(edge)[0], np.arange(len(quads))])
    nodes = np.unique(quads)
    distances, nearest = cKDTree(points[nodes]).query(middles, distance_upper_bound=float(reach.max()))
    hit = np.asarray(distances <= reach) & np.isfinite(distances)
    found = nodes[np.asarray(nearest)[hit]]
    # A corner of the quad itself is no hanging node: two of them may coincide.
    return np.unique(found[(quads[owner[hit]] != found[:, None]).all(axis=1)])
