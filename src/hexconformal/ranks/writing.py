"""Meshes to files, each rank its piece: a .pvtu file that names them, and a .vtu file for each."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ..common import agreed, check_writable, write_text
from ..io import CELL_IDS, NODE_IDS, write
from ..mesh import HexMesh
from .mesh_piece import MeshPiece

__all__ = ["check_piece_writable", "piece_path", "write_piece"]

Kinds = dict[str, tuple[str, int]]

_VTK_TYPES = {"f4": "Float32", "f8": "Float64"} | {
    f"{kind}{size}": f"{sign}Int{8 * size}" for sign, kind in (("", "i"), ("U", "u")) for size in (1, 2, 4, 8)
}


def piece_path(path: str | os.PathLike[str], rank: int) -> Path:
    """The file of a rank's piece.

    >>> piece_path("better.pvtu", 3).name
    'better_0003.vtu'
    """
    path = Path(path)
    return path.with_name(f"{path.stem}_{rank:04d}.vtu")


def check_piece_writable(path: str | os.PathLike[str], comm: Any) -> None:
    """Raise a WriteError on all ranks unless each can write its piece, and rank 0 the file that names them."""
    with agreed(comm):
        check_writable(path, (".pvtu",))
        check_writable(piece_path(path, comm.rank))


def write_piece(path: str | os.PathLike[str], piece: MeshPiece, comm: Any) -> None:
    """Write a mesh that is shared out, each rank its own cells and their nodes; all must call it.

    Arrays GlobalNodeId and GlobalCellId hold the ids. A piece appears under its name only once it is complete, the
    .pvtu file once all of them are. Ranks without cells write none.

    Parameters
    ----------
    path
        A .pvtu file; pieces are beside it.
    piece
        What this rank has.
    comm
        The ranks.

    Raises
    ------
    WriteError
        If the folder is missing or cannot be written to, or the disk is full.
    """
    path = Path(path)
    used = np.unique(piece.cells)
    point_data = {name: values[used] for name, values in piece.point_data.items()} | {NODE_IDS: piece.node_ids[used]}
    cell_data = dict(piece.cell_data) | {CELL_IDS: piece.cell_ids}
    with agreed(comm):
        check_writable(path, (".pvtu",))
        if len(used):
            cells = np.searchsorted(used, piece.cells)
            write(piece_path(path, comm.rank), HexMesh(piece.points[used], cells, point_data, cell_data))
    # A rank that has nothing need not know the arrays of others.
    kinds = _kinds(point_data), _kinds(cell_data)
    have = [(rank, kinds) for rank, kinds in enumerate(comm.allgather(kinds if len(used) else None)) if kinds]
    with agreed(comm, named=False):
        if comm.rank == 0:
            files = [piece_path(path, rank).name for rank, _ in have]
            write_text(path, _index(files, *(have[0][1] if have else kinds)))


def _kinds(data: dict[str, NDArray[Any]]) -> Kinds:
    """Types of arrays, and how many numbers these have in a row, by name."""
    return {
        name: (
            "UInt8" if values.dtype == bool else _VTK_TYPES[values.dtype.str[1:]],
            int(np.prod(values.shape[1:], dtype=np.int64)),
        )
        for name, values in data.items()
    }


def _index(files: list[str], point_data: Kinds, cell_data: Kinds) -> str:
    """The text of a .pvtu file."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32">',
        '  <PUnstructuredGrid GhostLevel="0">',
        *_section("PPointData", point_data),
        *_section("PCellData", cell_data),
        "    <PPoints>",
        '      <PDataArray type="Float64" Name="Points" NumberOfComponents="3"/>',
        "    </PPoints>",
        *(f"    <Piece Source={quoteattr(name)}/>" for name in files),
        "  </PUnstructuredGrid>",
        "</VTKFile>",
    ]
    return "\n".join(lines) + "\n"


def _section(name: str, kinds: Kinds) -> list[str]:
    arrays = [
        f'      <PDataArray type="{kind}" Name={quoteattr(key)} NumberOfComponents="{count}"/>'
        for key, (kind, count) in kinds.items()
    ]
    return [f"    <{name}>", *arrays, f"    </{name}>"]
