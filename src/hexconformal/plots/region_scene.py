"""A scene of the regions of a mesh, cut open, with the interfaces between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import HexMesh, Regions, blocks_of, face_edges, find_interfaces, unique_edges
from . import canvas

__all__ = ["region_scene"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Apart for colour-blind eyes, and light enough for black edges.
_COLOURS = ("#7fb3d5", "#f5b971", "#8cc9a1", "#e08e8e", "#c3a6d8", "#efe08a", "#9fd8d8", "#b8a28f")


def region_scene(mesh: HexMesh, regions: Regions, kept: Mask) -> canvas.Scene:
    """The kept cells (m,) coloured by region, and the interfaces where cells are left out, if regions are few.

    Parameters
    ----------
    mesh
        The mesh.
    regions
        Its regions; named in the picture where there are few.
    kept
        (m,) cells that are drawn.
    """
    count = len(regions.names)
    few = count <= len(_COLOURS)
    interfaces = find_interfaces(mesh.cells, regions.labels)
    colours = np.arange(count) if few else _apart(count, interfaces.pairs)

    def draw(plotter: Any) -> None:
        faces = canvas.surface_of(mesh.points, blocks_of(mesh), kept)
        of_faces = regions.labels[np.asarray(faces.cell_data["cell"])]
        canvas.add_coloured(plotter, faces, _rgb()[colours[of_faces] % len(_COLOURS)])
        quads = np.asarray(faces.regular_faces)
        canvas.add_lines(plotter, np.asarray(faces.points), _borders(quads, of_faces))
        cut_open = np.zeros(len(mesh.points), dtype=bool)
        cut_open[mesh.cells[~kept]] = True
        left_out = interfaces.quads[cut_open[interfaces.quads].all(axis=1)]
        if few and len(left_out):  # many would hide what is behind them
            canvas.add_quads(plotter, mesh.points, left_out)

    legend = tuple(zip(regions.names, _COLOURS, strict=False)) if few else ()
    return canvas.Scene(
        "regions", np.empty(0), draw, f"{count} regions, {len(interfaces.pairs)} interfaces", None, legend
    )


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


def _borders(quads: Ints, owners: Ints) -> Ints:
    """(e, 2) edges between quads of different owners."""
    edges, of_pairs = unique_edges(face_edges(quads)), np.repeat(owners, 4)
    differs = of_pairs != of_pairs[edges.first][edges.of_pairs]
    return edges.nodes[np.bincount(edges.of_pairs[differs], minlength=len(edges.nodes)) > 0]
