"""The cells of a volume mesh as a page draws them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import between
from ..mesh import HexMesh, MixedMesh, blocks_of, boundary_quads, collapsed_mesh, face_table, same_rows
from .contents import Cells

__all__ = ["drawn_part", "volume_cells"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def volume_cells(mesh: HexMesh | MixedMesh) -> Cells:
    """All cells of a mesh.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> cells = volume_cells(HexMesh(*box((3, 3, 3))))
    >>> len(cells.faces), int((cells.sides[:, 1] < 0).sum()), cells.layers.max()
    (108, 54, np.int64(1))
    """
    table = collapsed_mesh(mesh).cells
    found = face_table(table)
    types = np.empty(len(table), dtype=np.int64)
    blocks = blocks_of(mesh)
    for number, block in enumerate(blocks):
        types[block.places] = number
    return Cells(
        found.quads,
        found.cells,
        tuple(block.cell_type.singular for block in blocks),
        types,
        len(table),
        _middles(mesh, found.quads),
        mesh.cell_labels,
        _layers(table, len(mesh.points)),
    )


def drawn_part(cells: Cells, kept: Mask, coarse: Ints, curves: Ints) -> tuple[Cells, Ints, Ints]:
    """Some of the cells (m,), with the ids that they and their nodes had among all.

    Faces (k, 4) that stand for others come with them, and nodes of curves are kept.
    """
    places = np.flatnonzero(kept)
    number = np.full(len(kept) + 1, -2)  # the last one stands for none
    number[places], number[-1] = np.arange(len(places)), -1
    sides = number[cells.sides]
    shown = (sides >= 0).any(axis=1)
    sides = sides[shown]
    sides = np.where(sides[:, :1] < 0, sides[:, ::-1], sides)  # the cell of the page first
    faces = np.concatenate([cells.faces[shown], coarse])
    sides = np.concatenate([sides, np.full((len(coarse), 2), -2)])
    middles = None if cells.middles is None else cells.middles[shown]
    of_middles = curves if middles is None else middles[middles >= 0]
    nodes = np.unique(np.concatenate([faces.ravel(), of_middles.ravel(), curves.ravel()]))
    of_node = np.zeros(int(nodes.max(initial=0)) + 1, dtype=np.int64)
    of_node[nodes] = np.arange(len(nodes))
    part = Cells(
        of_node[faces],
        sides,
        cells.type_names,
        cells.types[places],
        cells.total,
        None if middles is None else np.where(middles >= 0, of_node[middles], -1),
        places if cells.labels is None else cells.labels[places],
        None if cells.layers is None else cells.layers[places],
    )
    return part, places, nodes


def _middles(mesh: HexMesh | MixedMesh, faces: Ints) -> Ints | None:
    """(f, 5) nodes in the middle of the sides of faces, and in that of the face; None where no cell is quadratic."""
    quadratic = [block for block in blocks_of(mesh) if block.cell_type.straight]
    if not quadratic:
        return None
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    found = []
    for size, wanted in ((2, sides), (4, faces)):
        corners, middles = [], []
        for block in quadratic:
            for place, among in enumerate(between(block.cell_type), start=block.cell_type.corners):
                if len(among) == size:
                    corners.append(block.cells[:, list(among)])
                    middles.append(block.cells[:, place])
        known = np.concatenate([np.empty((0, size), np.int64), *corners])
        first = same_rows(np.concatenate([known, wanted]))[len(known) :]
        nodes = np.concatenate([*middles, np.full(len(wanted), -1)])
        found.append(nodes[first])
    # A triangle has its last node twice, and that node between these.
    of_sides = np.where(sides[:, 0] == sides[:, 1], sides[:, 0], found[0]).reshape(-1, 4)
    centres = found[1]
    curved = (of_sides >= 0).all(axis=1, keepdims=True)
    return np.where(curved, np.column_stack([of_sides, centres]), -1)


def _layers(table: Ints, count: int) -> Ints:
    """(m,) number of layers of cells between each of the cells (m, 8) and the boundary."""
    reached = np.zeros(count, dtype=bool)
    reached[boundary_quads(table)[0]] = True
    layers = np.full(len(table), -1)
    for layer in range(len(table)):
        here = np.flatnonzero(layers < 0)
        here = here[reached[table[here]].any(axis=1)]
        if len(here) == 0:
            break
        layers[here] = layer
        reached[table[here]] = True
    return np.where(layers < 0, layers.max(initial=0), layers)
