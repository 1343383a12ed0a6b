"""A mesh, whatever it was made from, as a meshio.Mesh or a pyvista grid, and what cannot go along."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..common import WriteError
from ..mesh import HexMesh, MixedMesh
from .cell_types import MESHIO_TYPES, VTK_TYPES
from .format_tools.meshio_internals import cell_block
from .grid_cells import grid_blocks
from .meshio_mesh import MeshioOrigin, meshio_from_arrays
from .pyvista_mesh import PyvistaOrigin, grid_from_arrays
from .vtk_mesh import SOLIDS

__all__ = ["grid_from_meshio", "to_meshio", "to_pyvista"]


def to_meshio(mesh: HexMesh | MixedMesh) -> tuple[Any, list[str]]:
    """A new meshio.Mesh, and what of the mesh it cannot hold, in words."""
    if isinstance(mesh.origin, MeshioOrigin):
        return mesh.origin.updated_source(mesh), []
    if not isinstance(mesh.origin, PyvistaOrigin):
        return meshio_from_arrays(mesh), []
    return _meshio_from_grid(mesh.origin.updated_source(mesh).cast_to_unstructured_grid())


def to_pyvista(mesh: HexMesh | MixedMesh) -> tuple[Any, list[str]]:
    """A new pyvista grid, and what of the mesh it cannot hold, in words.

    Named sets become arrays of zeros and ones with the name of the set.
    """
    if isinstance(mesh.origin, PyvistaOrigin):
        return mesh.origin.updated_source(mesh), []
    if not isinstance(mesh.origin, MeshioOrigin):
        return grid_from_arrays(mesh), []
    return grid_from_meshio(mesh.origin.updated_source(mesh))


def _meshio_from_grid(grid: Any) -> tuple[Any, list[str]]:
    import meshio
    import pyvista as pv

    lost, blocks, places = [], [], []
    for code, block in grid_blocks(grid):
        if block.name != MESHIO_TYPES.get(code, "quad"):  # which a pixel is
            if code in SOLIDS:
                kind = pv.CellType(code).name.lower()
                raise WriteError(f"cells that only VTK's formats (.vtu, .vtk) hold: {len(block.rows)} of type {kind}")
            lost.append(f"{len(block.rows)} cells of VTK type {code}")
            continue
        blocks.append(cell_block(block.name, block.nodes))
        places.append(block.rows)
    fields = {}
    for name in grid.field_data:
        value = np.asarray(grid.field_data[name])
        # The one kind of field data meshio's formats know: number and dimension of a physical group.
        if value.dtype.kind in "iu" and value.shape == (2,):
            fields[name] = value
        else:
            lost.append(f"field data {name!r}")
    mesh = meshio.Mesh(
        np.array(grid.points, dtype=np.float64),
        blocks,
        point_data={name: np.array(grid.point_data[name], subok=False) for name in grid.point_data},
        cell_data={name: [np.asarray(grid.cell_data[name])[rows] for rows in places] for name in grid.cell_data},
        field_data=fields,
    )
    return mesh, lost


def grid_from_meshio(mesh: Any) -> tuple[Any, list[str]]:
    """A new pyvista grid of a meshio.Mesh, and what it cannot hold, in words."""
    import pyvista as pv

    lost = ["periodic nodes"] if mesh.gmsh_periodic is not None else []
    flat, types = [], []
    for block in mesh.cells:
        if block.type not in VTK_TYPES:
            raise WriteError(f"cells of type {block.type} cannot be written in VTK's formats")
        flat.append(np.column_stack([np.full(len(block.data), block.data.shape[1]), block.data]).ravel())
        types.append(np.full(len(block.data), VTK_TYPES[block.type], dtype=np.uint8))
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))  # in a plane they may have two coordinates
    grid = pv.UnstructuredGrid(np.concatenate(flat).astype(np.int64), np.concatenate(types), points)
    for name, array in mesh.point_data.items():
        grid.point_data.set_array(array, name)
    for name, parts in mesh.cell_data.items():
        if len({part.shape[1:] for part in parts}) > 1:
            lost.append(f"cell array {name!r}, whose shape differs between types of cells")
        else:
            grid.cell_data.set_array(np.concatenate(parts), name)
    for name, ids in mesh.point_sets.items():
        grid.point_data.set_array(_membership(ids, grid.n_points), _free_name(name, grid.point_data))
    for name, parts in mesh.cell_sets.items():
        # Gmsh's own sets name entities of its geometry, not cells.
        if not name.startswith("gmsh:"):
            members = [_membership(ids, len(block.data)) for ids, block in zip(parts, mesh.cells, strict=False)]
            grid.cell_data.set_array(np.concatenate(members), _free_name(name, grid.cell_data))
    for name, value in mesh.field_data.items():
        if str(name).startswith("med:"):
            continue
        try:
            grid.field_data.set_array(np.atleast_1d(value), str(name))
        except (TypeError, ValueError):
            lost.append(f"field data {name!r}")
    return grid, lost


def _membership(ids: Any, count: int) -> Any:
    result = np.zeros(count, dtype=np.uint8)
    if ids is not None and len(ids):
        result[np.asarray(ids, dtype=np.int64)] = 1
    return result


def _free_name(name: str, taken: Any) -> str:
    return name if name not in taken else f"set:{name}"
