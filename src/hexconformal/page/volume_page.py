"""Pages of volume meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import find_features
from ..io import as_volume_mesh
from ..mesh import HexMesh, MixedMesh, blocks_of, boundary_quads, collapsed_mesh, counts_by_type, find_regions
from ..quality import quality
from .alike import require_alike
from .contents import Frame, Measure, ReportText
from .page import Page
from .schedule import PageSchedule
from .skin_distance import with_distances
from .volume_cells import volume_cells

__all__ = ["volume_page"]

_MEASURES = (
    Measure("scaled_jacobian", "scaled Jacobian", "high", (0.0, 1.0), folded_at_zero=True),
    Measure("minimum_jacobian", "minimum Jacobian", "high", (0.0, 1.0), folded_at_zero=True),
    Measure("shape", "shape", "high", (0.0, 1.0), folded_at_zero=True),
    Measure("conformal_distortion", "conformal distortion", "low", (0.0, None)),
    Measure("edge_ratio", "edge ratio", "low", (1.0, None), is_ratio=True),
    Measure("volume", "volume", None),
)


def volume_page(
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
    """The page of a mesh, or of one before and after.

    Parameters
    ----------
    before, after
        Meshes with the same cells, anything :func:`hexconformal.as_volume_mesh` takes; None for after: one mesh.
    frames
        The mesh at times between them.
    ends
        What the page calls the two, and where they are on the axis of the curves.
    report
        Of the run: its text, options and notes.
    curves
        Of the run, see :func:`hexconformal.page.curves_of`.
    interfaces
        What tells regions apart, as in :class:`hexconformal.Options`.
    title
        Of the page; that of the file that the mesh was read from if it is empty.
    schedule
        How much the page holds.

    Raises
    ------
    MeshError
        If the meshes do not have the same cells, or points are not finite.

    Examples
    --------
    >>> from hexconformal.generate import box, sheared_cube
    >>> page = volume_page(sheared_cube(3), box((3, 3, 3)), title="cube")
    >>> [frame.name for frame in page.frames], page.subtitle
    (['before', 'after'], '27 hexahedra')
    """
    meshes = [as_volume_mesh(mesh) for mesh in (before, after) if mesh is not None]
    require_alike(meshes)
    first = meshes[0]
    skin = boundary_quads(collapsed_mesh(first).cells)[0]
    named = ends if len(meshes) == 2 else [(title or _title(first), None)]
    outer = [_measured(mesh, *which) for mesh, which in zip(meshes, named, strict=True)]
    if len(meshes) == 2 and not any(block.cell_type.straight for block in blocks_of(first)):
        outer = with_distances(outer, skin)
    regions = find_regions(collapsed_mesh(first), interfaces)
    return Page(
        title or _title(first),
        counts_by_type(blocks_of(first)),
        volume_cells(first),
        [outer[0], *frames, *outer[1:]],
        _MEASURES,
        "scaled_jacobian",
        None if regions is None else (regions.labels, regions.names),
        _features(first, skin),
        ReportText.of(report),
        curves,
        PageSchedule() if schedule is None else schedule,
    )


def _measured(mesh: HexMesh | MixedMesh, name: str, position: float | None) -> Frame:
    return Frame(name, mesh.points, {**mesh.cell_data, **quality(mesh).arrays()}, mesh.point_data, position)


def _features(mesh: HexMesh | MixedMesh, skin: NDArray[np.int64]) -> tuple[Any, Any] | None:
    """Sharp edges and corners of the skin; None where they are noise or stair steps."""
    found = find_features(mesh.points, skin, cells=collapsed_mesh(mesh).cells)
    return None if found.soft else (found.edges, found.corners)


def _title(mesh: HexMesh | MixedMesh) -> str:
    file = getattr(mesh.origin, "file", None)
    return "mesh" if file is None else Path(file.path).name
