"""A scene of the regions of a mesh, cut open, with the interfaces between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import CellBlock, Regions, collapsed_table, face_table
from . import canvas
from .drawn_faces import faces_of_cells, outer_faces

__all__ = ["region_scene"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Apart for colour-blind eyes, and light enough for black edges.
_COLOURS = ("#7fb3d5", "#f5b971", "#8cc9a1", "#e08e8e", "#c3a6d8", "#efe08a", "#9fd8d8", "#b8a28f")


def region_scene(points: Floats, blocks: Sequence[CellBlock], regions: Regions, kept: Mask) -> canvas.Scene:
    """The kept cells (m,) coloured by region, and the interfaces between those left out, if regions are few.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    blocks
        The m cells by their type.
    regions
        Their regions; named in the picture where there are few.
    kept
        (m,) cells that are drawn.
    """
    count = len(regions.names)
    few = count <= len(_COLOURS)
    table = face_table(collapsed_table(blocks))
    sides = np.sort(regions.labels[table.cells], axis=1)
    between = (table.cells[:, 1] >= 0) & (sides[:, 0] != sides[:, 1])
    pairs = np.unique(sides[between], axis=0)
    colours = np.arange(count) if few else _apart(count, pairs)

    def draw(plotter: Any) -> None:
        faces = outer_faces(points, blocks, kept)
        labels = regions.labels[faces.owners]
        canvas.add_coloured(plotter, faces, _rgb()[colours[labels] % len(_COLOURS)])
        canvas.add_borders(plotter, faces, labels)
        left_out = between & ~kept[table.cells].any(axis=1)
        if few and left_out.any():  # many would hide what is behind them
            owners = table.cells[left_out, 0]
            canvas.add_interfaces(plotter, faces_of_cells(points, blocks, table.quads[left_out], owners))

    legend = tuple(zip(regions.names, _COLOURS, strict=False)) if few else ()
    counts = f"{count} regions, {len(pairs)} interface{'s' if len(pairs) != 1 else ''}"
    return canvas.Scene("regions", np.empty(0), draw, counts, None, legend)


def _rgb() -> Any:
    from matplotlib.colors import to_rgb

    return np.round(255 * np.array([to_rgb(colour) for colour in _COLOURS])).astype(np.uint8)


def _apart(count: int, pairs: Ints) -> Ints:
    """(count,) colours of regions, so that no two that meet have the same as far as there are enough."""
    colours = np.full(count, -1)
    near: list[list[int]] = [[] for _ in range(count)]
    for one, other in pairs.tolist():
        near[other].append(one)  # the smaller label, which has its colour before
    for region in range(count):
        taken = set(colours[near[region]].tolist())
        colours[region] = next(colour for colour in range(count) if colour not in taken)
    return colours
