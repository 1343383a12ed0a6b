"""Remeshing in one call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hexconformal.common import options_from

from .options import Options, Record
from .result import Result
from .run import Remeshing

__all__ = ["remesh"]


def remesh(mesh: Any, *, callback: Callable[[Record], None] | None = None, **options: Any) -> Result:
    """Make the cells of a surface regular by minimizing their quaternionic conformal distortion.

    Nodes slide along the surface, sharp edges and boundary curves (Gruber & Aulisa, eq. 2): equation (16) is minimized
    under the constraint of equation (17); connectivity stays. No cell turns over, closed pieces keep their volume, and
    neither the smallest angle (by more than a thousandth of it) nor the mean one gets worse. At the end the surface is
    brought nearer to the input, for half a degree of each at most, and for no more than a tenth of what it gained. An
    input is about as good as it gets, and comes back as it is, if the energy would fall by less than a tenth, or if the
    smallest angle would gain less than a tenth and the mean one less than a tenth of what it misses (with
    `emphasis="worst"`: 2 % of the one and 0.1 degrees of the other). Where the run took the surface more than half as
    far away as it may, one of them must gain at least 15 % of what it misses.

    Parameters
    ----------
    mesh
        A path, a pyvista surface, a meshio.Mesh, a :class:`surface.SurfaceMesh` or a tuple ``(points, cells)`` of
        triangles or quadrilaterals. It is not changed.
    callback
        Called with the record of every iteration.
    **options
        Fields of :class:`surface.Options`: target, energy, emphasis, max_iterations, energy_tolerance, eps, normal,
        project, hausdorff, feature_angle, feature_edges, interfaces, boundary, fixed.

    Returns
    -------
    Result
        With the mesh in the type that came in, a report and the history.

    Raises
    ------
    MeshError
        If the surface cannot be worked on.
    ReadError
        If a file cannot be read.
    OptionError
        If an option is unknown or makes no sense.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.3, 0.8, 0]])
    >>> result = remesh((corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    >>> bool(result.report.after.min_angle > 44)
    True
    """
    run = Remeshing(mesh, options_from(Options, options))
    for record in run:
        if callback is not None:
            callback(record)
    return run.result()
