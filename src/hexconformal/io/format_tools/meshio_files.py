"""meshio's parsers and writers, kept from printing, exiting, guessing and losing quietly."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from ...common import ReadError, WriteError
from ..source_file import FileContents, SourceFile
from .captured_output import captured_output
from .meshio_internals import cell_block

__all__ = [
    "checked_contents",
    "file_head",
    "join_blocks",
    "parsing",
    "permuted_nodes",
    "refuse_namesake",
    "require_disk_space",
    "write_with_meshio",
]

_HDF5_OVERHEAD = 100_000  # bytes


@contextmanager
def parsing(name: str) -> Iterator[StringIO]:
    """Captured output of a parser of the named format; what it raises becomes a ReadError."""
    with captured_output() as output:
        try:
            yield output
        except (ImportError, MemoryError, ReadError):
            raise
        except (Exception, SystemExit) as problem:
            reason = f"{type(problem).__name__}: {problem}" if str(problem) else "malformed"
            raise ReadError(f"not a sound {name} file ({reason})") from problem


def checked_contents(mesh: Any, file: SourceFile, output: StringIO) -> FileContents:
    """Contents of a file, with the parser's output as notes; raises a ReadError if there is no mesh."""
    import meshio

    if not isinstance(mesh, meshio.Mesh) or len(mesh.points) == 0 or not sum(len(block.data) for block in mesh.cells):
        raise ReadError(f"the {file.format} file holds no mesh, or only the beginning of one")
    return FileContents(mesh, file, tuple(line for line in output.getvalue().splitlines() if line.strip()))


def file_head(path: Path) -> bytes:
    """The first 64 KiB of a file."""
    with path.open("rb") as handle:
        return handle.read(1 << 16)


def refuse_namesake(path: Path, beginning: bytes, advice: str) -> None:
    """Raise a ReadError if a file is of another format of the same extension, known by how it begins."""
    if re.match(rb"\s*" + beginning, file_head(path)):
        raise ReadError(advice)


def write_with_meshio(target: Path, mesh: Any, name: str, **options: Any) -> None:
    """Write a meshio.Mesh with meshio's writer of that name."""
    with captured_output():
        import meshio

        meshio.write(target, mesh, file_format=name, **options)


def require_disk_space(target: Path, mesh: Any, more: int = 0) -> None:
    """Raise a WriteError if a meshio.Mesh, and two copies of what takes `more` bytes, do not fit on the disk: HDF5 may
    crash then, or lose what it has not yet written."""
    arrays = [mesh.points, *(block.data for block in mesh.cells), *mesh.point_data.values()]
    arrays += [part for parts in mesh.cell_data.values() for part in parts]
    needed = sum(np.asarray(array).nbytes for array in arrays) + 2 * more + _HDF5_OVERHEAD
    free = shutil.disk_usage(target.parent).free
    if free < needed:
        raise WriteError(f"the disk is full: some {needed / 1e6:.1f} MB are needed, {free / 1e6:.1f} MB are free")


def permuted_nodes(blocks: list[Any], orders: dict[str, list[int]], inverse: bool = False) -> list[Any]:
    """Blocks of cells with their nodes in another order.

    Parameters
    ----------
    blocks
        meshio.CellBlock.
    orders
        By type of cell, for each node its place in the given blocks; other types stay as they are.
    inverse
        Go the other way.
    """
    if inverse:
        orders = {name: np.argsort(order).tolist() for name, order in orders.items()}
    return [
        cell_block(block.type, block.data[:, orders[block.type]], block.tags) if block.type in orders else block
        for block in blocks
    ]


def join_blocks(mesh: Any) -> Any:
    """A meshio.Mesh with one block of cells per type; the same one if it is so already."""
    import meshio

    types = list(dict.fromkeys(block.type for block in mesh.cells))
    if len(types) == len(mesh.cells):
        return mesh
    groups = [[number for number, block in enumerate(mesh.cells) if block.type == name] for name in types]
    cell_data = {
        name: [np.concatenate([parts[number] for number in group]) for group in groups]
        for name, parts in mesh.cell_data.items()
    }
    blocks = [
        cell_block(name, np.concatenate([mesh.cells[number].data for number in group]))
        for name, group in zip(types, groups, strict=True)
    ]
    result = meshio.Mesh(mesh.points, blocks, mesh.point_data, cell_data, mesh.field_data, mesh.point_sets)
    for name in vars(mesh).keys() - vars(result).keys():
        setattr(result, name, getattr(mesh, name))
    return result
