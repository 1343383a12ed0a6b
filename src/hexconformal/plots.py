"""Pictures: how quality is distributed, and what a mesh looks like inside, before and after."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import MeshError, OptionError, WriteError
from .io import check_writable, saving
from .mesh import HexMesh, as_hex_mesh
from .quality import Quality, quality
from .topology import boundary_quads

__all__ = ["PICTURES", "before_after", "histogram", "require_rendering", "worst_cells"]

PICTURES = (".pdf", ".png", ".svg")

_BEFORE, _AFTER = "#c8553d", "#2a6f97"
# Folded cells, then bad to good; readable for colour-blind eyes, and light enough for black edges.
_FOLDED = "#7b1fa2"
_BAD_TO_GOOD = ("#a4243b", "#d8572a", "#f4a259", "#f6e7b4", "#a9d6c6", "#5fa8b8")
_VIEW = np.array([0.92, -1.0, 0.72])  # from where the camera looks, and where the opened octant is
_PIXELS = 1100
_SMALL = 0.025  # of the picture; smaller cells get a ring
_LONG = 20  # edge ratio from which on the axis is logarithmic

# Without a graphics driver VTK does not fail, it crashes: so another process has to try.
_TRIAL = """
from vtkmodules.vtkRenderingCore import vtkRenderWindow
import vtkmodules.vtkRenderingOpenGL2
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.Render()
"""


def histogram(path: Any, before: Any, after: Any = None) -> None:
    """Draw how scaled Jacobian, shape, conformal distortion and edge ratio are distributed over the cells.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Meshes (anything :func:`hexconformal.as_hex_mesh` takes), or what :func:`hexconformal.quality` said of them.

    Raises
    ------
    WriteError
        If the file cannot be written.

    Examples
    --------
    >>> from hexconformal.generate import box, sheared_cube
    >>> histogram("quality.png", sheared_cube(6), box((6, 6, 6)))
    """
    from matplotlib.figure import Figure

    path = Path(path)
    check_writable(path, PICTURES)
    before = _measured(before)
    groups = [("before" if after is not None else "cells", before, _BEFORE if after is not None else _AFTER)]
    if after is not None:
        groups.append(("after", _measured(after), _AFTER))
    figure = Figure(figsize=(9, 7))
    panels = figure.subplots(
        2, 2, gridspec_kw={"left": 0.075, "right": 0.98, "top": 0.85, "hspace": 0.52, "bottom": 0.05}
    )
    for axes, (name, title) in zip(panels.flat, _PANELS, strict=True):
        columns = [np.asarray(getattr(measured, name)) for _, measured, _ in groups]
        edges = _bins(name, np.concatenate(columns))
        for number, ((label, _, colour), values) in enumerate(zip(groups, columns, strict=True)):
            share = 100 * np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / len(values)
            axes.stairs(share, edges, fill=True, color=colour, alpha=0.35)
            axes.stairs(share, edges, color=colour, linewidth=1.2)
            place = (0, 1.05 + 0.075 * (len(groups) - 1 - number))
            axes.text(*place, f"{label}: {_range(values)}", color=colour, fontsize=9, transform=axes.transAxes)
        axes.set_title(title, fontsize=10, loc="left", pad=20 + 12 * (len(groups) - 1), fontweight="bold")
        axes.set_yscale("log")
        if edges[-1] >= _LONG:
            axes.set_xscale("log")
        axes.set_ylim(50 / max(len(values) for values in columns), 150)
        axes.yaxis.set_major_formatter("{x:g} %")
        axes.tick_params(labelsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    figure.suptitle(
        f"Quality of {len(before.cells)} cells: share of the cells by", x=0.015, y=0.985, ha="left", fontsize=12
    )
    saving(path, partial(_save, figure))


_PANELS = (
    ("scaled_jacobian", "scaled Jacobian (1 is best)"),
    ("shape", "shape, mean ratio (1 is best)"),
    ("conformal_distortion", "conformal distortion (0 is best)"),
    ("edge_ratio", "edge ratio (1 is best)"),
)


def before_after(path: Any, before: Any, after: Any) -> None:
    """Draw a mesh before and after, side by side, cut open and coloured by scaled Jacobian.

    The cells whose centre after lies in the octant that faces the viewer are left out of both.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Two meshes with the same cells, anything :func:`hexconformal.as_hex_mesh` takes.

    Raises
    ------
    MeshError
        If they do not have the same cells.
    WriteError
        If the file cannot be written, or this machine cannot draw in three dimensions.
    """
    from matplotlib.figure import Figure

    path = Path(path)
    check_writable(path, PICTURES)
    meshes = as_hex_mesh(before), as_hex_mesh(after)
    if not np.array_equal(meshes[0].cells, meshes[1].cells):
        raise MeshError("before and after must have the same cells")
    require_rendering()
    colours = _colours()
    measured = [quality(mesh) for mesh in meshes]
    kept = ~_facing(meshes[1])
    bounds = _bounds(*meshes)
    pictures = []
    for mesh, values in zip(meshes, measured, strict=True):
        with _stage(bounds) as plotter:
            _add_cells(plotter, mesh, values.scaled_jacobian, kept, colours)
            pictures.append(plotter.screenshot(None, return_img=True))
    figure = Figure(figsize=(10, 5.9), facecolor="white")
    for number, (title, picture, values) in enumerate(zip(("before", "after"), pictures, measured, strict=True)):
        _panel(figure, number, 2, picture, title, _range(values.scaled_jacobian))
    _colour_bar(figure, colours, any((values.scaled_jacobian < 0).any() for values in measured))
    saving(path, partial(_save, figure))


def worst_cells(path: Any, before: Any, after: Any = None, count: int = 20) -> None:
    """Draw the worst cells of a mesh, or of one before and after, solid inside the translucent boundary.

    Each mesh shows its own worst cells, with a ring around those that would be too small to be seen.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    before, after
        Meshes (anything :func:`hexconformal.as_hex_mesh` takes), or what :func:`hexconformal.quality` said of them.
    count
        How many cells, those with the smallest scaled Jacobian.

    Raises
    ------
    OptionError
        If `count` is less than one.
    WriteError
        If the file cannot be written, or this machine cannot draw in three dimensions.
    """
    from matplotlib.figure import Figure

    path = Path(path)
    check_writable(path, PICTURES)
    if count < 1:
        raise OptionError(f"a picture of the worst cells needs one or more, not {count}")
    measured = [_measured(mesh) for mesh in (before, after) if mesh is not None]
    require_rendering()
    colours, bounds = _colours(), _bounds(*measured)
    figure = Figure(figsize=(5 * len(measured), 5.9), facecolor="white")
    folded = False
    for number, values in enumerate(measured):
        worst = np.argsort(values.scaled_jacobian, kind="stable")[:count]
        shown = np.zeros(len(values.cells), dtype=bool)
        shown[worst] = True
        folded |= bool((values.scaled_jacobian[worst] < 0).any())
        with _stage(bounds) as plotter:
            _add_boundary(plotter, values)
            _add_cells(plotter, values, values.scaled_jacobian, shown, colours)
            picture = plotter.screenshot(None, return_img=True)
            corners = _on_screen(plotter, values.points[values.cells[worst]])
        inverted = int((values.scaled_jacobian <= 0).sum())
        title = f"{'' if after is None else ('before: ', 'after: ')[number]}{len(worst)} worst of {len(shown)} cells"
        said = f"{inverted} inverted   {_range(values.scaled_jacobian)}"
        axes = _panel(figure, number, len(measured), picture, title, said)
        small = np.ptp(corners, axis=1).max(axis=1) < _SMALL * _PIXELS
        axes.scatter(*corners[small].mean(axis=1).T, s=130, facecolors="none", edgecolors="#20262e", linewidths=0.8)
    _colour_bar(figure, colours, folded)
    saving(path, partial(_save, figure))


@cache
def require_rendering() -> None:
    """Raise a WriteError unless three-dimensional pictures can be drawn here, on a screen or without one."""
    if not sys.executable:
        return
    trial = subprocess.run([sys.executable, "-c", _TRIAL], capture_output=True, check=False)
    if trial.returncode != 0:
        raise WriteError(
            "this machine cannot draw in three dimensions: VTK finds no graphics driver; install a software one "
            "(Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        )


def _save(figure: Any, target: Path) -> None:
    figure.savefig(target, dpi=160, facecolor="white")


def _measured(mesh: Any) -> Quality:
    return mesh if isinstance(mesh, Quality) else quality(mesh)


def _range(values: NDArray[np.float64]) -> str:
    named = (("min", values.min()), ("mean", values.mean()), ("max", values.max()))
    return "   ".join(f"{name} {0.0 if abs(value) < 1e-12 else value:.3g}" for name, value in named)


def _bins(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    if name == "edge_ratio":
        largest = float(values[np.isfinite(values)].max(initial=1.1))
        return np.linspace(1, largest, 41) if largest < _LONG else np.geomspace(1, largest, 41)
    return np.linspace(min(float(np.floor(10 * values.min()) / 10), 0), 1, 41)


def _facing(mesh: HexMesh) -> NDArray[np.bool_]:
    """(m,) cells whose centre lies in the octant, of the box around the mesh, that faces the viewer."""
    centres = mesh.points[mesh.cells].mean(axis=1)
    middle = (centres.min(axis=0) + centres.max(axis=0)) / 2
    size = float(np.ptp(centres, axis=0).max())
    facing: NDArray[np.bool_] = ((centres - middle) * np.sign(_VIEW) > 1e-6 * size).all(axis=1)
    return facing if not facing.all() else ~facing


def _colours() -> NDArray[np.float64]:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("bad to good", _BAD_TO_GOOD, N=256)(np.linspace(0, 1, 256))


def _bounds(*meshes: Any) -> list[float]:
    corners = np.concatenate([mesh.points[mesh.cells].reshape(-1, 3) for mesh in meshes])
    bounds: list[float] = np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1).ravel().tolist()
    return bounds


@contextmanager
def _stage(bounds: list[float]) -> Iterator[Any]:
    """A plotter with its light and its camera, which looks at the box."""
    import pyvista

    pv: Any = pyvista
    with pv.vtk_verbosity("off"):
        plotter = pv.Plotter(off_screen=True, window_size=[_PIXELS, _PIXELS], lighting="none")
        try:
            plotter.set_background("white")
            plotter.add_light(pv.Light(position=(0.4, -0.95, 1.4), light_type="scene light", intensity=1.0))
            plotter.enable_parallel_projection()
            plotter.camera_position = "xy"
            plotter.view_vector(_VIEW, viewup=(0, 0, 1))
            plotter.reset_camera(bounds=bounds)
            plotter.camera.zoom(1.08)
            plotter.enable_anti_aliasing("ssaa")
            yield plotter
        finally:
            plotter.close()


def _add_cells(
    plotter: Any, mesh: Any, values: NDArray[np.float64], kept: NDArray[np.bool_], colours: NDArray[np.float64]
) -> None:
    import pyvista
    from matplotlib.colors import ListedColormap

    pv: Any = pyvista
    cells = np.column_stack([np.full(int(kept.sum()), 8), mesh.cells[kept]])
    grid = pv.UnstructuredGrid(cells.ravel(), np.full(len(cells), pv.CellType.HEXAHEDRON), np.array(mesh.points))
    grid.cell_data["scaled_jacobian"] = values[kept]
    plotter.add_mesh(
        grid.extract_surface(algorithm="dataset_surface"),
        scalars="scaled_jacobian",
        clim=(0, 1),
        cmap=ListedColormap(colours),
        below_color=_FOLDED,
        show_edges=True,
        edge_color="#20262e",
        line_width=2.2,
        ambient=0.66,
        diffuse=0.42,
        show_scalar_bar=False,
        reset_camera=False,
    )


def _add_boundary(plotter: Any, mesh: Quality) -> None:
    import pyvista

    quads = boundary_quads(mesh.cells)[0]
    faces = np.column_stack([np.full(len(quads), 4), quads]).ravel()
    skin = pyvista.PolyData(np.array(mesh.points), faces).clean()
    plotter.add_mesh(skin, color="#8fa3b0", opacity=0.1, reset_camera=False)
    plotter.add_mesh(skin, style="wireframe", color="#20262e", opacity=0.08, line_width=1, reset_camera=False)


def _on_screen(plotter: Any, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixels (..., 2) where points (..., 3) appear, from the upper left."""
    matrix = plotter.camera.GetCompositeProjectionTransformMatrix(1.0, -1.0, 1.0)
    to_view = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(2)])
    view = points @ to_view[:, :3].T + to_view[:, 3]
    return np.asarray((view * [0.5, -0.5] + 0.5) * _PIXELS)


def _panel(figure: Any, number: int, count: int, picture: Any, title: str, text: str) -> Any:
    """One of the pictures of a figure, side by side."""
    width = 1 / count
    axes = figure.add_axes((width * (number + 0.02), 0.13, 0.96 * width, 0.77))
    axes.imshow(picture)
    axes.set_axis_off()
    figure.text(width * (number + 0.5), 0.945, title, ha="center", fontsize=14, fontweight="bold")
    figure.text(width * (number + 0.5), 0.905, text, ha="center", fontsize=10)
    return axes


def _colour_bar(figure: Any, colours: NDArray[np.float64], folded: bool) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    bar = figure.add_axes((0.3, 0.085, 0.4, 0.025))
    shown = ScalarMappable(Normalize(0, 1), ListedColormap(colours).with_extremes(under=_FOLDED))
    figure.colorbar(
        shown, cax=bar, orientation="horizontal", extend="min" if folded else "neither", ticks=[0, 0.25, 0.5, 0.75, 1]
    )
    bar.tick_params(labelsize=9)
    bar.set_xlabel("scaled Jacobian" + (" (purple: inverted)" if folded else ""), fontsize=10)
