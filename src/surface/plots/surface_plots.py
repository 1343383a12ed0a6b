"""Pictures of surfaces: histograms of quality, cells before and after, the worst cells."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal.common import MeshError, OptionError, check_writable
from hexconformal.plots import PICTURE_EXTENSIONS, DrawnFaces, canvas, require_rendering

from ..io import as_surface_mesh
from ..mesh import Floats, Ints, SurfaceMesh
from ..quality import Quality, quality

__all__ = ["before_after", "histogram", "worst_cells"]

_MEASURE = "conformality s2 / s1"
_MANY_CELLS = 5000  # cells from which on their edges are drawn finer


def histogram(path: Any, before: Any, after: Any = None) -> None:
    """Draw how angles, conformality and areas are distributed over the cells.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Surfaces (anything :func:`surface.as_surface_mesh` takes), or their :class:`surface.Quality`.

    Raises
    ------
    WriteError
        If the file cannot be written.

    Examples
    --------
    >>> histogram("quality.png", (np.eye(3), [[0, 1, 2]]))
    """
    path = Path(path)
    check_writable(path, PICTURE_EXTENSIONS)
    groups = [_measured(mesh) for mesh in (before, after) if mesh is not None]
    ratio = [measured.area / measured.area.mean() for measured in groups]
    largest = max(float(part.max()) for part in ratio)
    worst = min(float(measured.conformality.min()) for measured in groups)
    histograms = [
        canvas.Histogram("smallest angle, degrees", [m.min_angle for m in groups], np.linspace(0, 90, 46)),
        canvas.Histogram("largest angle, degrees", [m.max_angle for m in groups], np.linspace(60, 180, 41)),
        canvas.Histogram(
            f"{_MEASURE} (1 is best)", [m.conformality for m in groups], np.linspace(min(0.0, worst), 1, 41)
        ),
        canvas.Histogram("area over the mean", ratio, np.linspace(0, max(largest, 2.0), 41)),
    ]
    canvas.draw_histograms(path, f"Quality of {len(groups[0].area)} cells: share of the cells by", histograms)


def before_after(path: Any, before: Any, after: Any) -> None:
    """Draw a surface before and after, side by side, coloured by conformality.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Two surfaces with the same cells, anything :func:`surface.as_surface_mesh` takes.

    Raises
    ------
    MeshError
        If they do not have the same cells.
    WriteError
        If the file cannot be written, or this machine cannot draw in three dimensions.
    """
    path = Path(path)
    check_writable(path, PICTURE_EXTENSIONS)
    measured = [quality(before), quality(after)]
    tables = [[part.tolist() for part in m.mesh.cells.tables] for m in measured]
    if tables[0] != tables[1]:
        raise MeshError("before and after must have the same cells")
    require_rendering()
    scenes = [
        canvas.Scene(title, m.conformality, partial(_add_cells, m=m))
        for title, m in zip(("before", "after"), measured, strict=True)
    ]
    canvas.side_by_side(path, scenes, _bounding_box(measured), _MEASURE)


def worst_cells(path: Any, before: Any, after: Any = None, count: int = 20) -> None:
    """Draw the worst cells of a surface, or of one before and after, solid on the translucent surface.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Surfaces (anything :func:`surface.as_surface_mesh` takes), or their :class:`surface.Quality`.
    count
        Number of cells, those with the smallest conformality.

    Raises
    ------
    OptionError
        If `count` is less than one.
    WriteError
        If the file cannot be written, or this machine cannot draw in three dimensions.
    """
    path = Path(path)
    check_writable(path, PICTURE_EXTENSIONS)
    if count < 1:
        raise OptionError(f"count must be 1 or more worst cells, not {count}")
    require_rendering()
    measured = [_measured(mesh) for mesh in (before, after) if mesh is not None]
    canvas.side_by_side(
        path, canvas.label_before_after([_worst(m, count) for m in measured]), _bounding_box(measured), _MEASURE
    )


def _worst(m: Quality, count: int) -> canvas.Scene:
    worst = m.worst(count)

    def draw(plotter: Any) -> None:
        canvas.add_translucent(plotter, _faces(m.mesh, np.arange(len(m.area))))
        canvas.add_faces(plotter, _faces(m.mesh, worst), m.conformality[worst])

    return canvas.worst_scene(
        m.conformality, np.stack([_four_corners(m.corners(place)) for place in worst.tolist()]), draw
    )


def _add_cells(plotter: Any, m: Quality) -> None:
    width = 2.2 if len(m.area) < _MANY_CELLS else 0.8
    canvas.add_faces(plotter, _faces(m.mesh, np.arange(len(m.area))), m.conformality, width)


def _measured(mesh: Any) -> Quality:
    return mesh if isinstance(mesh, Quality) else quality(as_surface_mesh(mesh))


def _bounding_box(measured: list[Quality]) -> list[float]:
    return canvas.bounding_box(*(m.mesh.points[m.mesh.cells.nodes()] for m in measured))


def _four_corners(corners: Floats) -> Floats:
    return np.concatenate([corners, corners[:1]])[:4]


def _faces(mesh: SurfaceMesh, places: Ints) -> DrawnFaces:
    """Some cells, in the order asked for."""
    table = np.concatenate([mesh.cells.triangles[:, [0, 1, 2, 2]], mesh.cells.quads])
    return DrawnFaces.straight(mesh.points, table[places])
