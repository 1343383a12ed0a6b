"""Volumes and surfaces alike: how a kind of mesh is measured, drawn and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...io import WRITE_EXTENSIONS, write
from ...plots import before_after, histogram, worst_cells
from ...quality import Quality, quality

__all__ = ["VOLUMES", "Kind"]


@dataclass(frozen=True)
class Kind:
    """What commands need to know of a kind of mesh.

    Attributes
    ----------
    measure
        Measures of every cell.
    arrays
        The same by name, to put them on a mesh.
    write
        Writes a mesh; what the format could not keep.
    extensions
        Those that `write` knows.
    histogram, before_after, worst_cells
        Draw one mesh, or one before and after.
    worst_by
        The measure that tells which cells are the worst.
    """

    measure: Callable[[Any], Any]
    arrays: Callable[[Any], dict[str, Any]]
    write: Callable[..., list[str]]
    extensions: tuple[str, ...]
    histogram: Callable[..., None]
    before_after: Callable[..., None]
    worst_cells: Callable[..., None]
    worst_by: str


VOLUMES = Kind(
    quality, Quality.arrays, write, WRITE_EXTENSIONS, histogram, before_after, worst_cells, "scaled_jacobian"
)
