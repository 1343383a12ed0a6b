"""Meshes from files, each rank its share."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, ReadError, agreed, reading
from ..io import CELL_IDS, NODE_IDS, READ_EXTENSIONS, VtuRows, pieces_of, read, referenced_file
from .distribution import with_all_arrays
from .mesh_piece import MeshPiece
from .routes import Routes

__all__ = ["are_nodes_numbered", "read_piece"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_GHOSTS = "vtkGhostType"
_HEXAHEDRON = 12


def read_piece(path: str | os.PathLike[str], comm: Any) -> MeshPiece:
    """Read a mesh of hexahedra, each rank its share; all must call it.

    Of a .vtu file in binary form each rank decodes its rows alone. The pieces that a .pvtu file names go to the ranks
    in turn; their nodes and cells are known by the arrays GlobalNodeId and GlobalCellId, where there are none nodes are
    one where they are at the same place. Other files are read by rank 0, which must have the memory for all of it.

    Parameters
    ----------
    path
        A file with one of the extensions that :func:`hexconformal.read` takes.
    comm
        The ranks.

    Raises
    ------
    ReadError
        If a file is missing, truncated or malformed.
    MeshError
        If it holds other cells than hexahedra: ranks do not carry these along yet.
    """
    return with_all_arrays(_read(Path(path), comm), comm)


def are_nodes_numbered(path: str | os.PathLike[str]) -> bool:
    """True where ids of nodes are numbers that the file gives them: those of a .vtu file from 0, or GlobalNodeId.

    Other formats have labels, which ranks do not know.
    """
    path = Path(path)
    if path.suffix.lower() != ".pvtu":
        return path.suffix.lower() == ".vtu"
    with reading(path, (".pvtu",)):
        return all(NODE_IDS in VtuRows(source).names("PointData") for source in _sources(path))


def _read(path: Path, comm: Any) -> MeshPiece:
    with agreed(comm, named=False), reading(path, READ_EXTENSIONS):
        rows = _rows_of(path)
    if path.suffix.lower() == ".pvtu":
        return _of_parts(path, comm)
    if rows is not None:
        return _share(path, rows, comm)
    mesh = MeshPiece.nothing()
    with agreed(comm, named=False):
        if comm.rank == 0:
            mesh = _whole(path)
    return mesh


def _rows_of(path: Path) -> VtuRows | None:
    """The rows of a .vtu file; None where another way to read it has to be taken."""
    if path.suffix.lower() != ".vtu":
        return None
    try:
        return VtuRows(path)
    except ReadError:
        return None  # text, several pieces, or no sound file, which is told by those who read it whole


def _whole(path: Path) -> MeshPiece:
    """A file read by one rank."""
    mesh = read(path)
    if mesh.origin is not None and len(mesh.origin.selection.rows) < _cells_of(mesh):
        raise MeshError(f"{path}: {_others(_cells_of(mesh) - len(mesh.cells))}")
    nodes, cells = np.arange(len(mesh.points)), np.arange(len(mesh.cells))
    points = {name: values for name, values in mesh.point_data.items() if name != NODE_IDS}
    return MeshPiece(mesh.points, mesh.cells, points, dict(mesh.cell_data), node_ids=nodes, cell_ids=cells)


def _cells_of(mesh: Any) -> int:
    source = mesh.origin.source
    count: int = source.n_cells if hasattr(source, "n_cells") else sum(len(block.data) for block in source.cells)
    return count


def _others(count: int) -> str:
    return f"{count} other cells than hexahedra; ranks do not carry these along yet: leave them out of the file"


def _share(path: Path, rows: VtuRows, comm: Any) -> MeshPiece:
    """A rank's share of a .vtu file: as many of its cells as others have, and their nodes."""
    ends = [np.arange(comm.size + 1) * count // comm.size for count in (rows.points, rows.cells)]
    (first, last), (begin, end) = ((int(one[comm.rank]), int(one[comm.rank + 1])) for one in ends)
    with agreed(comm, named=False), reading(path, (".vtu",)):
        cells, cell_data = _cells(rows, begin, end)
        points = rows.rows("Points", "", first, last).reshape(-1, 3).astype(np.float64)
        data = {name: rows.rows("PointData", name, first, last) for name in rows.names("PointData")}
        if len(cells) and (cells.min() < 0 or cells.max() >= rows.points):
            raise ReadError(f"it has cells with node ids outside 0..{rows.points - 1}")
    # Nodes of other ranks' rows are asked for there.
    nodes, local = np.unique(np.concatenate([cells.ravel(), np.arange(first, last)]), return_inverse=True)
    routes = Routes(comm, np.searchsorted(ends[0], nodes, side="right") - 1)
    asked = routes.forward(nodes) - first
    data = {name: routes.backward(values[asked]) for name, values in data.items() if name != NODE_IDS}
    places = local.ravel()[: cells.size].reshape(-1, 8)
    ids = np.arange(begin, end)
    return MeshPiece(routes.backward(points[asked]), places, data, cell_data, node_ids=nodes, cell_ids=ids)


def _cells(rows: VtuRows, begin: int, end: int) -> tuple[Ints, dict[str, NDArray[Any]]]:
    """Hexahedra (m, 8) of some rows of a file, and the arrays on them."""
    kinds = rows.rows("Cells", "types", begin, end)
    if (kinds != _HEXAHEDRON).any():
        raise MeshError(_others(int((kinds != _HEXAHEDRON).sum())))
    if begin == end:
        cells = np.empty((0, 8), dtype=np.int64)
    else:
        if not np.array_equal(rows.rows("Cells", "offsets", begin, end), 8 * np.arange(begin + 1, end + 1)):
            raise ReadError("the file is malformed (offsets of its cells are not those of hexahedra)")
        cells = rows.rows("Cells", "connectivity", 8 * begin, 8 * end).astype(np.int64).reshape(-1, 8)
    names = [name for name in rows.names("CellData") if name != CELL_IDS]
    return cells, {name: rows.rows("CellData", name, begin, end) for name in names}


def _of_parts(path: Path, comm: Any) -> MeshPiece:
    """The pieces of a .pvtu file that fall to a rank, joined."""
    with agreed(comm, named=False), reading(path, (".pvtu",)):
        sources = _sources(path)
        own = sources[comm.rank * len(sources) // comm.size : (comm.rank + 1) * len(sources) // comm.size]
        parts = [_part(source) for source in own]
        if any(set(part.point_data) != set(parts[0].point_data) for part in parts):
            raise MeshError("its pieces must have the same arrays")
        points, cells, data, cell_data = _joined(parts)
    known = [NODE_IDS in part.point_data and CELL_IDS in part.cell_data for part in parts]
    node_ids, cell_ids = data.pop(NODE_IDS, None), cell_data.pop(CELL_IDS, None)
    if not all(comm.allgather(all(known))):
        node_ids = _ids_by_place(comm, points)
        cell_ids = (comm.exscan(len(cells)) or 0) + np.arange(len(cells))
    # Each node once.
    names = np.empty(0, np.int64) if node_ids is None else node_ids.astype(np.int64)
    ids, first, place = np.unique(names, return_index=True, return_inverse=True)
    data = {name: values[first] for name, values in data.items()}
    numbers = np.empty(0, np.int64) if cell_ids is None else cell_ids.astype(np.int64)
    return MeshPiece(points[first], place.ravel()[cells], data, cell_data, node_ids=ids, cell_ids=numbers)


def _sources(path: Path) -> list[Path]:
    """The files of the pieces that a .pvtu file names, in its folder."""
    return [referenced_file(path, os.path.relpath(source, path.parent)) for source in pieces_of(path)]


class _Part(NamedTuple):
    """Points, cells and arrays of a piece of a file."""

    points: Field
    cells: Ints
    point_data: dict[str, NDArray[Any]]
    cell_data: dict[str, NDArray[Any]]


def _joined(parts: Sequence[_Part]) -> _Part:
    """Pieces as one, their points one after the other."""
    starts = np.concatenate([[0], np.cumsum([len(part.points) for part in parts])]).astype(np.int64)
    points = np.concatenate([np.empty((0, 3)), *(part.points for part in parts)])
    cells = [part.cells + start for part, start in zip(parts, starts, strict=False)]
    data, cell_data = (
        {name: np.concatenate([one[name] for one in arrays]) for name in (arrays[0] if arrays else ())}
        for arrays in ([part.point_data for part in parts], [part.cell_data for part in parts])
    )
    return _Part(points, np.concatenate([np.empty((0, 8), np.int64), *cells]), data, cell_data)


def _part(path: Path) -> _Part:
    """Points, cells and arrays of a piece of a file, without ghost cells."""
    with reading(path, (".vtu",)):
        rows = VtuRows(path)
        points = rows.rows("Points", "", 0, rows.points).reshape(-1, 3).astype(np.float64)
        data = {name: rows.rows("PointData", name, 0, rows.points) for name in rows.names("PointData")}
        cells, cell_data = _cells(rows, 0, rows.cells)
        if CELL_IDS in rows.names("CellData"):
            cell_data[CELL_IDS] = rows.rows("CellData", CELL_IDS, 0, rows.cells)
        if len(cells) and (cells.min() < 0 or cells.max() >= len(points)):
            raise ReadError(f"it has cells with node ids outside 0..{len(points) - 1}")
    data.pop(_GHOSTS, None)
    ghosts = cell_data.pop(_GHOSTS, None)
    if ghosts is not None:
        cells, cell_data = cells[ghosts == 0], {name: values[ghosts == 0] for name, values in cell_data.items()}
    return _Part(points, cells, data, cell_data)


def _ids_by_place(comm: Any, points: Field) -> Ints:
    """Ids (n,) of points of all ranks, the same for those at the same place."""
    bits = np.ascontiguousarray(points + 0.0).view(np.int64)  # no negative zeros
    mixed = (bits * np.array([73856093, 19349663, 83492791])).sum(axis=1)
    routes = Routes(comm, np.abs(mixed >> 17) % comm.size)
    _, which = np.unique(routes.forward(bits), axis=0, return_inverse=True)
    count = int(which.max(initial=-1)) + 1
    return routes.backward((comm.exscan(count) or 0) + which.ravel())
