"""Pictures of meshes of volume cells: histograms of quality, cells before and after, the worst cells."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, check_writable
from ..io import as_volume_mesh
from ..mesh import collapsed_mesh, find_regions
from ..quality import Quality, quality
from . import canvas
from .canvas import PICTURE_EXTENSIONS, VIEW_DIRECTION, require_rendering
from .drawn_faces import outer_faces
from .region_scene import region_scene

__all__ = ["before_after", "histogram", "worst_cells"]

_MEASURE = "scaled Jacobian"
_LOGARITHMIC_FROM = 20  # edge ratio from which on the axis is logarithmic


def histogram(path: Any, before: Any, after: Any = None) -> None:
    """Draw how scaled Jacobian, shape, conformal distortion and edge ratio are distributed over the cells.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Meshes (anything :func:`hexconformal.as_volume_mesh` takes), or their :class:`hexconformal.Quality`.

    Raises
    ------
    WriteError
        If the file cannot be written.

    Examples
    --------
    >>> from hexconformal.generate import box, sheared_cube
    >>> histogram("quality.png", sheared_cube(6), box((6, 6, 6)))
    """
    path = Path(path)
    check_writable(path, PICTURE_EXTENSIONS)
    measured = [_measured(mesh) for mesh in (before, after) if mesh is not None]
    histograms = []
    for name, title in _PANELS:
        groups = [np.asarray(getattr(one, name)) for one in measured]
        edges = _bins(name, np.concatenate(groups))
        histograms.append(canvas.Histogram(title, groups, edges, logarithmic=edges[-1] >= _LOGARITHMIC_FROM))
    canvas.draw_histograms(path, f"Quality of {len(measured[0].cells)} cells: share of the cells by", histograms)


_PANELS = (
    ("scaled_jacobian", "scaled Jacobian (1 is best)"),
    ("shape", "shape, mean ratio (1 is best)"),
    ("conformal_distortion", "conformal distortion (0 is best)"),
    ("edge_ratio", "edge ratio (1 is best)"),
)


def before_after(path: Any, before: Any, after: Any, interfaces: Any = "auto") -> None:
    """Draw a mesh before and after, side by side, cut open and coloured by scaled Jacobian; curved cells are curved.

    The cells whose centre after lies in the octant that faces the viewer are left out of both. Beside them, where the
    mesh has regions, these are drawn as they are after, each in a colour, and the interfaces also where it is cut open.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Two meshes with the same cells, anything :func:`hexconformal.as_volume_mesh` takes.
    interfaces
        What tells regions apart, as in :class:`hexconformal.Options`.

    Raises
    ------
    MeshError
        If they do not have the same cells.
    OptionError
        If `interfaces` is the name of no array, or not one integer for each cell.
    WriteError
        If the file cannot be written, or this machine cannot draw in three dimensions.
    """
    path = Path(path)
    check_writable(path, PICTURE_EXTENSIONS)
    given = as_volume_mesh(before), as_volume_mesh(after)
    if not np.array_equal(given[0].cells, given[1].cells):
        raise MeshError("before and after must have the same cells")
    regions = find_regions(collapsed_mesh(given[0]), interfaces)
    require_rendering()
    meshes = quality(given[0]), quality(given[1])
    kept = ~_in_front_octant(meshes[1])
    scenes = [
        canvas.Scene(title, mesh.scaled_jacobian, partial(_add_cells, mesh=mesh, kept=kept))
        for title, mesh in zip(("before", "after"), meshes, strict=True)
    ]
    if regions is not None:
        scenes.append(region_scene(meshes[1].points, meshes[1].cell_blocks(), regions, kept))
    canvas.side_by_side(path, scenes, _bounding_box(meshes), _MEASURE)


def worst_cells(path: Any, before: Any, after: Any = None, count: int = 20) -> None:
    """Draw the worst cells of a mesh, or of one before and after, solid inside the translucent boundary.

    Each mesh shows its own worst cells, with a ring around those that would be too small to be seen.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Meshes (anything :func:`hexconformal.as_volume_mesh` takes), or their :class:`hexconformal.Quality`.
    count
        Number of cells, those with the smallest scaled Jacobian.

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
    scenes = canvas.label_before_after([_worst(mesh, count) for mesh in measured])
    canvas.side_by_side(path, scenes, _bounding_box(measured), _MEASURE)


def _worst(mesh: Quality, count: int) -> canvas.Scene:
    worst = mesh.worst(count)
    shown = np.zeros(len(mesh.cells), dtype=bool)
    shown[worst] = True

    def draw(plotter: Any) -> None:
        everything = np.ones(len(shown), dtype=bool)
        canvas.add_translucent(plotter, outer_faces(mesh.points, mesh.cell_blocks(), everything))
        _add_cells(plotter, mesh, shown)

    return canvas.worst_scene(mesh.scaled_jacobian, mesh.points[mesh.cells[worst]], draw)


def _measured(mesh: Any) -> Quality:
    return mesh if isinstance(mesh, Quality) else quality(mesh)


def _bins(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    if name == "edge_ratio":
        largest = float(values[np.isfinite(values)].max(initial=1.1))
        return np.linspace(1, largest, 41) if largest < _LOGARITHMIC_FROM else np.geomspace(1, largest, 41)
    return np.linspace(min(float(np.floor(10 * values.min()) / 10), 0), 1, 41)


def _in_front_octant(mesh: Quality) -> NDArray[np.bool_]:
    """(m,) cells whose centre lies in the octant, of the box around the mesh, that faces the viewer."""
    centres = mesh.points[mesh.cells].mean(axis=1)
    middle = (centres.min(axis=0) + centres.max(axis=0)) / 2
    size = float(np.ptp(centres, axis=0).max())
    facing: NDArray[np.bool_] = ((centres - middle) * np.sign(VIEW_DIRECTION) > 1e-6 * size).all(axis=1)
    return facing if not facing.all() else ~facing


def _bounding_box(meshes: Sequence[Quality]) -> list[float]:
    return canvas.bounding_box(*(mesh.points[block.cells] for mesh in meshes for block in mesh.cell_blocks()))


def _add_cells(plotter: Any, mesh: Quality, kept: NDArray[np.bool_]) -> None:
    faces = outer_faces(mesh.points, mesh.cell_blocks(), kept)
    canvas.add_faces(plotter, faces, mesh.scaled_jacobian[faces.owners])
