"""Lines between the regions of a surface: its materials, patches, groups and solids."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hexconformal.geometry import edge_table
from hexconformal.mesh import REGION_ARRAYS, SURFACE_ARRAYS, Regions, find_regions

from ..mesh import Ints, SurfaceMesh

__all__ = ["Interfaces", "find_interfaces"]


def _no_edges() -> Ints:
    return np.empty((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Interfaces:
    """Edges between cells of different regions.

    Attributes
    ----------
    regions
        The regions; None where there is one.
    edges, sides
        (k, 2) nodes of these edges, and the two cells beside each.
    """

    regions: Regions | None = None
    edges: Ints = field(default_factory=_no_edges)
    sides: Ints = field(default_factory=_no_edges)

    def notes(self, what: str) -> tuple[str, ...]:
        """What becomes of them, in words; empty where there are none."""
        found = f"interfaces: {self.regions}, {len(self.edges)} edges between them {what}"
        return (found,) if len(self.edges) else ()


def find_interfaces(mesh: SurfaceMesh, interfaces: Any = "auto") -> Interfaces:
    """The lines between the regions of a surface.

    Parameters
    ----------
    mesh
        The surface.
    interfaces
        As :func:`hexconformal.mesh.find_regions` takes it; arrays that tell surfaces apart count among those with
        names of regions.

    Raises
    ------
    OptionError
        If the name is unknown, or the numbers are not one integer per cell.

    Examples
    --------
    >>> square, cells = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), [[0, 1, 2], [0, 2, 3]]
    >>> find_interfaces(SurfaceMesh(square, cells, cell_data={"patch": [4, 5]}), "patch").edges
    array([[0, 2]])
    """
    regions = find_regions(mesh, interfaces, (*REGION_ARRAYS, *SURFACE_ARRAYS))
    if regions is None:
        return Interfaces()
    table = edge_table(mesh.cells)
    different = regions.labels[table.sides[:, 0]] != regions.labels[table.sides[:, 1]]
    return Interfaces(regions, table.nodes[table.manifold[different]], table.sides[different])
