"""A file format as the rest of the library sees it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common import WriteError
from ..source_file import FileContents, SourceFile
from .capabilities import Capabilities

__all__ = ["Format"]


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    name
        As messages say it.
    read
        Reads a file.
    write
        Writes a HexMesh, or what :meth:`surface.SurfaceMesh.for_origin` makes of a surface, and returns what could
        not be kept, in words. None if the format is only read.
    capabilities
        What the format can hold; None if that is all that a mesh has.
    put_points
        Gives a file that was read the points, and the new arrays, of a mesh, and leaves all else as it is: such a file
        is written as it came. Returns the bytes of the file, and what could not be kept, in words; or None where the
        file must be written anew. None for formats whose files always are.
    files_named
        The files that one of this format names, which are read with it.
    """

    name: str
    read: Callable[[Path], FileContents]
    write: Callable[[Path, Any], list[str]] | None = None
    capabilities: Capabilities | None = None
    put_points: Callable[[SourceFile, Any], tuple[bytes, list[str]] | None] | None = None
    files_named: Callable[[Path], Iterable[Path]] = lambda path: ()

    def save(self, target: Path, mesh: Any) -> list[str]:
        """Write a mesh: into the file it came from if it can be, otherwise anew; returns what could not be kept."""
        if self.write is None:
            raise WriteError(f"{self.name} files are only read")
        file = getattr(mesh.origin, "file", None)
        model = [] if file is None else [f"{what} of the {file.format} file" for what in file.model]
        if self.put_points is None or file is None or file.format != self.name:
            return [*model, *self.write(target, mesh)]
        if file.other_cells or not np.array_equal(mesh.cells, mesh.origin.selection.cells):
            reason = "because elements have other nodes or another node order"
            return [f"all of the file but nodes, elements and sets, {reason}", *model, *self.write(target, mesh)]
        result = self.put_points(file, mesh)
        if result is None:
            return [*model, *self.write(target, mesh)]
        target.write_bytes(result[0])
        return result[1]
