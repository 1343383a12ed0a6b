"""Formats that are only read, by meshio: AVS UCD, FLAC3D, H5M, Kratos, Netgen, SU2, Tecplot, UGRID."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from pathlib import Path

from ..format_tools.ending_file import open_ending_file
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, parsing
from ..format_tools.meshio_internals import with_globals
from ..source_file import FileContents, SourceFile

__all__ = ["MESHIO_READ_ONLY"]

_EXTENSIONS = {
    "avsucd": (".avs",),
    "flac3d": (".f3grid",),
    "h5m": (".h5m",),
    "mdpa": (".mdpa",),
    "netgen": (".vol",),
    "su2": (".su2",),
    "tecplot": (".dat", ".tec"),
    "ugrid": (".ugrid",),
}


def _read(path: Path, name: str) -> FileContents:
    with parsing(name) as output:
        read = with_globals(import_module(f"meshio.{name}").read, open_file=open_ending_file)
        mesh = read(str(path))
    return checked_contents(mesh, SourceFile(path, name), output)


MESHIO_READ_ONLY = tuple(
    Format(name, extensions, partial(_read, name=name)) for name, extensions in _EXTENSIONS.items()
)
