"""Exodus II (.e, .exo, .ex2): element blocks, sets of nodes, sides and elements, variables over time, in netCDF.

A file that was read is written as it came, with other coordinates.
"""

from __future__ import annotations

from ...format_tools.format import Format
from ...format_tools.rewriting import through_meshio
from .copy import put_points
from .read import read
from .write import CAPABILITIES, write

__all__ = ["EXODUS"]

EXODUS = Format("exodus", read, write, CAPABILITIES, through_meshio(put_points, CAPABILITIES))
