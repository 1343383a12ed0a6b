"""The container of a mesh of several types of cells, or of one that is not that of linear hexahedra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError, first_ids, first_names
from ..elements import HEXAHEDRON, SOLID_TYPES, WEDGE, CellType, cell_volumes, collapsed_cells
from .arrays import checked_cells, checked_data, checked_points, read_only
from .hex_mesh import HexMesh
from .volume_mesh import VolumeMesh

__all__ = [
    "CellBlock",
    "MixedMesh",
    "blocks_of",
    "cells_in_rows",
    "cells_of_no_nodes",
    "collapsed_mesh",
    "collapsed_table",
]
__all__ += ["counts_by_type", "flat_nodes", "require_nodes", "with_wedges_upright"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CellBlock:
    """The cells of one type: their (k, j) nodes in VTK order, and their (k,) places among all cells of the mesh."""

    cell_type: CellType
    cells: Ints
    places: Ints


@dataclass(frozen=True, eq=False)
class MixedMesh(VolumeMesh):
    """Points and cells of several types with their arrays, all read-only, and what they were made from.

    Attributes
    ----------
    points
        (n, 3) positions, float64, in the mesh's own unit of length.
    blocks
        The m cells by their type, each type once; arrays on cells are in the order of their places.
    point_data, cell_data
        Arrays by name, first axis n or m.
    origin
        What the mesh was made from, as of a :class:`hexconformal.HexMesh`; None if it was made from arrays.

    Raises
    ------
    MeshError
        If shapes or types make no sense, or there is no cell.

    Examples
    --------
    >>> from hexconformal.elements import PYRAMID
    >>> MixedMesh.of_types(PYRAMID.ideal, {"pyramid": [[0, 1, 2, 3, 4]]})
    MixedMesh(5 points, 1 pyramid)
    """

    points: NDArray[np.float64]
    blocks: tuple[CellBlock, ...]
    point_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    origin: Any = None

    def __post_init__(self) -> None:
        blocks = [
            CellBlock(
                block.cell_type,
                checked_cells(block.cells, len(block.cell_type.nodes), block.cell_type.plural),
                read_only(block.places, np.int64),
            )
            for block in self.blocks
            if len(block.cells)
        ]
        names = [block.cell_type.name for block in blocks]
        places = np.concatenate([np.empty(0, np.int64), *(block.places for block in blocks)])
        if not names:
            raise MeshError("there are no cells")
        if len(set(names)) < len(names) or not np.array_equal(np.sort(places), np.arange(len(places))):
            raise MeshError("blocks must be one for each type of cells, and their places all numbers from 0 on")
        if sum(len(block.cells) for block in blocks) != len(places):
            raise MeshError("blocks must have a place for each of their cells")
        object.__setattr__(self, "points", checked_points(self.points))
        object.__setattr__(self, "blocks", tuple(blocks))
        object.__setattr__(self, "point_data", checked_data(self.point_data, len(self.points), "point_data"))
        object.__setattr__(self, "cell_data", checked_data(self.cell_data, len(places), "cell_data"))

    @classmethod
    def of_types(cls, points: ArrayLike, cells: Mapping[str, ArrayLike]) -> MixedMesh:
        """A mesh of the cells (k, j) that a type has by its name in meshio, in this order.

        Raises
        ------
        MeshError
            If there is no such type, or shapes or types of arrays make no sense.
        """
        unknown = [name for name in cells if name not in SOLID_TYPES]
        if unknown:
            raise MeshError(f"types of cells must be some of {', '.join(SOLID_TYPES)}, not {first_names(unknown)}")
        blocks, start = [], 0
        for name, nodes in cells.items():
            table = checked_cells(nodes, len(SOLID_TYPES[name].nodes), SOLID_TYPES[name].plural)
            blocks.append(CellBlock(SOLID_TYPES[name], table, np.arange(start, start + len(table))))
            start += len(table)
        return cls(checked_points(points), tuple(blocks))

    def __repr__(self) -> str:
        return f"MixedMesh({len(self.points)} points, {counts_by_type(self.blocks)})"

    @property
    def cells(self) -> Ints:
        """Nodes of all cells, one cell after the other, in the order of their places."""
        return flat_nodes(self.blocks)

    @property
    def table(self) -> Ints:
        """(m, 8) all cells as hexahedra, some of whose nodes coincide; quadratic ones by their corners."""
        return collapsed_table(self.blocks)

    @property
    def cell_labels(self) -> NDArray[Any] | None:
        """(m,) what the file calls the cells, or their places among all that it has; None if there is no file."""
        if self.origin is None:
            return None
        file, rows = getattr(self.origin, "file", None), self.origin.selection.rows
        return rows if file is None or file.cell_labels is None else file.cell_labels[rows]

    def _arrays_of_cells(self) -> dict[str, Ints]:
        return {block.cell_type.name: block.cells.copy() for block in self.blocks}


def collapsed_mesh(mesh: HexMesh | MixedMesh) -> HexMesh:
    """The mesh with cells of other types than hexahedra as collapsed ones, for what works on a table of eight nodes.

    Wedges may be in either order of their triangles, as formats differ: where most of them would be inside out they are
    taken the other way round. Quadratic cells are there by their corners.

    Examples
    --------
    >>> from hexconformal.elements import WEDGE
    >>> collapsed_mesh(MixedMesh.of_types(WEDGE.ideal, {"wedge": [[3, 4, 5, 0, 1, 2]]})).cells
    array([[0, 1, 2, 2, 3, 4, 5, 5]])
    """
    if isinstance(mesh, HexMesh):
        return mesh
    return HexMesh(mesh.points, with_wedges_upright(mesh).table, mesh.point_data, mesh.cell_data, mesh.origin)


def with_wedges_upright(mesh: MixedMesh) -> MixedMesh:
    """The mesh with all wedges turned round where most of them would be inside out, and most other cells not."""
    if not all(((block.cells >= 0) & (block.cells < len(mesh.points))).all() for block in mesh.blocks):
        return mesh
    wedges, others = np.zeros((2, 0), dtype=bool)
    for block in mesh.blocks:
        inside_out = cell_volumes(mesh.points, collapsed_cells(block.cells, block.cell_type)) < 0.0
        if block.cell_type.linear is WEDGE:
            wedges = np.append(wedges, inside_out)
        else:
            others = np.append(others, inside_out)
    if 2 * wedges.sum() <= len(wedges) or 2 * others.sum() > len(others):
        return mesh
    turned = (
        replace(block, cells=block.cells[:, block.cell_type.mirrored]) if block.cell_type.linear is WEDGE else block
        for block in mesh.blocks
    )
    return replace(mesh, blocks=tuple(turned))


def blocks_of(mesh: HexMesh | MixedMesh) -> tuple[CellBlock, ...]:
    """The cells of a mesh by their type."""
    if isinstance(mesh, MixedMesh):
        return mesh.blocks
    return (CellBlock(HEXAHEDRON, mesh.cells, np.arange(len(mesh.cells))),)


def cells_of_no_nodes(mesh: HexMesh | MixedMesh) -> tuple[Ints, str]:
    """Cells with ids of nodes that there are none of, and what is wrong with them, for an error message.

    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> cells_of_no_nodes(HexMesh(CORNERS, [range(1, 9)]))[1]
    'cells with node ids outside 0..7: 1 (ids 0); ids start at 1 here, subtract 1'
    """
    cells, count = mesh.cells, len(mesh.points)
    if not len(cells) or (cells.min() >= 0 and cells.max() < count):
        return np.empty(0, dtype=np.int64), ""
    bad = [one.places[((one.cells < 0) | (one.cells >= count)).any(axis=1)] for one in blocks_of(mesh)]
    ids = np.sort(np.concatenate(bad))
    text = f"cells with node ids outside 0..{count - 1}: {first_ids(ids, mesh.cell_labels)}"
    if cells.min() == 1 and cells.max() == count:
        text += "; ids start at 1 here, subtract 1"
    return ids, text


def require_nodes(mesh: HexMesh | MixedMesh) -> None:
    """Refuse cells of nodes that there are none of, which compiled loops would look for elsewhere in memory.

    Raises
    ------
    MeshError
        If there are any.
    """
    bad, text = cells_of_no_nodes(mesh)
    if len(bad):
        raise MeshError(text)


def collapsed_table(blocks: Sequence[CellBlock]) -> Ints:
    """(m, 8) all cells as hexahedra, some of whose nodes coincide; quadratic ones by their corners.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON
    >>> collapsed_table([CellBlock(TETRAHEDRON, np.arange(4)[None], np.arange(1))])
    array([[0, 1, 2, 2, 3, 3, 3, 3]])
    """
    table = np.empty((sum(len(block.cells) for block in blocks), 8), dtype=np.int64)
    for block in blocks:
        table[block.places] = collapsed_cells(block.cells, block.cell_type)
    return table


def cells_in_rows(mesh: HexMesh | MixedMesh, places: slice, size: int) -> Ints:
    """(k, size) nodes of the cells at some places; those of fewer nodes than eight rows have room for are collapsed."""
    first, count = places.start, places.stop - places.start
    out = np.empty((count, size), dtype=np.int64)
    for block in blocks_of(mesh):
        mine = (block.places >= first) & (block.places < places.stop)
        if mine.any():
            nodes = block.cells[mine]
            out[block.places[mine] - first] = (
                nodes if nodes.shape[1] == size else collapsed_cells(nodes, block.cell_type)
            )
    return out


def flat_nodes(blocks: Sequence[CellBlock]) -> Ints:
    """Nodes of all cells, one cell after the other, in the order of their places.

    Examples
    --------
    >>> from hexconformal.elements import PYRAMID, TETRAHEDRON
    >>> tetrahedron = CellBlock(TETRAHEDRON, np.array([[6, 7, 8, 9]]), np.array([1]))
    >>> flat_nodes([tetrahedron, CellBlock(PYRAMID, np.array([[0, 1, 2, 3, 4]]), np.array([0]))])
    array([0, 1, 2, 3, 4, 6, 7, 8, 9])
    """
    sizes = np.empty(sum(len(block.cells) for block in blocks), dtype=np.int64)
    for block in blocks:
        sizes[block.places] = block.cells.shape[1]
    starts = np.cumsum(sizes) - sizes
    result = np.empty(int(sizes.sum()), dtype=np.int64)
    for block in blocks:
        result[starts[block.places][:, None] + np.arange(block.cells.shape[1])] = block.cells
    return result


def counts_by_type(blocks: Sequence[CellBlock]) -> str:
    """How many cells there are of each type, in words.

    Examples
    --------
    >>> from hexconformal.elements import PYRAMID, TETRAHEDRON
    >>> counts_by_type([CellBlock(TETRAHEDRON, np.arange(8).reshape(2, 4), np.arange(2))])
    '2 tetrahedra'
    """
    named = [(len(block.cells), block.cell_type) for block in blocks]
    return ", ".join(f"{count} {one.plural if count != 1 else one.singular}" for count, one in named)
