"""A surface at one time of a flow, with its record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hexconformal.geometry import nodal_area_vectors, unit_vectors

from ..mesh import Floats, SurfaceMesh
from ..quality import smallest_angles
from .discrete import DiscreteSurface, Elements
from .options import Record

__all__ = ["Moment", "surface_with_arrays"]


@dataclass(frozen=True)
class Moment:
    """A surface at one time of a flow.

    Attributes
    ----------
    record
        Its numbers.
    points
        (n, 3) positions.
    """

    record: Record
    points: Floats
    _input: SurfaceMesh
    _elements: Elements
    _origin: Floats

    @property
    def mesh(self) -> Any:
        """The mesh in the type that came in, with arrays: normal, mean_curvature, curvature (|Y|), min_angle."""
        return self.surface_mesh.to_source_type()

    @property
    def surface_mesh(self) -> SurfaceMesh:
        """The same as a :class:`surface.SurfaceMesh`."""
        return surface_with_arrays(self.points, self._input, self._elements, self._origin)

    @property
    def moved_input(self) -> SurfaceMesh:
        """What came in, at the points of this moment, without its arrays."""
        return self._input.replaced(self.points)


def surface_with_arrays(points: Floats, mesh: SurfaceMesh, elements: Elements, origin: Floats) -> SurfaceMesh:
    """The input of a flow with other points, and the arrays of a moment."""
    cells = mesh.cells
    normals = unit_vectors(nodal_area_vectors(points, cells))
    y = DiscreteSurface(elements, points - origin).nodal_curvature
    arrays = {
        "normal": normals,
        "mean_curvature": -(y * normals).sum(axis=1) / 2,
        "curvature": np.linalg.norm(y, axis=1),
    }
    return mesh.replaced(points, arrays, {"min_angle": smallest_angles(points, cells)})
