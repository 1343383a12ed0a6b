"""Nastran's bulk data (.bdf, .nas, .fem): a deck that was read is written as it came, with other coordinates."""

from __future__ import annotations

from ...format_tools.format import Format
from ...format_tools.rewriting import through_meshio
from .deck import put_points
from .read import read
from .write import CAPABILITIES, write

__all__ = ["NASTRAN"]

NASTRAN = Format("nastran", read, write, CAPABILITIES, through_meshio(put_points, CAPABILITIES))
