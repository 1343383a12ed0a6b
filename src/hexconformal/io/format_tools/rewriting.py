"""Files that are written as they came, with other coordinates: what of a mesh is not what the file had."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError
from ..convert import to_meshio
from ..source_file import SourceFile
from .capabilities import Capabilities, drop_unsupported_data

__all__ = ["changed_arrays", "decoded", "encoded", "named", "put_words", "through_meshio"]


def changed_arrays(mesh: Any) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Arrays on points, and on the cells that are worked on, that the file of a mesh has not, or has with other values.

    Parameters
    ----------
    mesh
        A HexMesh, or what :meth:`surface.SurfaceMesh.for_origin` makes of a surface; it comes from a file.
    """
    source, rows = mesh.origin.source, mesh.origin.selection.rows
    on_points = {name: a for name, a in mesh.point_data.items() if not _same(a, source.point_data.get(name))}
    on_cells = {}
    for name, array in mesh.cell_data.items():
        old = source.cell_data.get(name)
        if isinstance(old, list):
            old = np.concatenate([np.asarray(part) for part in old])
        if old is None or not _same(array, np.asarray(old)[rows]):
            on_cells[name] = array
    return on_points, on_cells


def through_meshio(
    put_points: Callable[[SourceFile, Any], tuple[bytes, list[str]]], can: Capabilities
) -> Callable[[SourceFile, Any], tuple[bytes, list[str]]]:
    """What puts a mesh into a file that came, made of what puts a meshio.Mesh there."""

    def put(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]]:
        out, lost = to_meshio(mesh)
        lost += drop_unsupported_data(out, can)
        data, more = put_points(file, out)
        return data, [*lost, *more]

    return put


def named(changed: tuple[dict[str, Any], dict[str, Any]]) -> list[str]:
    """Arrays on points and on cells, in words."""
    return [f"point array {name!r}" for name in changed[0]] + [f"cell array {name!r}" for name in changed[1]]


def _same(new: Any, old: Any) -> bool:
    if old is None:
        return False
    new, old = np.asarray(new), np.asarray(old)
    new = new.reshape(len(new), -1) if new.ndim > 2 else new
    if new.shape != old.shape:
        return False
    return np.array_equal(new, old, equal_nan=new.dtype.kind in "fc" and old.dtype.kind in "fc")


def decoded(data: bytes) -> str:
    """The text of a file; bytes that are no UTF-8 come out of `encoded` as they came in."""
    return data.decode("utf-8", "surrogateescape")


def encoded(text: str) -> bytes:
    """The bytes of a text from `decoded`."""
    return text.encode("utf-8", "surrogateescape")


def put_words(line: str, place: int, new: list[str]) -> str:
    """A line with some of its words, from number `place`, replaced; what is between words stays.

    >>> put_words("v  0 0 1  # corner", 1, ["0.5", "2.0", "1.0"])
    'v  0.5 2.0 1.0  # corner'
    """
    pieces, count = _pieces(line), -1
    for number, piece in enumerate(pieces):
        if piece and not piece.isspace():
            count += 1
            if place <= count < place + len(new):
                pieces[number] = new[count - place]
    if count + 1 < place + len(new):
        raise ReadError(f"a line must have {place + len(new)} words: {line.strip()!r}")
    return "".join(pieces)


def _pieces(line: str) -> list[str]:
    return re.split(r"(\s+)", line)
