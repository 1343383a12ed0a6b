"""Points and polygons in their order, as .obj, .off, .ply and .stl files hold them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError, ReadError, first_ids
from ..convert import to_pyvista
from ..grid_cells import cell_nodes
from ..source_file import FileContents, SourceFile
from .format import Format
from .rewriting import changed_arrays, named

__all__ = ["Polygons", "polygon_format"]

_FACES = (5, 7, 9)  # VTK's triangles, polygons and quadrilaterals


@dataclass
class Polygons:
    """Points (n, 3); polygons as ``sizes`` (m,) and ``nodes``, one after the other; arrays; groups (runs of rows).

    `model` is what only the file keeps.
    """

    points: NDArray[np.float64]
    sizes: NDArray[np.int64]
    nodes: NDArray[np.int64]
    point_data: dict[str, Any] = field(default_factory=dict)
    cell_data: dict[str, Any] = field(default_factory=dict)
    model: tuple[str, ...] = ()
    groups: dict[str, list[range]] = field(default_factory=dict)

    @property
    def starts(self) -> NDArray[np.int64]:
        """(m,) where the nodes of each polygon start."""
        return np.cumsum(self.sizes) - self.sizes

    def grid(self) -> Any:
        """The polygons as an unstructured grid of pyvista.

        Raises
        ------
        ReadError
            If there are no polygons, or some with fewer than three corners.
        MeshError
            If a corner is no point.
        """
        import pyvista as pv

        if len(self.sizes) == 0:
            raise ReadError("it holds no faces, or only the beginning of a file")
        short = np.flatnonzero(self.sizes < 3)
        if len(short):
            raise ReadError(f"faces must have three corners or more; fewer have: {first_ids(short)}")
        bad = (self.nodes < 0) | (self.nodes >= len(self.points))
        if bad.any():
            cells = np.unique(np.repeat(np.arange(len(self.sizes)), self.sizes)[bad])
            raise MeshError(f"cells with node ids outside 0..{len(self.points) - 1}: {first_ids(cells)}")
        types = np.array([5, 9, 7], dtype=np.uint8)[np.minimum(self.sizes, 5) - 3]
        grid = pv.UnstructuredGrid(np.insert(self.nodes, self.starts, self.sizes), types, self.points)
        for name, values in self.point_data.items():
            grid.point_data.set_array(values, name)
        for name, values in self.cell_data.items():
            grid.cell_data.set_array(values, name)
        return grid

    def face_lists(self) -> list[list[int]]:
        """The nodes of each polygon."""
        nodes = iter(self.nodes.tolist())
        return [list(itertools.islice(nodes, size)) for size in self.sizes.tolist()]

    def array_names(self) -> list[str]:
        """The names of its arrays, in words."""
        return [f"point array {name!r}" for name in self.point_data] + [
            f"cell array {name!r}" for name in self.cell_data
        ]

    @classmethod
    def from_lists(cls, points: list[Any], faces: list[list[int]], model: tuple[str, ...] = ()) -> Polygons:
        """Polygons of a list of coordinates and a list of the nodes of each face."""
        sizes = np.array([len(face) for face in faces], dtype=np.int64)
        nodes = np.fromiter(itertools.chain.from_iterable(faces), np.int64, int(sizes.sum()))
        return cls(np.array(points, dtype=np.float64).reshape(-1, 3), sizes, nodes, model=model)

    @classmethod
    def from_grid(cls, grid: Any) -> tuple[Polygons, list[str]]:
        """The faces of an unstructured grid of pyvista in their order, and what is left out, in words."""
        face = np.isin(grid.celltypes, _FACES)
        rows = np.flatnonzero(face)
        point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
        cell_data = {name: np.asarray(grid.cell_data[name])[rows] for name in grid.cell_data}
        lost = [f"field data {name!r}" for name in grid.field_data]
        if not face.all():
            lost.append(f"{int((~face).sum())} vertices and lines")
        return cls(np.asarray(grid.points, np.float64), *cell_nodes(grid, rows), point_data, cell_data), lost


PutPoints = Callable[[bytes, NDArray[np.float64]], tuple[bytes, list[str]] | None]


def polygon_format(
    name: str,
    read: Callable[[Path], Polygons],
    write: Callable[[Path, Polygons], list[str]],
    put_points: PutPoints,
    holds_arrays: bool = False,
) -> Format:
    """The format of files of polygons, given what reads and writes them, and puts points into a file that came.

    A file whose arrays changed is written anew if the format holds arrays; otherwise the arrays are listed as lost.
    """
    put = partial(_put_points, put_points, holds_arrays)
    return Format(name, partial(_read, name, read), partial(_write, write), put_points=put)


def _read(name: str, read: Callable[[Path], Polygons], path: Path) -> FileContents:
    polygons = read(path)
    file = SourceFile(path, name, data=path.read_bytes(), cell_groups=polygons.groups, model=polygons.model)
    return FileContents(polygons.grid(), file)


def _write(write: Callable[[Path, Polygons], list[str]], target: Path, mesh: Any) -> list[str]:
    data, lost = to_pyvista(mesh)
    polygons, left_out = Polygons.from_grid(data.cast_to_unstructured_grid())
    return [*lost, *left_out, *write(target, polygons)]


def _put_points(
    put_points: PutPoints, holds_arrays: bool, file: SourceFile, mesh: Any
) -> tuple[bytes, list[str]] | None:
    changed = changed_arrays(mesh)
    if holds_arrays and any(changed):
        return None
    result = put_points(file.data, mesh.points)
    return None if result is None else (result[0], [*result[1], *named(changed)])
