"""Files that meshes come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import NodePairs

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
    node_labels
        What the file calls its points, in their order: integers, or strings where these are not unique; None if
        it counts from 0.
    cell_labels
        What it calls its cells, of all types, in their order (0 for those it has no number for); None likewise.
    type_names
        (m,) what it calls the types of its cells, such as C3D8R, in their order; None likewise.
    cell_groups
        Cells in groups that the file names, as runs of rows, where what is read from it has no place for them.
    face_sets
        Faces (k, 4) of hexahedra that the file lists by cell and side, by name, where what is read from it has no
        place for them.
    sections
        Names of the sets of cells to which the file gives a material.
    model
        What only this format keeps, by name and count, such as "2 *MATERIAL": told when another is written.
    coupled_pairs
        Pairs of nodes that the file couples, where what is read from it has no place for them.
    other_cells
        Whether cells of the mesh have other nodes than the file tells, so that it cannot be written as it came.
    """

    path: Path
    format: str = ""
    version: str = ""
    ascii: bool = False
    text: str = field(default="", repr=False)
    data: bytes = field(default=b"", repr=False)
    node_labels: NDArray[Any] | None = field(default=None, repr=False, compare=False)
    cell_labels: NDArray[Any] | None = field(default=None, repr=False, compare=False)
    type_names: NDArray[np.str_] | None = field(default=None, repr=False, compare=False)
    cell_groups: Mapping[str, Sequence[range]] = field(default_factory=dict, repr=False, compare=False)
    face_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict, repr=False, compare=False)
    sections: tuple[str, ...] = ()
    model: tuple[str, ...] = ()
    coupled_pairs: tuple[NodePairs, ...] = field(default=(), repr=False, compare=False)
    other_cells: bool = False


@dataclass(frozen=True)
class FileContents:
    """What was read from a file.

    Attributes
    ----------
    data
        A meshio.Mesh or a pyvista dataset.
    file
        The file.
    notes
        Remarks of the reader.
    held
        Points that must stay, since cells that are not in `data` hang on them: booleans (n,) or ids; None if no
        such cells were set aside.
    """

    data: Any
    file: SourceFile
    notes: tuple[str, ...] = ()
    held: NDArray[Any] | None = field(default=None, repr=False, compare=False)
