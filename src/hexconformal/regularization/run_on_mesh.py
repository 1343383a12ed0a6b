"""The one call: a run of the kind that a mesh needs, to its end."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from ..common import OptionError, options_from
from ..io import as_volume_mesh
from ..mesh import blocks_of
from .options import Options, Record
from .quadratic import QuadraticRegularization
from .report import Result
from .run import Regularization

__all__ = ["regularize", "run_on"]


def run_on(mesh: Any, options: Options, start: Any = None) -> Regularization | QuadraticRegularization:
    """The run for a mesh: of linear cells, or of quadratic ones; it may go on from a start.

    Raises
    ------
    OptionError
        If there is a start for a mesh with quadratic cells, where that is not there yet.
    """
    taken = as_volume_mesh(mesh)
    curved = any(block.cell_type.straight for block in blocks_of(taken))
    # A file is read once; other meshes come back in the type that they have.
    given = taken if isinstance(mesh, str | os.PathLike) else mesh
    if not curved:
        return Regularization(given, options, start=start)
    if start is not None:
        raise OptionError("for cells of second order there is no start yet: hand in the half-done mesh instead")
    return QuadraticRegularization(given, options)


def regularize(
    mesh: Any, *, callback: Callable[[Record], None] | None = None, start: Any = None, **options: Any
) -> Result:
    """Make the cells of a mesh regular by minimizing their quaternionic conformal distortion.

    The distortion of the planes (e1, e2), (e1, e3), (e2, e3) of every cell is summed and minimized over the node
    positions (Gruber & Aulisa, volumetric remeshing): equation (6), in the form of equation (8) unless the
    quaternionic energy itself is asked for. A cell that is valid stays valid in every iteration.

    Parameters
    ----------
    mesh
        A path, a pyvista grid, a meshio.Mesh, a :class:`hexconformal.HexMesh` or MixedMesh, or a tuple
        ``(points, cells)``, of hexahedra, or with cells by the name of their type, ``{"tetra": ..., "wedge": ...}``.
        It is not changed. Cells of second order are worked on as they are,
        with the options on the boundary, on what is kept, and `emphasis`.
    callback
        Called with the record of every iteration.
    start
        The (n, 3) points that an earlier run of the same mesh has come to, or a mesh with the same nodes, or its path:
        the run goes on from there, with the surface, features, sizes and targets of `mesh`. The result is no worse than
        either: the worst cells of no type are worse than at the start. Not for quadratic cells, nor with `surface`.
    **options
        Fields of :class:`hexconformal.Options`, which tells more of each.

        How the shape is kept: `boundary` ("slide", "fixed", "free"), `hausdorff` (how far a curved boundary may
        move, in diagonals of the bounding box), `constraint` ("barrier", "compatible", relaxed by `eps`), `features`
        ("auto", "keep", "soft": sharp edges and corners; `feature_band`: how far they may move), `surface` (another
        one to slide on, with its features), `interfaces` (between regions: "auto", "ignore", an array), `couplings`
        (nodes that move together: "auto", "ignore", pairs), `conserve_volume`, `fixed` (nodes to hold).

        What is minimized: `target` (the perfect cell), `sizes` ("input", "free", or target volumes), `weight`
        ("reference", "volume"), `energy` ("barrier", "quaternionic"), `quadrature` ("auto", "gauss", "corners"),
        `method` ("auto", "lbfgs", "newton", "majorize"), `emphasis` ("auto", "worst", "mean": raise the worst cells,
        or not), `gradient_tolerance`, `max_iterations`.

    Returns
    -------
    Result
        With the mesh in the type that came in, a report, and the history. Not to converge is no error: the
        report gives the reason.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, or `surface` is not that of the mesh; if the start inverts valid cells, moves
        nodes that are held, or leaves the bound of the surface.
    ReadError
        If a file cannot be read.
    OptionError
        If an option is unknown or makes no sense.

    Examples
    --------
    >>> from hexconformal.generate import cylinder, jittered, sheared_cube
    >>> result = regularize(sheared_cube(6))
    >>> result.converged, bool(result.report.after.scaled_jacobian.min > 0.9999)
    (True, True)

    A curved boundary slides, here within a thousandth of the diagonal, and encloses the volume that it did.

    >>> report = regularize(jittered(*cylinder(4, 3, 6), 0.3), hausdorff=0.001, conserve_volume=True).report
    >>> bool(report.hausdorff <= 0.001), bool(abs(report.volume_change) < 1e-10)
    (True, True)
    >>> sorted(report.options)  # doctest: +NORMALIZE_WHITESPACE
    ['boundary', 'conserve_volume', 'constraint', 'couplings', 'emphasis', 'energy', 'eps', 'feature_band',
     'features', 'fixed', 'gradient_tolerance', 'hausdorff', 'interfaces', 'max_iterations', 'method', 'quadrature',
     'sizes', 'surface', 'target', 'weight']
    """
    run = run_on(mesh, options_from(Options, options), start)
    for record in run:
        if callback is not None:
            callback(record)
    return run.result()
