"""The surface that a user gives: as the mesh is normalized, the outside out, and matched with the mesh's skin."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError
from ..formulation import Schedules
from ..geometry import (
    Matching,
    Skin,
    SurfaceLocator,
    enclosed_volume,
    find_features,
    match_features,
    with_one_side_out,
)
from ..io import read_surface
from ..mesh import NormalizedMesh
from .options import Options

__all__ = ["Fit", "fit_to", "given_surface"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]

_APART = 0.2  # diagonals between the sides of the boxes of mesh and surface from which on they are strangers


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the skin belongs on another surface, and what is told of it; None where no feature is matched."""

    matching: Matching | None
    note: str


def given_surface(normalized: NormalizedMesh, surface: Any) -> SurfaceLocator | None:
    """The surface to slide on, if the user gives one, normalized as the mesh, with the outside out."""
    if surface is None:
        return None
    if isinstance(surface, str) or hasattr(surface, "__fspath__"):
        surface = read_surface(surface)
    given = SurfaceLocator.from_pyvista(surface)
    _require_near(normalized, given)
    return SurfaceLocator(normalized.from_user(given.points), given.faces)


def fit_to(
    normalized: NormalizedMesh, surface: SurfaceLocator, options: Options, schedules: Schedules, fixed: Mask
) -> Fit:
    """Match the skin of a mesh with a surface that has features, and tell how; fixed components (n, 3) stay."""
    tolerance = options.hausdorff * normalized.diagonal
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    faces = with_one_side_out(surface.faces)
    surface = SurfaceLocator(surface.points, faces if enclosed_volume(surface.points, faces) >= 0 else faces[:, ::-1])
    features = find_features(surface.points, surface.faces, **how)
    if not features.soft:
        # Averages of normals tell noise from creases, but lead these past a triangle where two of its edges are sharp.
        how["schedule"] = replace(schedules.features, filterings=0)
        features = find_features(surface.points, surface.faces, **how)
    if features.soft or len(features.edges) == 0:
        return Fit(None, f"features of the surface: {features.reason}")
    skin = Skin(normalized.points, normalized.quads, normalized.cells)
    matching = match_features(skin, surface, features, schedules.barrier.flat * tolerance, schedules.matching)
    what = f"features of the surface: {features.reason}"
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
