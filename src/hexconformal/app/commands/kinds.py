"""Volumes and surfaces: how a mesh of either kind is read, measured, drawn and written."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import surface
from surface import plots as surface_plots
from surface.io import EXTENSIONS
from surface.page import surface_page

from ... import plots
from ...common import MeshError, ReadError
from ...io import READ_EXTENSIONS, WRITE_EXTENSIONS, as_volume_mesh, read, write
from ...mesh import MixedMesh
from ...page import Page, volume_page
from ...quality import Quality, quality
from .arguments import read_volume

__all__ = ["SURFACES", "VOLUMES", "MeshKind", "read_any_mesh"]


@dataclass(frozen=True)
class MeshKind:
    """The functions that commands use on a kind of mesh.

    Attributes
    ----------
    measure
        Measures of every cell.
    arrays
        The same by name, to put them on a mesh.
    write
        Writes a mesh; returns what the format could not store.
    extensions
        Those that `write` knows.
    histogram, before_after, worst_cells
        Draw one mesh, or one before and after.
    worst_measure
        The measure that tells which cells are the worst.
    page
        The page of a mesh, or of one before and after.
    read_like
        Reads from a file the cells that a mesh has.
    """

    measure: Callable[[Any], Any]
    arrays: Callable[[Any], dict[str, Any]]
    write: Callable[..., list[str]]
    extensions: tuple[str, ...]
    histogram: Callable[..., None]
    before_after: Callable[..., None]
    worst_cells: Callable[..., None]
    worst_measure: str
    page: Callable[..., Page]
    read_like: Callable[[Path, Any], Any]


def _read_volume_like(path: Path, mesh: Any) -> Any:
    if isinstance(mesh, MixedMesh):
        return as_volume_mesh(path, other_cells="keep")
    return read(path, other_cells="keep", linearize=True)


VOLUMES = MeshKind(
    measure=quality,
    arrays=Quality.arrays,
    write=write,
    extensions=WRITE_EXTENSIONS,
    histogram=plots.histogram,
    before_after=plots.before_after,
    worst_cells=plots.worst_cells,
    worst_measure="scaled_jacobian",
    page=volume_page,
    read_like=_read_volume_like,
)
SURFACES = MeshKind(
    measure=surface.quality,
    arrays=surface.Quality.arrays,
    write=surface.write,
    extensions=EXTENSIONS,
    histogram=surface_plots.histogram,
    before_after=surface_plots.before_after,
    worst_cells=surface_plots.worst_cells,
    worst_measure="conformality",
    page=surface_page,
    read_like=lambda path, mesh: surface.read(path),
)


def read_any_mesh(arguments: Namespace) -> tuple[MeshKind, Any]:
    """Read a mesh of solid cells, or of triangles and quadrilaterals if there are none."""
    extension = Path(arguments.input).suffix.lower()
    is_surface_file = extension in SURFACES.extensions
    if is_surface_file and extension not in READ_EXTENSIONS:
        return SURFACES, surface.read(arguments.input)
    try:
        return VOLUMES, read_volume(arguments)
    except ReadError:
        raise
    except MeshError:
        if not is_surface_file:
            raise
        try:
            return SURFACES, surface.read(arguments.input)
        except MeshError:
            # The file holds no surface either, so the error of the volume is the one to tell.
            pass
        raise
