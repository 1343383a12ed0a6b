"""Lines between the regions of a surface: its materials, patches, groups and solids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hexconformal.geometry import Faces, edge_table
from hexconformal.mesh import REGION_ARRAYS, SURFACE_ARRAYS, Regions, find_regions

from ..mesh import Ints, SurfaceMesh

__all__ = ["Interfaces", "find_interfaces"]


@dataclass(frozen=True, eq=False)
class Interfaces:
    """Edges between cells of different regions.

    Attributes
    ----------
    regions
        The regions.
    edges, sides
        (k, 2) nodes of these edges, and the two cells beside each.
    """

    regions: Regions
    edges: Ints
    sides: Ints

    @classmethod
    def between(cls, regions: Regions, cells: Faces) -> Interfaces:
        """Those of a surface whose regions are known."""
        table = edge_table(cells)
        different = regions.labels[table.sides[:, 0]] != regions.labels[table.sides[:, 1]]
        return cls(regions, table.nodes[table.manifold[different]], table.sides[different])

    @property
    def note(self) -> str:
        """What is kept, in words."""
        return (
            f"interfaces: {self.regions}, {len(self.edges)} edges between them are kept: nodes slide along them, and "
            "stay where they meet or turn sharply"
        )


def find_interfaces(mesh: SurfaceMesh, interfaces: Any = "auto") -> Interfaces | None:
    """The lines between the regions of a surface; None where none are asked for, or there are none.

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
    found = None if regions is None else Interfaces.between(regions, mesh.cells)
    return found if found is not None and len(found.edges) else None
