"""Rows of surfaces with their edges, for the examples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from surface.quality.assessment import smallest_angles

_PIXELS = 620


@dataclass(frozen=True)
class Shot:
    """A surface and what is written below it."""

    mesh: Any
    label: str


def draw(
    path: Path, rows: Sequence[tuple[str, Sequence[Shot]]], view: Sequence[float], up: Sequence[float] = (0, 0, 1)
) -> None:
    """Draw rows of surfaces, all of a row to the same scale, with the smallest angle of each."""
    from matplotlib.figure import Figure

    width = max(len(shots) for _, shots in rows)
    figure = Figure(figsize=(2.9 * width, 3.3 * len(rows)), facecolor="white")
    for row, (title, shots) in enumerate(rows):
        size = max(float(np.ptp(shot.mesh.points, axis=0).max()) for shot in shots)
        for column, shot in enumerate(shots):
            axes = figure.add_subplot(len(rows), width, row * width + column + 1)
            axes.imshow(_rendered(shot.mesh, size, view, up))
            axes.set_axis_off()
            angles = smallest_angles(shot.mesh.points, shot.mesh.cells)
            axes.text(
                0.5, -0.02, f"{shot.label}\nsmallest angle {angles.min():.1f}°, mean {angles.mean():.1f}°", fontsize=9,
                ha="center", va="top", transform=axes.transAxes,
            )  # fmt: skip
            if column == 0:
                axes.set_title(title, loc="left", fontsize=11, fontweight="bold")
    figure.subplots_adjust(left=0.01, right=0.99, top=0.94, bottom=0.09, wspace=0.02, hspace=0.3)
    figure.savefig(path, dpi=110)


def _rendered(mesh: Any, size: float, view: Sequence[float], up: Sequence[float]) -> Any:
    import pyvista as pv

    cells = mesh.cells
    flat = np.concatenate([np.insert(table, 0, table.shape[1], axis=1).ravel() for table in cells.tables])
    plotter = pv.Plotter(off_screen=True, window_size=(_PIXELS, _PIXELS))
    plotter.set_background("white")
    plotter.add_mesh(
        pv.PolyData(mesh.points, flat), color="#cfe3ec", show_edges=True, edge_color="#20262e",
        line_width=1.0 if len(cells) < 5000 else 0.4, ambient=0.35, diffuse=0.75,
    )  # fmt: skip
    nodes = mesh.points[cells.nodes()]
    plotter.camera.focal_point = (nodes.min(axis=0) + nodes.max(axis=0)) / 2
    direction = np.asarray(view) / np.linalg.norm(view)
    plotter.camera.position = plotter.camera.focal_point + 4 * size * direction
    plotter.camera.up = up
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.66 * size
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    picture = plotter.screenshot(None, return_img=True)
    plotter.close()
    return picture
