"""The surface that a user gives: as the mesh is normalized, the outside out, and matched with the mesh's skin."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError
from ...formulation import Schedules
from ...geometry import (
    Matching,
    Skin,
    SurfaceLocator,
    enclosed_volume,
    find_features,
    match_features,
    with_one_side_out,
)
from ...io import read_surface, triangles_of
from ...mesh import CarriedCells, NormalizedMesh, telling_tags
from ..options import Options

__all__ = ["Fit", "GivenSurface", "fit_to"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_APART = 0.2  # diagonals between the sides of the boxes of mesh and surface from which on they are strangers


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the skin belongs on another surface, and what is told of it; None where no feature is matched."""

    matching: Matching | None
    note: str


@dataclass(frozen=True, eq=False)
class GivenSurface:
    """A surface to slide on, as the mesh is normalized.

    Attributes
    ----------
    locator
        Its triangles.
    tags
        (f,) tags of these; None where there are none.
    lines
        (k, 2) nodes of lines that it came with.
    """

    locator: SurfaceLocator
    tags: Ints | None
    lines: Ints | None

    @cached_property
    def outside_out(self) -> SurfaceLocator:
        """The triangles with the outside out, as far as the surface has one."""
        points, faces = self.locator.points, with_one_side_out(self.locator.faces)
        return SurfaceLocator(points, faces if enclosed_volume(points, faces) >= 0 else faces[:, ::-1])

    @classmethod
    def of(cls, normalized: NormalizedMesh, surface: Any) -> GivenSurface:
        """The surface that a user gives."""
        if isinstance(surface, str) or hasattr(surface, "__fspath__"):
            surface = read_surface(surface)
        poly = triangles_of(surface)
        given = SurfaceLocator.from_pyvista(poly)
        _require_near(normalized, given)
        lines = np.asarray(poly.field_data["lines"]) if "lines" in poly.field_data else None
        locator = SurfaceLocator(normalized.from_user(given.points), given.faces)
        arrays = {name: np.asarray(poly.cell_data[name]) for name in poly.cell_data}
        found = telling_tags(CarriedCells(given.faces, arrays), np.arange(len(given.faces)))
        return cls(locator, None if found is None else found[1], lines)


def fit_to(
    normalized: NormalizedMesh,
    surface: GivenSurface,
    options: Options,
    schedules: Schedules,
    tags: Ints | None,
    fixed: Mask,
) -> Fit:
    """Match the skin of a mesh with a surface that has features, and tell how; fixed components (n, 3) stay.

    Features are found by angle, by tags, by the lines that come with the surface, and at its borders. Curves between
    tags are matched with those between the same tags (q,) of the skin, others by where they are.
    """
    tolerance = options.hausdorff * normalized.diagonal
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    how |= {"tags": surface.tags, "curves": surface.lines}
    locator = surface.outside_out
    points = locator.points
    features = find_features(points, locator.faces, **how)
    if not features.soft:
        # Averages of normals tell noise from creases, but lead these past a triangle where two of its edges are sharp.
        how["schedule"] = replace(schedules.features, filterings=0)
        features = find_features(points, locator.faces, **how)
    what = f"features of the surface: {features.reason}"
    if features.soft or len(features.edges) == 0:
        return Fit(None, what)
    skin = Skin(normalized.points, normalized.quads, normalized.cells, tags)
    flat = schedules.barrier.flat * tolerance
    matching = match_features(skin, locator, features, flat, schedules.matching, surface.tags)
    if matching is None:
        return Fit(None, f"{what}; none of them is found in the mesh, whose skin is drawn to the surface alone")
    matching.points[fixed] = normalized.points[fixed]
    curves = [len(np.unique(found.curves)) for found in (matching.features, features)]
    corners = [len(found.corners) for found in (matching.features, features)]
    note = f"{what}; matched are {curves[0]} of {curves[1]} curves and {corners[0]} of {corners[1]} corners"
    return Fit(matching, note)


def _require_near(normalized: NormalizedMesh, given: SurfaceLocator) -> None:
    """Refuse a surface that cannot be that of the mesh: boxes are no farther apart than what they are around."""
    there, here = (
        given.points[given.faces].reshape(-1, 3),
        normalized.mesh.points[normalized.node_ids[normalized.referenced]],
    )
    boxes = [(x.min(axis=0), x.max(axis=0)) for x in (there, here)]
    sizes = [float(np.linalg.norm(high - low)) for low, high in boxes]
    apart = max(float(np.abs(a - b).max()) for a, b in zip(*boxes, strict=True))
    if apart > _APART * sizes[1]:
        (low, high), (low_here, high_here) = (tuple(", ".join(f"{x:.4g}" for x in end) for end in box) for box in boxes)
        raise MeshError(
            f"the surface is not that of the mesh: it reaches from ({low}) to ({high}), diagonal {sizes[0]:.4g}, the "
            f"mesh from ({low_here}) to ({high_here}), diagonal {sizes[1]:.4g}, a ratio of "
            f"{sizes[0] / sizes[1]:.3g}; is it another unit of length, another origin, or another file?"
        )
