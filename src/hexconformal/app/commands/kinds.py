"""Kinds of meshes: how one is read, measured, drawn and written; volumes are here, `surface_kind` has the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import plots
from ...io import WRITE_EXTENSIONS, as_volume_mesh, read, write
from ...mesh import MixedMesh
from ...quality import Quality, quality

if TYPE_CHECKING:
    from ...page import Page

__all__ = ["VOLUMES", "MeshKind"]


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


def _page_of_volume(*meshes: Any, **options: Any) -> Page:
    from ...page import volume_page  # not loaded where no page is written

    return volume_page(*meshes, **options)


VOLUMES = MeshKind(
    measure=quality,
    arrays=Quality.arrays,
    write=write,
    extensions=WRITE_EXTENSIONS,
    histogram=plots.histogram,
    before_after=plots.before_after,
    worst_cells=plots.worst_cells,
    worst_measure="scaled_jacobian",
    page=_page_of_volume,
    read_like=_read_volume_like,
)
