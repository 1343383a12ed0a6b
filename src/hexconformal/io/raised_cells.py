"""Cells of a linear mesh with nodes between their corners: solid ones, and what lies on their sides."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError
from ..elements import quadratic_type
from ..mesh import (
    CellBlock,
    HexMesh,
    MixedMesh,
    blocks_of,
    boundary_quads,
    collapsed_table,
    face_edges,
    middle_nodes_of_types,
    middles_between,
    with_middles,
)
from .carried_cells import corners_of
from .selection import Block

__all__ = ["RaisedCells"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


class RaisedCells:
    """The nodes between the corners of linear cells, and what becomes of other cells, arrays and sets.

    Further nodes come after the points; those that a cell needed before, and none needs any more, are left out.

    Parameters
    ----------
    linear
        The mesh of the cells that are raised.
    before
        All cells that it came with, these among them.
    nodes
        Of a hexahedron: 20 or 27; of other types what belongs beside these.

    Attributes
    ----------
    solids
        The raised cells by their type.
    blocks
        All cells: triangles, quadrilaterals and lines on faces and edges of raised ones have the nodes of these, others
        what they had.
    notes
        What has no nodes between corners, in words.
    """

    def __init__(self, linear: HexMesh | MixedMesh, before: list[Block], nodes: int) -> None:
        self._linear, self._count, self._nodes = linear, len(linear.points), nodes
        typed = blocks_of(linear)
        tables, self._corners = middle_nodes_of_types([(one.cell_type, one.cells) for one in typed], self._count, nodes)
        raised = [
            CellBlock(quadratic_type(one.cell_type, nodes), cells, one.places)
            for one, cells in zip(typed, tables, strict=True)
        ]
        self._first_nodes = np.unique(np.concatenate([cells.ravel() for cells in tables]))
        self.notes: list[str] = []
        rows = np.empty(0, dtype=np.int64) if linear.origin is None else linear.origin.selection.rows
        found = []
        for block in before:
            mine = np.isin(block.rows, rows)
            places = np.searchsorted(rows, block.rows[mine])
            for one in raised:
                own = np.flatnonzero(np.isin(one.places, places))
                if len(own):
                    found.append(Block(one.cell_type.name, 3, one.cells[own], rows[one.places[own]]))
            if not mine.all():
                rest = block if not mine.any() else replace(block, nodes=block.nodes[~mine], rows=block.rows[~mine])
                found += self._raised(rest)
        self._kept = np.ones(self._count + sum(map(len, self._corners)), dtype=bool)
        for block in before:
            self._kept[block.nodes] = False
        for block in found:
            self._kept[block.nodes] = True
        left_out = int((~self._kept).sum())
        if left_out:
            self.notes.append(f"{left_out} nodes between corners that came are replaced")
        self.number = np.cumsum(self._kept) - 1
        self.solids = tuple(replace(one, cells=self.number[one.cells]) for one in raised)
        self.blocks = [replace(block, nodes=self.number[block.nodes]) for block in found]

    def _raised(self, block: Block) -> list[Block]:
        if block.name.startswith("poly") and block.dimension == 3:
            raise MeshError(f"there is no order 2 beside cells of type {block.name}: extract the others first")
        if corners_of(block.name) not in (2, 3, 4):
            if corners_of(block.name) != 1:
                self.notes.append(f"{len(block.rows)} {block.name} cells have no nodes between corners")
            return [block]
        corners = block.nodes[:, : corners_of(block.name)]
        quadratic = np.column_stack([corners, *self._between(corners)])
        whole = (quadratic >= 0).all(axis=1)
        if not whole.all():
            what = "edges" if corners.shape[1] == 2 else "faces"
            self.notes.append(f"{(~whole).sum()} {block.name} cells, no {what} of solid ones, stay as they are")
        name = {3: "line3", 6: "triangle6", 8: "quad8", 9: "quad9"}[quadratic.shape[1]]
        parts = [
            Block(name, block.dimension, quadratic[whole], block.rows[whole]),
            replace(block, nodes=block.nodes[~whole], rows=block.rows[~whole]),
        ]
        return [part for part in parts if len(part.rows)]

    def _between(self, corners: Ints) -> list[Ints]:
        if corners.shape[1] == 2:
            return [self._find(corners)]
        sides, size = face_edges(corners), corners.shape[1]
        centres = [self._find(corners)] if size == 4 and self._nodes == 27 else []
        return [self._find(sides).reshape(-1, size), *centres]

    def _find(self, corners: Ints) -> Ints:
        """The nodes (k,) in the middle of some corners (k, j); -1 where there is none."""
        return middles_between(self._corners, self._count, corners)

    @cached_property
    def _outer(self) -> Mask:
        """Which of the nodes, those left out included, are on the boundary, or of no raised cell."""
        quads = boundary_quads(collapsed_table(blocks_of(self._linear)))[0]
        outer = np.ones(len(self._kept), dtype=bool)
        outer[self._first_nodes] = False
        found = np.concatenate([quads.ravel(), self._find(face_edges(quads)), self._find(quads)])
        outer[found[found >= 0]] = True
        return outer

    def points(self) -> NDArray[np.float64]:
        """The points, and after them those in the middle of their corners."""
        return with_middles(self._linear.points, self._corners)[self._kept]

    def on_points(self, values: NDArray[Any], name: str = "") -> NDArray[Any]:
        """Values on the points, and after them on further nodes.

        Of real numbers the mean of the corners; of others what all corners have, and 0 where these differ. What is 0 at
        all nodes inside the mesh, such as a set of nodes on the boundary, stays so.
        """
        out = with_middles(values, self._corners)
        if values.dtype.kind in "fc":
            return out[self._kept]
        inner = ~self._outer
        if not (values.reshape(self._count, -1)[inner[: self._count]] != np.zeros((), values.dtype)).any():
            out[inner] = np.zeros((), values.dtype)
        if name and values.dtype.kind != "b":
            lost = sum(
                int((values[members] != values[members[:, :1]]).reshape(len(members), -1).any(axis=1).sum())
                for members in self._corners
            )
            if lost:
                self.notes.append(f"point array {name!r} is 0 at {lost} nodes between corners where it differs")
        return out[self._kept]

    def in_set(self, name: str, ids: Any) -> Ints:
        """The members of a set of points: with those between corners that are all in it, without those left out."""
        mask = np.zeros(self._count, dtype=bool)
        mask[np.asarray(ids, dtype=np.int64)] = True
        found = np.flatnonzero(self.on_points(mask))
        fewer = int(mask.sum()) - len(found)
        if fewer > 0:
            self.notes.append(f"point set {name!r} has {fewer} nodes fewer, as not all of their corners are in it")
        return found

    def pairs(self, nodes: Ints) -> Ints:
        """Pairs (k, 2) of nodes that move together, and those between corners whose partners have one between them."""
        other = np.full(self._count, -1, dtype=np.int64)
        other[nodes[:, 0]] = nodes[:, 1]
        found = [nodes[self._kept[nodes].all(axis=1)]]
        for members in self._corners:
            mine = members[(other[members] >= 0).all(axis=1)]
            both = np.column_stack([self._find(mine), self._find(other[mine])])
            found.append(both[(both >= 0).all(axis=1)])
        return self.number[np.concatenate(found)]

    def labels(self, labels: NDArray[Any] | None) -> NDArray[Any] | None:
        """What points are called, and after them further nodes; None where names are no numbers."""
        if labels is None or labels.dtype.kind not in "iu":
            return None
        more = len(self._kept) - self._count
        return np.concatenate([labels, labels.max(initial=0) + 1 + np.arange(more)])[self._kept]
