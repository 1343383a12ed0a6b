"""Pages of surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal.geometry import find_features
from hexconformal.mesh import REGION_ARRAYS, SURFACE_ARRAYS, find_regions
from hexconformal.page import Cells, Frame, Measure, Page, PageSchedule, ReportText, require_alike, with_distances

from ..io import as_surface_mesh
from ..mesh import SurfaceMesh
from ..quality import quality

__all__ = ["surface_page"]

_MEASURES = (
    Measure("min_angle", "smallest angle", "high", (0.0, None)),
    Measure("max_angle", "largest angle", "low", (60.0, 180.0)),
    Measure("conformality", "conformality s2 / s1", "high", (0.0, 1.0), folded_at_zero=True),
    Measure("radius_ratio", "radius ratio", "high", (0.0, 1.0)),
    Measure("scaled_jacobian", "scaled Jacobian", "high", (0.0, 1.0), folded_at_zero=True),
    Measure("dilatation", "dilatation s1 / s2", "low", (1.0, None), is_ratio=True),
    Measure("conformal_distortion", "conformal distortion", "low", (0.0, None)),
    Measure("area", "area", None, is_ratio=True),
)


def surface_page(
    before: Any,
    after: Any = None,
    *,
    frames: Sequence[Frame] = (),
    ends: Sequence[tuple[str, float | None]] = (("before", None), ("after", None)),
    report: Any = "",
    curves: Sequence[Mapping[str, Any]] = (),
    interfaces: Any = "auto",
    title: str = "",
    schedule: PageSchedule | None = None,
) -> Page:
    """The page of a surface, or of one before and after.

    Parameters
    ----------
    before, after
        Surfaces with the same cells, anything :func:`surface.as_surface_mesh` takes; None for after: one surface.
    frames
        The surface at times between them.
    ends
        What the page calls the two, and where they are on the axis of the curves.
    report
        Of the run: its text, options and notes.
    curves
        Of the run, see :func:`hexconformal.page.curves_of`.
    interfaces
        What tells regions apart, as in :class:`surface.Options`.
    title
        Of the page; that of the file that the surface was read from if it is empty.
    schedule
        How much the page holds.

    Raises
    ------
    MeshError
        If the surfaces do not have the same cells, or points are not finite.

    Examples
    --------
    >>> import pyvista as pv
    >>> page = surface_page(pv.Icosphere(nsub=1))
    >>> page, page.subtitle
    (Page(80 cells, 1 frames), '80 triangles')
    """
    meshes = [as_surface_mesh(mesh) for mesh in (before, after) if mesh is not None]
    require_alike(meshes)
    mesh = meshes[0]
    named = ends if len(meshes) == 2 else [(title or _title(mesh), None)]
    outer = [_measured(one, *which) for one, which in zip(meshes, named, strict=True)]
    if len(meshes) == 2:
        outer = with_distances(outer, mesh.cells.table)
    t, q = len(mesh.cells.triangles), len(mesh.cells.quads)
    table = mesh.cells.table
    faces = table[:, [0, 1, 2, 2]] if table.shape[1] == 3 else table
    kinds = [(t, "triangle"), (q, "quadrilateral")]
    cells = Cells(
        faces,
        np.stack([np.arange(t + q), np.full(t + q, -1)], axis=1),
        tuple(name for count, name in kinds if count),
        np.repeat([0, int(t > 0)], [t, q]),
        t + q,
        labels=mesh.rows if mesh.cell_labels is None else mesh.cell_labels,
    )
    regions = find_regions(mesh, interfaces, (*REGION_ARRAYS, *SURFACE_ARRAYS))
    features = find_features(mesh.points, mesh.cells)
    measures = [one for one in _MEASURES if one.name in outer[0].cell_data]
    return Page(
        title or _title(mesh),
        ", ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in kinds if count),
        cells,
        [outer[0], *frames, *outer[1:]],
        measures,
        "conformality",
        None if regions is None else (regions.labels, regions.names),
        None if features.soft else (features.edges, features.corners),
        ReportText.of(report),
        curves,
        PageSchedule() if schedule is None else schedule,
    )


def _measured(mesh: SurfaceMesh, name: str, position: float | None) -> Frame:
    measures = {name: values for name, values in quality(mesh).arrays().items() if not np.isnan(values).all()}
    return Frame(name, mesh.points, {**mesh.cell_data, **measures}, mesh.point_data, position)


def _title(mesh: SurfaceMesh) -> str:
    file = getattr(mesh.origin, "file", None)
    return "surface" if file is None else Path(file.path).name
