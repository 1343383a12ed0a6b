"""Checks that a surface can be remeshed: all reasons against it, found before the work starts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.common import MeshError, OptionError, as_mask, first_ids, unusable_points
from hexconformal.geometry import edge_table, face_areas

from ..mesh import Ints, SurfaceMesh

__all__ = ["held_nodes", "require_numbers", "require_sound"]

# Relative to the size of the mesh, and to the mean area.
_COINCIDENCE = 1e-12
_NO_AREA = 1e-14


def require_sound(mesh: SurfaceMesh) -> tuple[str, ...]:
    """Raise a MeshError that lists all faults of a surface; otherwise return warnings.

    Refused are points that are not finite, nodes that are no points, repeated nodes and cells, edges of more than
    two cells, neighbours that disagree on which side is out, and cells without area. Folded quadrilaterals, slivers,
    open boundaries and several pieces are not: those can be worked on.

    Examples
    --------
    >>> from surface import as_surface_mesh
    >>> require_sound(as_surface_mesh((np.eye(3), [[0, 1, 2]])))
    ()
    """
    require_numbers(mesh)
    # Each of these checks is meaningful only if those before it found nothing.
    for find in (_nodes, _edges, _areas):
        wrong = find(mesh)
        if wrong:
            raise MeshError("; ".join(wrong))
    return (*mesh.notes, *_warnings(mesh))


def held_nodes(mesh: SurfaceMesh, fixed: Any) -> NDArray[np.bool_]:
    """(n,) nodes that the user holds: None, booleans, ids, or the name of a set, a group or a point array.

    Raises
    ------
    OptionError
        If it is none of those.

    Examples
    --------
    >>> held_nodes(SurfaceMesh(np.eye(3), [[0, 1, 2]], {"wall": [0, 0, 1]}), "wall")
    array([False, False,  True])
    """
    mask = as_mask(fixed, len(mesh.points), "fixed", mesh.named_nodes() if isinstance(fixed, str) else None)
    if mask.ndim != 1:
        raise OptionError("fixed must have one boolean per point: on a surface nodes are held as a whole")
    return mask


def require_numbers(mesh: SurfaceMesh) -> None:
    """Raise a MeshError unless all points are finite and all nodes are points: without that nothing can be measured."""
    wrong = []
    bad, text = unusable_points(mesh.points, mesh.node_labels)
    if len(bad):
        wrong.append(text)
    bad = _cells_where(mesh, lambda table: ((table < 0) | (table >= len(mesh.points))).any(axis=1))
    if len(bad):
        text = f"cells with node ids outside 0..{len(mesh.points) - 1}: {_named(mesh, bad)}"
        used = mesh.cells.nodes()
        if used[0] == 1 and used[-1] == len(mesh.points):
            text += "; ids start at 1 here, subtract 1"
        wrong.append(text)
    if wrong:
        raise MeshError("; ".join(wrong))


def _nodes(mesh: SurfaceMesh) -> list[str]:
    wrong = []
    bad = _cells_where(mesh, lambda table: (np.diff(np.sort(table, axis=1), axis=1) == 0).any(axis=1))
    if len(bad):
        advice = "remove them, or make triangles of quadrilaterals"
        wrong.append(f"cells with a repeated node: {_named(mesh, bad)}; {advice}")
    bad = _cells_where(mesh, _repeated)
    if len(bad):
        wrong.append(f"cells with the same nodes as an earlier one: {_named(mesh, bad)}; remove them")
    return wrong


def _repeated(table: Ints) -> NDArray[np.bool_]:
    first = np.unique(np.sort(table, axis=1), axis=0, return_index=True)[1]
    again = np.ones(len(table), dtype=bool)
    again[first] = False
    return again


def _edges(mesh: SurfaceMesh) -> list[str]:
    wrong = []
    edges = edge_table(mesh.cells)
    non_manifold = edges.counts > 2
    if non_manifold.any():
        cells = np.unique(mesh.cells.owners[non_manifold[edges.of_corners]])
        nodes = edges.nodes[non_manifold][:3]
        labels = nodes if mesh.node_labels is None else mesh.node_labels[nodes]
        names = ", ".join(str(tuple(pair)) for pair in labels.tolist())
        wrong.append(
            f"edges of more than two cells (non-manifold): {int(non_manifold.sum())} (nodes {names}), at cells "
            f"{_named(mesh, cells)}; remesh the sheets one by one"
        )
    odd = edges.sides[~edges.opposed]
    if len(odd):
        cells = np.unique(odd.max(axis=1))
        wrong.append(
            f"neighbours that disagree on which side is out: {_named(mesh, cells)}; turn them round "
            "(a surface with one side, such as a Moebius strip, cannot be remeshed)"
        )
    return wrong


def _areas(mesh: SurfaceMesh) -> list[str]:
    areas = face_areas(mesh.points, mesh.cells)
    flat = np.flatnonzero(areas <= _NO_AREA * areas.mean())
    return [f"cells without area: {_named(mesh, flat)}; remove them, or merge their nodes"] if len(flat) else []


def _warnings(mesh: SurfaceMesh) -> list[str]:
    from scipy.spatial import cKDTree

    notes = []
    used = np.zeros(len(mesh.points), dtype=bool)
    used[mesh.cells.nodes()] = True
    if not used.all():
        notes.append(f"points in no cell (kept): {first_ids(np.flatnonzero(~used), mesh.node_labels)}")
    nodes = np.flatnonzero(used)
    places = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
    distances = np.asarray(cKDTree(places).query(places, k=2)[0])[:, 1]
    close = np.asarray(distances <= _COINCIDENCE * np.abs(places).max())
    if close.any():
        named = first_ids(nodes[close], mesh.node_labels)
        notes.append(f"points that coincide with another: {named}; if they are one, merge them")
    return notes


def _cells_where(mesh: SurfaceMesh, bad: Callable[[Ints], ArrayLike]) -> Ints:
    """Positions, with triangles first, of the cells whose nodes make `bad` true."""
    return np.flatnonzero(mesh.cells.where(bad))


def _named(mesh: SurfaceMesh, cells: Ints) -> str:
    """Cells by their ids in the input, in its order, from positions with triangles first."""
    if mesh.rows is None:
        return first_ids(cells)
    cells = cells[np.argsort(mesh.rows[cells])]
    return first_ids(cells, mesh.rows if mesh.cell_labels is None else mesh.cell_labels)
