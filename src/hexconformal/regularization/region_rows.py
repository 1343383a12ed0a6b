"""The rows of a report on the regions of a mesh and the interfaces between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common import aligned
from ..geometry import hausdorff
from ..mesh import SERIAL, HexMesh, Regions, Space, find_interfaces, triangles_first
from ..quality import Quality, measure_regions

__all__ = ["InterfaceRow", "RegionRow", "interface_rows", "region_rows", "table_lines"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_MEASURED = 500  # interfaces that are measured one by one, which takes some milliseconds each
_SHOWN = 12  # rows in the text
_IN_JSON = ", in the JSON"


@dataclass(frozen=True)
class RegionRow:
    """A region of the mesh before and after.

    Attributes
    ----------
    name
        What it is called.
    cells
        Number of its cells.
    volume_before, volume_after
        Sum of their volumes, in the mesh's unit of length cubed.
    min_scaled_jacobian_before, min_scaled_jacobian_after, mean_scaled_jacobian_before, mean_scaled_jacobian_after
        Smallest and mean scaled Jacobian.
    inverted_before, inverted_after
        Cells whose scaled Jacobian is not positive.
    """

    name: str
    cells: int
    volume_before: float
    volume_after: float
    min_scaled_jacobian_before: float
    min_scaled_jacobian_after: float
    mean_scaled_jacobian_before: float
    mean_scaled_jacobian_after: float
    inverted_before: int
    inverted_after: int

    @property
    def volume_change(self) -> float:
        """Change of the volume relative to its size before; 0 if there was none."""
        before = self.volume_before
        return (self.volume_after - before) / abs(before) if before else 0.0


@dataclass(frozen=True)
class InterfaceRow:
    """The faces between two regions.

    Attributes
    ----------
    regions
        Names of the two.
    quads
        Number of faces.
    distance
        Hausdorff distance of these faces from where they were, over the diagonal of the mesh; None where interfaces
        are so many that they were measured all together.
    moved
        Number of their nodes that are not where they were.
    """

    regions: tuple[str, str]
    quads: int
    distance: float | None
    moved: int


def region_rows(regions: Regions, before: Quality, after: Quality, space: Space = SERIAL) -> tuple[RegionRow, ...]:
    """A row for each region of a mesh, of whose cells every part of a space may have some."""
    one, other = (measure_regions(regions, measured, space) for measured in (before, after))
    columns = (
        *(regions.names, one.cells, one.volume, other.volume),
        *(one.min_scaled_jacobian, other.min_scaled_jacobian, one.mean_scaled_jacobian, other.mean_scaled_jacobian),
        *(one.inverted, other.inverted),
    )
    return tuple(RegionRow(*row) for row in zip(*(np.asarray(column).tolist() for column in columns), strict=True))


def interface_rows(
    regions: Regions, mesh: HexMesh, points: Field, diagonal: float, count: int | None = None
) -> tuple[tuple[InterfaceRow, ...], list[str]]:
    """A row for each pair of regions that meet, and notes.

    Parameters
    ----------
    regions
        The regions of the mesh.
    mesh
        The mesh before.
    points
        (n, 3) where its points are after.
    diagonal
        Length that distances are told in.
    count
        How many nodes count where it is told how many have moved, from the first on; default all.
    """
    interfaces = find_interfaces(mesh.cells, regions.labels)
    gone = (points != mesh.points).any(axis=1)
    gone[count:] &= count is None
    moved = np.array([np.count_nonzero(gone[np.unique(part)]) for part in interfaces.parts()], dtype=np.int64)
    notes: list[str] = []
    distances: list[float | None]
    if np.count_nonzero(moved) <= _MEASURED:
        parts = zip(interfaces.parts(), moved, strict=True)
        distances = [hausdorff(points, mesh.points, part) / diagonal if any_moved else 0.0 for part, any_moved in parts]
    else:
        away = moved > 0
        faces = interfaces.quads[away[interfaces.owners]]
        largest = hausdorff(points, mesh.points, faces[triangles_first(faces)]) / diagonal
        notes = [f"interfaces: {away.sum()} moved, measured all together: by at most {largest:.3g} diagonals"]
        distances = [None if any_moved else 0.0 for any_moved in away]
    names = [(regions.names[one], regions.names[other]) for one, other in interfaces.pairs.tolist()]
    columns = names, interfaces.counts.tolist(), distances, moved.tolist()
    return tuple(InterfaceRow(*row) for row in zip(*columns, strict=True)), notes


def table_lines(regions: Sequence[RegionRow], interfaces: Sequence[InterfaceRow]) -> list[str]:
    """The rows as lines of text: a table of regions, and one of interfaces, those that moved farthest first if many."""
    lines: list[str] = []
    if regions:
        head = ("region", "cells", "volume", "change", "min SJ", "after", "mean SJ", "after", "inverted", "after")
        rows = [
            (
                *(row.name, str(row.cells), f"{row.volume_before:.5g}", f"{row.volume_change:+.1e}"),
                *(f"{row.min_scaled_jacobian_before:.3f}", f"{row.min_scaled_jacobian_after:.3f}"),
                *(f"{row.mean_scaled_jacobian_before:.3f}", f"{row.mean_scaled_jacobian_after:.3f}"),
                *(str(row.inverted_before), str(row.inverted_after)),
            )
            for row in regions
        ]
        lines += aligned(head, rows, _SHOWN, _IN_JSON)
    if interfaces:
        if len(interfaces) > _SHOWN:
            interfaces = sorted(
                interfaces, key=lambda row: (row.distance is not None, -(row.distance or 0.0), -row.moved)
            )
        described = [
            (
                " | ".join(row.regions),
                str(row.quads),
                "-" if row.distance is None else f"{row.distance:.3g}",
                str(row.moved),
            )
            for row in interfaces
        ]
        lines += aligned(("interface", "faces", "distance / diagonal", "nodes moved"), described, _SHOWN, _IN_JSON)
    return lines
