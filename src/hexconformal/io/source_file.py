"""Files that meshes come from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

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
    data
        All its bytes, where writing puts new coordinates into the file that came; empty for other formats.
    text
        All of it, where writing puts new coordinates into the text that came; empty for other formats.
    """

    path: Path
    format: str = ""
    version: str = ""
    ascii: bool = False
    data: bytes = field(default=b"", repr=False)
    text: str = field(default="", repr=False)


@dataclass(frozen=True)
class FileContents:
    """A meshio.Mesh or a pyvista dataset, the file it was read from, and remarks of the reader."""

    data: Any
    file: SourceFile
    notes: tuple[str, ...] = ()
