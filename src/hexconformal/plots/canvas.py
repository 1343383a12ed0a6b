"""Drawing that all pictures share: histograms, and scenes of meshes in three dimensions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import WriteError, python_can_be_started, run_python, save_atomically, uninterrupted
from .drawn_faces import DrawnFaces

__all__ = ["PICTURE_EXTENSIONS", "PIXELS", "VIEW_DIRECTION", "Histogram", "Scene", "add_borders", "add_coloured"]
__all__ += ["add_faces", "add_interfaces", "add_translucent"]
__all__ += ["bounding_box", "draw_histograms", "label_before_after", "plotter_of", "require_rendering", "save"]
__all__ += ["side_by_side", "to_pixels", "worst_scene"]

Floats = NDArray[np.float64]

PICTURE_EXTENSIONS = (".pdf", ".png", ".svg")
PIXELS = 1100
VIEW_DIRECTION = np.array([0.92, -1.0, 0.72])  # from the mesh to the camera

_BEFORE, _AFTER = "#c8553d", "#2a6f97"
# Bad to good; readable for colour-blind eyes, and light enough for black edges.
_BAD_TO_GOOD = ("#a4243b", "#d8572a", "#f4a259", "#f6e7b4", "#a9d6c6", "#5fa8b8")
_FOLDED = "#7b1fa2"
_INK = "#20262e"
_LONGEST_NAME = 16  # letters
_RING_BELOW = 0.025  # share of the picture; smaller cells get a ring
_LIFT = 1e-3  # share of half the picture's height
_SHADES: dict[str, Any] = {"ambient": 0.66, "diffuse": 0.42, "smooth_shading": True}

# Without a graphics driver VTK does not raise an error but crashes: so another process has to try.
_RENDER_TEST = """
from vtkmodules.vtkRenderingCore import vtkRenderWindow
import vtkmodules.vtkRenderingOpenGL2
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.Render()
"""


@dataclass(frozen=True, eq=False)
class Histogram:
    """A histogram: its title, the values of each group of cells, the edges of its bins, and its kind of axis."""

    title: str
    groups: Sequence[Floats]
    edges: Floats
    logarithmic: bool = False


def draw_histograms(path: Path, heading: str, histograms: Sequence[Histogram]) -> None:
    """Draw four histograms, of one group of cells or of those before and after."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 7))
    panels = figure.subplots(
        2, 2, gridspec_kw={"left": 0.075, "right": 0.98, "top": 0.85, "hspace": 0.52, "bottom": 0.05}
    )
    for axes, histogram in zip(panels.flat, histograms, strict=True):
        styles = [("before", _BEFORE), ("after", _AFTER)] if len(histogram.groups) == 2 else [("cells", _AFTER)]
        edges, last = histogram.edges, len(styles) - 1
        for number, ((label, colour), values) in enumerate(zip(styles, histogram.groups, strict=True)):
            share = 100 * np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / len(values)
            axes.stairs(share, edges, fill=True, color=colour, alpha=0.35)
            axes.stairs(share, edges, color=colour, linewidth=1.2)
            place = (0, 1.05 + 0.075 * (last - number))
            axes.text(*place, f"{label}: {_value_range(values)}", color=colour, fontsize=9, transform=axes.transAxes)
        axes.set_title(histogram.title, fontsize=10, loc="left", pad=20 + 12 * last, fontweight="bold")
        axes.set_yscale("log")
        if histogram.logarithmic:
            axes.set_xscale("log")
        axes.set_ylim(50 / max(len(values) for values in histogram.groups), 150)
        axes.yaxis.set_major_formatter("{x:g} %")
        axes.tick_params(labelsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    figure.suptitle(heading, x=0.015, y=0.985, ha="left", fontsize=12)
    save(path, figure)


def save(path: Path, figure: Any) -> None:
    """Write a figure, completely or not at all."""
    save_atomically(path, partial(_savefig, figure))


def _savefig(figure: Any, target: Path) -> None:
    # matplotlib draws with callbacks of weak references, in which Python loses what is raised: half a drawing is left.
    with uninterrupted():
        figure.savefig(target, dpi=160, facecolor="white")


def _value_range(values: Floats) -> str:
    """Smallest, mean and largest value, in words."""
    named = (("min", values.min()), ("mean", values.mean()), ("max", values.max()))
    return "   ".join(f"{name} {0.0 if abs(value) < 1e-12 else value:.3g}" for name, value in named)


def _colours() -> Floats:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("bad to good", _BAD_TO_GOOD, N=256)(np.linspace(0, 1, 256))


@cache
def require_rendering() -> None:
    """Raise a WriteError unless three-dimensional pictures can be drawn here, on a screen or without one."""
    if python_can_be_started() and run_python(_RENDER_TEST) != 0:
        raise WriteError(
            "this machine cannot draw in three dimensions: VTK finds no graphics driver; install a software one "
            "(Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        )


@dataclass(frozen=True, eq=False)
class Scene:
    """One of the meshes that are drawn side by side.

    Attributes
    ----------
    title
        Text above the picture.
    values
        The measure of all its cells.
    draw
        Adds the mesh to a plotter.
    subtitle
        Text below the title, before the range of the values.
    ringed
        (k, j, 3) corners of the cells that get a ring where they are too small to be seen.
    legend
        Names and colours, where the mesh is not coloured by its values; None where it is.
    """

    title: str
    values: Floats
    draw: Callable[[Any], None]
    subtitle: str = ""
    ringed: Floats | None = None
    legend: Sequence[tuple[str, str]] | None = None


def worst_scene(values: Floats, corners: Floats, draw: Callable[[Any], None]) -> Scene:
    """A scene of the worst cells, with their corners (k, j, 3), of a mesh whose cells have these values."""
    subtitle = f"{int((values <= 0).sum())} inverted   "
    return Scene(f"{len(corners)} worst of {len(values)} cells", values, draw, subtitle, corners)


def label_before_after(scenes: Sequence[Scene]) -> list[Scene]:
    """The scenes, titled before and after if there are two."""
    names = ("before: ", "after: ") if len(scenes) == 2 else ("",)
    return [replace(scene, title=name + scene.title) for name, scene in zip(names, scenes, strict=True)]


def side_by_side(path: Path, scenes: Sequence[Scene], box: list[float], measure: str) -> None:
    """Draw meshes in three dimensions side by side, seen from the same place, coloured by a measure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5 * len(scenes), 5.9), facecolor="white")
    for number, scene in enumerate(scenes):
        with plotter_of(box) as plotter:
            scene.draw(plotter)
            picture = plotter.screenshot(None, return_img=True)
            corners = None if scene.ringed is None else to_pixels(plotter, scene.ringed)
        text = scene.subtitle + (_value_range(scene.values) if scene.legend is None else "")
        axes = _add_picture(figure, number, len(scenes), picture, scene.title, text)
        if scene.legend:
            _add_legend(figure, (number + 0.5) / len(scenes), scene.legend)
        if corners is not None:
            _ring_small_cells(axes, corners)
    measured = [scene for scene in scenes if scene.legend is None]
    share = len(measured) / len(scenes)
    _colour_bar(figure, measure, any((scene.values < 0).any() for scene in measured), share)
    save(path, figure)


def bounding_box(*corners: ArrayLike) -> list[float]:
    """xmin, xmax, ymin, ... of points (..., 3)."""
    points = np.concatenate([np.reshape(part, (-1, 3)) for part in corners])
    result: list[float] = np.stack([points.min(axis=0), points.max(axis=0)], axis=1).ravel().tolist()
    return result


@contextmanager
def plotter_of(box: list[float]) -> Iterator[Any]:
    """A plotter whose camera shows the box, closed at the end."""
    import pyvista

    pv: Any = pyvista
    with pv.vtk_verbosity("off"):
        plotter = pv.Plotter(off_screen=True, window_size=[PIXELS, PIXELS], lighting="none")
        try:
            plotter.set_background("white")
            plotter.add_light(pv.Light(position=(0.4, -0.95, 1.4), light_type="scene light", intensity=1.0))
            plotter.enable_parallel_projection()
            plotter.camera_position = "xy"
            plotter.view_vector(VIEW_DIRECTION, viewup=(0, 0, 1))
            plotter.reset_camera(bounds=box)
            plotter.camera.zoom(1.08)
            plotter.enable_anti_aliasing("ssaa")
            yield plotter
        finally:
            plotter.close()


def add_faces(plotter: Any, faces: DrawnFaces, values: Floats, line_width: float = 2.2) -> None:
    """Add faces with their edges, coloured by a measure (f,): 1 is best, below 0 a cell is folded."""
    from matplotlib.colors import ListedColormap

    pieces = _pieces(faces, measure=values)
    colours = {"cmap": ListedColormap(_colours()), "clim": (0, 1), "below_color": _FOLDED, "show_scalar_bar": False}
    plotter.add_mesh(pieces, scalars="measure", reset_camera=False, **colours, **_SHADES)
    _add_edges(plotter, faces, faces.edges(), line_width)


def add_coloured(plotter: Any, faces: DrawnFaces, colours: NDArray[np.uint8]) -> None:
    """Add faces with their thin edges, each of a colour (f, 3)."""
    plotter.add_mesh(_pieces(faces, colour=colours), scalars="colour", rgb=True, reset_camera=False, **_SHADES)
    _add_edges(plotter, faces, faces.edges(), 1.2, opacity=0.35)


def add_borders(plotter: Any, faces: DrawnFaces, values: NDArray[np.int64]) -> None:
    """Add the edges between faces with different values (f,) as thick lines."""
    _add_edges(plotter, faces, faces.edges(values), 8)


def add_interfaces(plotter: Any, faces: DrawnFaces) -> None:
    """Add faces as a translucent surface with its edges."""
    plotter.add_mesh(_pieces(faces), color="#5d6b78", opacity=0.25, reset_camera=False, smooth_shading=True)
    _add_edges(plotter, faces, faces.edges(), 1.5, opacity=0.5)


def add_translucent(plotter: Any, faces: DrawnFaces) -> None:
    """Add a translucent surface that leaves what is inside, or lies on it, to be seen."""
    surface = plotter.add_mesh(_pieces(faces), color="#8fa3b0", opacity=0.1, reset_camera=False, smooth_shading=True)
    surface.position = -2 * _lift(plotter)
    _add_edges(plotter, faces, faces.edges(), 1, opacity=0.15)


def _pieces(faces: DrawnFaces, **arrays: NDArray[Any]) -> Any:
    """The pieces of faces as PolyData, with values (f, ...) of these."""
    import pyvista

    table, pieces = faces.pieces(), faces.steps**2
    surface = pyvista.PolyData(faces.points.reshape(-1, 3), np.insert(table, 0, 4, axis=1).ravel())
    for name, values in arrays.items():
        surface.cell_data[name] = np.repeat(values, pieces, axis=0)
    return surface


def _add_edges(plotter: Any, faces: DrawnFaces, edges: NDArray[np.int64], width: float, opacity: float = 1.0) -> None:
    """Add edges (e, k), curves through points of faces, just in front of these."""
    import pyvista

    if len(edges):
        table = np.insert(edges, 0, edges.shape[1], axis=1).ravel()
        lines = pyvista.PolyData(faces.points.reshape(-1, 3), lines=table)
        style = {"color": _INK, "line_width": width, "opacity": opacity, "lighting": False}
        plotter.add_mesh(lines, reset_camera=False, **style).position = _lift(plotter)


def _lift(plotter: Any) -> Floats:
    """By what something comes nearer to the eye, in front of what lies on it: in a parallel projection all it does."""
    towards = np.subtract(plotter.camera.position, plotter.camera.focal_point)
    return np.asarray(_LIFT * plotter.camera.parallel_scale / np.linalg.norm(towards) * towards)


def to_pixels(plotter: Any, points: Floats) -> Floats:
    """Pixels (..., 2), from the upper left, at which points (..., 3) appear."""
    matrix = plotter.camera.GetCompositeProjectionTransformMatrix(1.0, -1.0, 1.0)
    to_view = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(2)])
    view = points @ to_view[:, :3].T + to_view[:, 3]
    return np.asarray((view * [0.5, -0.5] + 0.5) * PIXELS)


def _add_picture(figure: Any, number: int, count: int, picture: Any, title: str, text: str) -> Any:
    """Add one of the pictures of a figure, with its title and text; returns its axes."""
    width = 1 / count
    axes = figure.add_axes((width * (number + 0.02), 0.13, 0.96 * width, 0.77))
    axes.imshow(picture)
    axes.set_axis_off()
    figure.text(width * (number + 0.5), 0.945, title, ha="center", fontsize=14, fontweight="bold")
    figure.text(width * (number + 0.5), 0.905, text, ha="center", fontsize=10)
    return axes


def _ring_small_cells(axes: Any, corners: Floats) -> None:
    """Draw rings around the cells, with corners (m, k, 2) in pixels, that are too small to be seen."""
    small = np.ptp(corners, axis=1).max(axis=1) < _RING_BELOW * PIXELS
    axes.scatter(*corners[small].mean(axis=1).T, s=130, facecolors="none", edgecolors=_INK, linewidths=0.8)


def _add_legend(figure: Any, centre: float, legend: Sequence[tuple[str, str]]) -> None:
    """Add names with their colours below one of the pictures."""
    from matplotlib.patches import Patch

    patches = [Patch(facecolor=colour, edgecolor=_INK, label=_short(name)) for name, colour in legend]
    place = {"loc": "upper center", "bbox_to_anchor": (centre, 0.125), "ncols": min(len(patches), 4)}
    figure.legend(handles=patches, frameon=False, fontsize=9, **place)


def _short(name: str) -> str:
    clean = "".join(filter(str.isprintable, name)).replace("$", r"\$")
    clean = clean if len(clean) <= _LONGEST_NAME else clean[: _LONGEST_NAME - 3] + "..."
    return clean if not clean.startswith("_") else " " + clean  # which matplotlib would leave out


def _colour_bar(figure: Any, label: str, folded: bool, share: float = 1.0) -> None:
    """Add a legend of the colours; `folded` tells whether any value is below 0, `share` where the pictures end."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    bar = figure.add_axes((0.3 * share, 0.085, 0.4 * share, 0.025))
    shown = ScalarMappable(Normalize(0, 1), ListedColormap(_colours()).with_extremes(under=_FOLDED))
    figure.colorbar(
        shown, cax=bar, orientation="horizontal", extend="min" if folded else "neither", ticks=[0, 0.25, 0.5, 0.75, 1]
    )
    bar.tick_params(labelsize=9)
    bar.set_xlabel(label + (" (purple: inverted)" if folded else ""), fontsize=10)
