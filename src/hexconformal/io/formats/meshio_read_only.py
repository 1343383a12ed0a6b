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

__all__ = ["AVS_UCD", "FLAC3D", "H5M", "KRATOS", "NETGEN", "SU2", "TECPLOT", "UGRID"]


def _read(path: Path, name: str) -> FileContents:
    with parsing(name) as output:
        read = with_globals(import_module(f"meshio.{name}").read, open_file=open_ending_file)
        mesh = read(str(path))
    return checked_contents(mesh, SourceFile(path, name), output)


def _format(name: str) -> Format:
    return Format(name, partial(_read, name=name))


AVS_UCD = _format("avsucd")
FLAC3D = _format("flac3d")
H5M = _format("h5m")
KRATOS = _format("mdpa")
NETGEN = _format("netgen")
SU2 = _format("su2")
TECPLOT = _format("tecplot")
UGRID = _format("ugrid")
