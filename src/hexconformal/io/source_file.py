"""Files that meshes come from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["FileContents", "SourceFile"]


@dataclass(frozen=True)
class SourceFile:
    """The file a mesh was read from.

    Attributes
    ----------
    path
        The file.
    format
        Name of its :class:`Format`.
    version, ascii
        Its variant, where a format has several: Gmsh 4.1 as text.
    text, data
        All of it, as text or as bytes, where writing puts new coordinates into what came; empty for other formats.
    node_labels, cell_labels
        The numbers that the file itself gives to the points, and to all cells (0 to those that it has no numbers for);
        None if it gives none.
    """

    path: Path
    format: str = ""
    version: str = ""
    ascii: bool = False
    text: str = field(default="", repr=False)
    data: bytes = field(default=b"", repr=False)
    node_labels: NDArray[np.int64] | None = field(default=None, repr=False, compare=False)
    cell_labels: NDArray[np.int64] | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class FileContents:
    """A meshio.Mesh or a pyvista dataset, the file it was read from, remarks of the reader, and points to hold."""

    data: Any
    file: SourceFile
    notes: tuple[str, ...] = ()
    held: NDArray[np.bool_] | None = None
