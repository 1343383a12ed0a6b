"""The boundary of a run: what is held exactly, and the band that keeps the rest near the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .band import Band
from .closest import Surface
from .constraint import Constraint, boundary_constraint, fixed_components, free_directions, planar_normals
from .errors import OptionError
from .features import Features, find_features, surface_tags
from .frame import Frame
from .options import Options

__all__ = ["Boundary", "boundary_of"]


@dataclass(frozen=True)
class Boundary:
    """How the boundary of a mesh is kept.

    Attributes
    ----------
    constraint
        What nodes may do exactly: stay, slide along a straight line, slide in a plane.
    band
        Keeps curved parts near the surface; None where there are none that may move.
    features
        Feature curves and corners; None where nothing slides.
    notes
        What was decided, in words.
    """

    constraint: Constraint
    band: Band | None = None
    features: Features | None = None
    notes: tuple[str, ...] = ()


def boundary_of(frame: Frame, options: Options) -> Boundary:
    """The boundary as the options ask for it.

    Flat parts, straight feature edges, and the corners between them are kept exactly. Everything else slides in
    a band around the surface.

    Raises
    ------
    OptionError
        If masks or modes make no sense.
    """
    fixed = fixed_components(frame.mesh, options.fixed)
    if options.boundary != "slide" or options.hausdorff == 0.0 or options.energy == "quaternionic":
        return Boundary(boundary_constraint(frame.start, frame.quads, options.boundary, fixed))
    tolerance = options.hausdorff * frame.diagonal
    reference = _reference(frame, options.surface)
    tags = surface_tags(frame.mesh, frame.quads)
    features = find_features(frame.start, frame.quads, tags=tags, mode=options.features, tolerance=tolerance)
    sums = planar_normals(frame.start, frame.quads)
    free = free_directions(sums)
    exact = np.zeros(len(sums), dtype=bool)
    if not features.soft and reference is None:
        exact[features.edges] = free[features.edges] == 1
        exact[features.corners] |= free[features.corners] == 0
        exact[frame.quads] |= free[frame.quads] == 2
    sliding = np.zeros(len(sums), dtype=bool)
    sliding[frame.quads] = True
    sliding &= ~exact & ~fixed.all(axis=1)
    constraint = Constraint.from_sums(np.where(exact[:, None, None], sums, 0.0), fixed)
    notes = (f"features: {features.reason}",)
    if not sliding.any():
        return Boundary(constraint, None, features, notes)
    original = Surface(frame.start, frame.quads)
    return Boundary(constraint, Band(original, tolerance, features, reference=reference), features, notes)


def _reference(frame: Frame, surface: Any) -> Surface | None:
    """The surface to slide on, if the user gives one, in the run's frame."""
    if surface is None:
        return None
    if isinstance(surface, (str, bytes)) or hasattr(surface, "__fspath__"):
        from .io import read_surface

        surface = read_surface(surface)
    given = Surface.from_pyvista(surface)
    if len(given.faces) == 0:
        raise OptionError("the surface to slide on has no faces")
    return Surface(frame.from_user(given.points), given.faces)
