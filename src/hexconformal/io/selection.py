"""The cells that are worked on or measured, hexahedra or those of all types, and what becomes of the others."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import CELL_TYPES, SECOND_ORDER, SOLID_TYPES, recognized
from ..mesh import CellBlock, HexMesh, MixedMesh, flat_nodes

__all__ = ["HEXAHEDRA", "Block", "Selection", "mesh_of", "scatter_to_cells", "select", "with_straight_edges"]

HEXAHEDRA = ("hexahedron",)  # the types of cells that can be worked on

_LARGEST = 2**53  # numbers of nodes up to which those that come as real numbers are exact

_VOXEL = [0, 1, 3, 2, 4, 5, 7, 6]


@dataclass(frozen=True)
class Block:
    """Cells of one type: its meshio name, dimension, (k, j) nodes (flat if they vary), (k,) places among all cells."""

    name: str
    dimension: int
    nodes: NDArray[np.int64]
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class Selection:
    """The cells found.

    Attributes
    ----------
    cells
        (m, 8) corners of hexahedra in VTK order; of cells of several types the nodes, one cell after the other.
    rows
        (m,) their places among all cells.
    held
        (n,) nodes that must stay: those of other three-dimensional cells, and those that the file says.
    higher_order
        Linearized cells, with all of their nodes.
    notes
        What was changed, in words.
    blocks
        The cells by type, if there are others than hexahedra among them.
    """

    cells: NDArray[np.int64]
    rows: NDArray[np.int64]
    held: NDArray[np.bool_]
    higher_order: tuple[Block, ...]
    notes: tuple[str, ...]
    blocks: tuple[CellBlock, ...] = ()


def select(
    blocks: list[Block],
    point_count: int,
    other_cells: str,
    linearize: bool,
    ghosts: NDArray[np.bool_] | None = None,
    types: Collection[str] = HEXAHEDRA,
) -> Selection:
    """Find the hexahedra, or the cells of some types, among all cells.

    Ghost cells (m,), those of the neighbouring part of a mesh that is in parts, are carried along, their nodes held.

    Raises
    ------
    MeshError
        If there are none, if there are other three-dimensional cells and `other_cells` is "refuse", or if there are
        cells of second order whose corners are of the types, not among these themselves, and `linearize` is False.
        Others than hexahedra may be kept. Collapsed hexahedra (with a repeated node) count as other cells.
    """
    blocks, ghost_nodes, notes = _without_ghosts(blocks, ghosts)
    blocks = [part for block in blocks for part in _without_collapsed(block) if len(part.rows)]
    others, linearized = [], []
    found: dict[str, list[Block]] = {}
    for block in blocks:
        plain = SECOND_ORDER[block.name][0] if block.name in SECOND_ORDER else ""
        if linearize and plain in types:
            found.setdefault(plain, []).append(replace(block, nodes=block.nodes[:, : len(CELL_TYPES[plain].nodes)]))
            linearized.append(block)
        elif block.name in types:
            found.setdefault(block.name, []).append(block)
        elif block.name == "voxel":
            found.setdefault("hexahedron", []).append(replace(block, nodes=block.nodes[:, _VOXEL]))
            notes.append(f"{len(block.rows)} voxels are taken as hexahedra")
        elif block.dimension == 3:
            others.append(block)
    if linearized:
        notes.append(f"cells taken as linear, their edges straightened: {_counts_by_type(linearized)}")
    curved = [block for block in others if _has_corners_of(block, types)]
    if any(not found or other_cells == "refuse" or block.name.startswith("hexahedron") for block in curved):
        hexahedra = any(block.name.startswith("hexahedron") for block in curved)
        as_they_are = ", as_volume_mesh takes them as they are" if hexahedra and tuple(types) == HEXAHEDRA else ""
        kept = "" if hexahedra or not found else ", other_cells='keep' (--other-cells keep) carries them along"
        raise MeshError(
            f"cells of higher order: {_counts_by_type(curved)}; "
            f"linearize=True (--linearize) works with their corners{as_they_are}{kept}"
        )
    wanted = ", ".join(CELL_TYPES[name].plural for name in types if name in CELL_TYPES)
    if not found:
        flat = blocks and all(block.name in ("triangle", "quad") for block in blocks)
        hint = "; for surfaces there are surface.remesh, and the command remesh" if flat else ""
        higher = [block for block in others if block.name in SECOND_ORDER]
        if higher:
            raise MeshError(
                f"cells of higher order: {_counts_by_type(higher)}; there are no {wanted}, by their corners neither"
            )
        raise MeshError(f"there are no {wanted}, only: {_counts_by_type(blocks) or 'points'}{hint}")
    if others and other_cells == "refuse":
        raise MeshError(
            f"besides {wanted} there are other three-dimensional cells: {_counts_by_type(others)}; "
            "other_cells='keep' (--other-cells keep) carries them along and holds their nodes"
            + ("; as_volume_mesh takes all but polyhedra" if tuple(types) == HEXAHEDRA else "")
        )
    held = np.zeros(point_count, dtype=bool)
    for nodes in [*ghost_nodes, *(block.nodes.ravel() for block in others)]:
        held[nodes[(nodes >= 0) & (nodes < point_count)]] = True
    if others:
        notes.append(f"other cells are carried along, their nodes held: {_counts_by_type(others)}")
    rows = np.sort(np.concatenate([block.rows for parts in found.values() for block in parts]))
    by_type = tuple(_cell_block(name, found[name], rows) for name in SOLID_TYPES if name in found)
    only_hexes = list(found) == ["hexahedron"]
    cells = by_type[0].cells if only_hexes else flat_nodes(by_type)
    return Selection(cells, rows, held, tuple(linearized), tuple(notes), () if only_hexes else by_type)


def _has_corners_of(block: Block, types: Collection[str]) -> bool:
    """Whether a block is of second order, and would be of some types by its corners."""
    return block.name in SECOND_ORDER and SECOND_ORDER[block.name][0] in types


def _cell_block(name: str, parts: list[Block], rows: NDArray[np.int64]) -> CellBlock:
    """The cells of a type, from several blocks of it, in the order of their rows, which are some of `rows`."""
    own = np.concatenate([part.rows for part in parts])
    order = np.argsort(own, kind="stable")
    nodes = np.concatenate([part.nodes for part in parts])[order]
    bad = np.flatnonzero(~(np.abs(nodes) < _LARGEST).all(axis=1))
    if len(bad):
        raise MeshError(f"cells must have nodes that are numbers; others: {first_ids(bad)}")
    return CellBlock(SOLID_TYPES[name], nodes.astype(np.int64), np.searchsorted(rows, own[order]))


def mesh_of(points: Any, selection: Selection, point_data: Any, cell_data: Any, origin: Any) -> HexMesh | MixedMesh:
    """The mesh of the cells found: of hexahedra, or of several types."""
    if selection.blocks:
        return MixedMesh(points, selection.blocks, point_data, cell_data, origin)
    return HexMesh(points, selection.cells, point_data, cell_data, origin)


def _without_ghosts(
    blocks: list[Block], ghosts: NDArray[np.bool_] | None
) -> tuple[list[Block], list[NDArray[np.int64]], list[str]]:
    """The blocks without ghost cells, the nodes of these, and a remark."""
    if ghosts is None or not ghosts.any():
        return blocks, [], []
    nodes = []
    for number, block in enumerate(blocks):
        ghost = ghosts[block.rows]
        if ghost.any():
            of_cells = np.repeat(ghost, len(block.nodes.ravel()) // len(ghost))
            if block.nodes.size % len(ghost):
                raise MeshError(f"ghost cells of type {block.name} are not supported: leave them out of the file")
            nodes.append(block.nodes.ravel()[of_cells])
            kept = block.nodes.ravel()[~of_cells].reshape(-1, *block.nodes.shape[1:])
            blocks = [*blocks[:number], replace(block, nodes=kept, rows=block.rows[~ghost]), *blocks[number + 1 :]]
    return blocks, nodes, [f"ghost cells are carried along, their nodes held: {int(ghosts.sum())}"]


def _without_collapsed(block: Block) -> tuple[Block, ...]:
    """A block, or that of its hexahedra and those that are cells of another type, as nodes of theirs coincide."""
    if block.name not in ("hexahedron", "voxel"):
        return (block,)
    ordered = np.sort(block.nodes, axis=1)
    collapsed = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(collapsed) == 0:
        return (block,)
    parts, left = [], np.ones(len(collapsed), dtype=bool)
    nodes = block.nodes[collapsed] if block.name == "hexahedron" else block.nodes[collapsed][:, _VOXEL]
    for cell_type, rows, own in recognized(nodes):
        left[rows] = False
        parts.append(replace(block, name=cell_type.name, nodes=own, rows=block.rows[collapsed[rows]]))
    rest = collapsed[left]
    whole = np.setdiff1d(np.arange(len(block.rows)), collapsed)
    others = Block("collapsed hexahedron", block.dimension, block.nodes[rest], block.rows[rest])
    return replace(block, nodes=block.nodes[whole], rows=block.rows[whole]), others, *parts


def with_straight_edges(points: NDArray[np.float64], selection: Selection) -> NDArray[np.float64]:
    """A writable copy of the points with higher-order nodes put where the trilinear map of the corners has them."""
    result = points.copy()
    for block in selection.higher_order:
        between = SECOND_ORDER[block.name][1]
        for column, parents in enumerate(between, block.nodes.shape[1] - len(between)):
            result[block.nodes[:, column]] = points[block.nodes[:, list(parents)]].mean(axis=1)
    return result


def scatter_to_cells(old: Any, values: NDArray[Any], rows: NDArray[np.int64], count: int) -> NDArray[Any]:
    """An array on all `count` cells: `values` on the given rows, elsewhere `old`, or NaN (0 for integers)."""
    if old is not None and old.shape[1:] == values.shape[1:]:
        result = np.array(old, dtype=np.result_type(old.dtype, values.dtype), subok=False)
    elif values.dtype.kind in "fc":
        result = np.full((count, *values.shape[1:]), np.nan, dtype=values.dtype)
    else:
        result = np.zeros((count, *values.shape[1:]), dtype=values.dtype)
    result[rows] = values
    return result


def _counts_by_type(blocks: list[Block]) -> str:
    totals: dict[str, int] = {}
    for block in blocks:
        totals[block.name] = totals.get(block.name, 0) + len(block.rows)
    return ", ".join(f"{count} {name}" for name, count in totals.items())
