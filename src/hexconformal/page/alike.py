"""What one page can show: meshes with the same cells, at places that are numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..common import MeshError, unusable_points
from ..geometry import Faces

__all__ = ["have_same_cells", "require_alike", "require_places"]


def have_same_cells(one: Any, other: Any) -> bool:
    """Whether two meshes of volumes, or two surfaces, have as many points, and the same cells in the same order.

    Examples
    --------
    >>> from hexconformal import HexMesh
    >>> from hexconformal.generate import box
    >>> points, cells = box((2, 1, 1))
    >>> mesh = HexMesh(points, cells)
    >>> have_same_cells(mesh, HexMesh(2 * points, cells)), have_same_cells(mesh, HexMesh(points, cells[::-1]))
    (True, False)
    """
    if len(one.points) != len(other.points):
        return False
    tables = [mesh.cells.tables if isinstance(mesh.cells, Faces) else (mesh.cells,) for mesh in (one, other)]
    return len(tables[0]) == len(tables[1]) and all(map(np.array_equal, *tables))


def require_places(mesh: Any, name: str = "") -> None:
    """Raise a MeshError where points of a mesh cannot be drawn; the name, if there is one, says of which."""
    bad, text = unusable_points(mesh.points, mesh.node_labels)
    if len(bad):
        raise MeshError(f"{name}: {text}" if name else text)


def require_alike(meshes: Sequence[Any]) -> None:
    """Raise a MeshError where meshes, one or two of them, cannot be before and after on one page."""
    if not have_same_cells(meshes[0], meshes[-1]):
        raise MeshError("before and after must have the same cells, in the same order")
    for mesh in meshes:
        require_places(mesh)
