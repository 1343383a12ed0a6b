"""Remeshing between the steps of a flow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import MeshError, options_from

from ..constraint import find_interfaces
from ..mesh import Floats, SurfaceMesh
from ..quality import held_nodes
from ..remeshing import Options, Remeshing

__all__ = ["Remesher"]

# A surface that flows is smooth or becomes so, and has no features; and it is remeshed again soon.
_DEFAULTS: dict[str, Any] = {"max_iterations": 1, "feature_angle": None, "emphasis": "worst"}


class Remesher:
    """Makes the cells of a surface regular, on the surface as it is now.

    Parameters
    ----------
    mesh
        The surface at the start of the flow.
    fixed
        (n,) nodes that stay.
    options
        Fields of :class:`surface.Options` that differ from the defaults for flows.
    early_iterations
        While the mesh of the input is improved.

    Attributes
    ----------
    notes
        What is kept, in words.
    """

    def __init__(
        self, mesh: SurfaceMesh, fixed: NDArray[np.bool_], options: Mapping[str, Any], early_iterations: int
    ) -> None:
        self._mesh = mesh
        given = options_from(Options, {**_DEFAULTS, "fixed": fixed, **options})
        found = find_interfaces(mesh, given.interfaces)
        self.notes = found.notes("go where the flow takes them: remeshing holds their nodes")
        # Sliding cuts the corners of a line, a little every time: over a run the line would go astray.
        held = held_nodes(mesh, given.fixed)
        held[found.edges] = True
        self._options = replace(given, fixed=held)
        self._mean = replace(self._options, emphasis="mean")
        self._early = replace(self._mean, max_iterations=max(self._options.max_iterations, early_iterations))

    def __call__(self, points: Floats, early: bool) -> Floats | None:
        """Positions (n, 3) after remeshing, more thorough at the beginning; None where nothing could be done."""
        mesh = self._mesh.replaced(points)
        for options in (self._early,) if early else (self._options, self._mean):
            try:
                run = Remeshing(mesh, options)
            except MeshError:
                # Close to a singularity cells vanish: the flow ends there by itself, and says where.
                return None
            for _ in run:
                pass
            if len(run.history) > 1:
                return run.last_points
            # Where the worst cells cannot be raised, the mean may still gain; not where the worst are at their best.
            if run.converged:
                break
        return None
