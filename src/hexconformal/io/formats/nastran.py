"""Nastran's bulk data (.bdf, .nas, .fem), where meshio is stricter than Nastran."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from ...common import ReadError
from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.captured_output import captured_output
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, parsing
from ..format_tools.meshio_internals import nastran_writer
from ..source_file import FileContents, SourceFile

__all__ = ["NASTRAN"]

_CAPABILITIES = Capabilities(
    cell_types="vertex line triangle triangle6 quad quad8 quad9 tetra tetra10 pyramid wedge hexahedron hexahedron20"
)


def _read(path: Path) -> FileContents:
    """Read bulk data. BEGIN BULK may be missing, as in what Gmsh writes, and in files to include."""
    with parsing("nastran") as output:
        import meshio

        text = path.read_text(encoding="utf-8", errors="replace")
        *_, bulk = re.split(r"(?im)^\s*BEGIN +BULK\b.*$", text, maxsplit=1)
        if not re.search(r"(?m)^(?!\$|//|#).{3}", bulk):
            raise ReadError("there is no bulk data in it")  # which meshio would look for for ever
        mesh = meshio.nastran.read(io.StringIO(f"BEGIN BULK\n{bulk}\n"))
    return checked_contents(mesh, SourceFile(path, "nastran"), output)


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "nastran", _CAPABILITIES)
    with captured_output():
        nastran_writer(_real)(target, out)
    return [*lost, "digits of coordinates beyond the 16 characters of a field"]


def _real(value: float) -> str:
    """A number in at most 16 characters, with as many digits as there is room for beside sign and exponent.

    >>> _real(1 / 3), _real(-1 / 3), _real(-1e-17 / 3)
    ('3.33333333333E-1', '-3.3333333333E-1', '-3.333333333E-18')
    """
    texts = (np.format_float_scientific(value, exp_digits=1, precision=digits) for digits in (11, 10, 9, 8))
    return next(text for text in texts if len(text) <= 16).replace("e", "E")


NASTRAN = Format("nastran", (".bdf", ".fem", ".nas"), _read, _write, _CAPABILITIES)
