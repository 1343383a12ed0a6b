"""Is this a surface that can be remeshed? Every reason why not, found before the work starts."""

from __future__ import annotations

import numpy as np

from hexconformal.errors import MeshError, first_ids

from .features import edge_table
from .geometry import cell_areas
from .mesh import SurfaceMesh

__all__ = ["require_sound"]


def require_sound(mesh: SurfaceMesh) -> tuple[str, ...]:
    """Raise a MeshError that lists all that is wrong with a surface; otherwise return what is doubtful, in words.

    Examples
    --------
    >>> from surface.mesh import as_surface_mesh
    >>> require_sound(as_surface_mesh((np.eye(3), [[0, 1, 2]])))
    ()
    """
    wrong = _numbers(mesh)
    if wrong:
        raise MeshError("; ".join(wrong))
    notes = []
    used = np.zeros(len(mesh.points), dtype=bool)
    for table in mesh.cells.groups():
        nodes = np.sort(table, axis=1)
        bad = np.flatnonzero((nodes[:, 1:] == nodes[:, :-1]).any(axis=1))
        if len(bad):
            wrong.append(f"cells with a repeated node: {first_ids(bad)}; remove them")
        used[table] = True
    edges = edge_table(mesh.cells)
    crowded = np.unique(edges.cells[edges.uses > 2])
    if len(crowded):
        wrong.append(f"edges of more than two cells (no manifold), at cells {first_ids(crowded[crowded >= 0])}")
    odd = (edges.uses == 2) & (edges.cells < 0).any(axis=1)
    if odd.any():
        cells = edges.cells[odd].max(axis=1)
        wrong.append(
            f"neighbours that disagree on which side is out: {first_ids(np.unique(cells))}; turn them round "
            "(a surface with one side, such as a Moebius strip, cannot be remeshed)"
        )
    if wrong:
        raise MeshError("; ".join(wrong))
    areas = cell_areas(mesh.points, mesh.cells)
    flat = np.flatnonzero(areas <= 1e-14 * areas.mean())
    if len(flat):
        raise MeshError(f"cells without area: {first_ids(flat)}; remove them, or merge their nodes")
    if not used.all():
        notes.append(f"points in no cell (kept): {first_ids(np.flatnonzero(~used))}")
    return tuple(notes)


def _numbers(mesh: SurfaceMesh) -> list[str]:
    wrong = []
    bad = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if len(bad):
        wrong.append(f"points with NaN or infinite coordinates: {first_ids(bad)}")
    for table in mesh.cells.groups():
        bad = np.flatnonzero(((table < 0) | (table >= len(mesh.points))).any(axis=1))
        if len(bad):
            wrong.append(f"cells with node ids outside 0..{len(mesh.points) - 1}: {first_ids(bad)}")
    return wrong
