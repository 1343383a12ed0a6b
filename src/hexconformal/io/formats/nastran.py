"""Nastran's bulk data, where meshio is stricter than Nastran."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from ...common import ReadError

__all__ = ["in_a_field", "read_bulk"]


def read_bulk(path: Path) -> Any:
    """The meshio.Mesh of a file. BEGIN BULK may be missing, as in what Gmsh writes, and in files to include."""
    from meshio.nastran._nastran import read_buffer

    *_, bulk = re.split(r"(?im)^\s*BEGIN +BULK\b.*$", path.read_text(encoding="utf-8", errors="replace"), maxsplit=1)
    if not re.search(r"(?m)^(?!\$|//|#).{3}", bulk):
        raise ReadError("there is no bulk data in it")  # which meshio would look for for ever
    return read_buffer(io.StringIO(f"BEGIN BULK\n{bulk}\n"))


def in_a_field(value: float) -> str:
    """A number in at most 16 characters, with as many digits as find room beside sign and exponent.

    >>> in_a_field(1 / 3), in_a_field(-1 / 3), in_a_field(-1e-17 / 3)
    ('3.33333333333E-1', '-3.3333333333E-1', '-3.333333333E-18')
    """
    texts = (np.format_float_scientific(value, exp_digits=1, precision=digits) for digits in (11, 10, 9, 8))
    return next(text for text in texts if len(text) <= 16).replace("e", "E")
