"""Linear cells as quadratic ones, straight, with shared nodes between corners, and with all that came along."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..mesh import HexMesh, MixedMesh, blocks_of, counts_by_type, require_nodes
from .cell_types import VTK_TYPES
from .format_tools.meshio_internals import cell_block
from .grid_cells import grid_blocks
from .meshio_mesh import MeshioOrigin, from_meshio, meshio_blocks
from .pyvista_mesh import from_pyvista, require_in_vtk
from .raised_cells import RaisedCells
from .read_write import as_volume_mesh
from .source_file import SourceFile

__all__ = ["elevated"]

_ENTITIES = "gmsh:dim_tags"


def elevated(mesh: Any, nodes: int = 20) -> MixedMesh:
    """The mesh of quadratic cells that has the same shape.

    Nodes keep their numbers; those in the middle of edges, faces and cells come after them, each at the mean of its
    corners. Where what came was quadratic, and is taken by its corners, the new nodes take the place of those that were
    there. All that came along stays: arrays, with the mean of the corners if they are real numbers, otherwise with what
    all of the corners have, or else 0; sets of cells; sets of points, with the nodes between corners that are all in
    them, those on the boundary alone where the set is all on it; triangles, quadrilaterals and lines on faces and edges
    of the cells, which become quadratic, too; pairs of nodes that move together; labels, for further nodes numbers
    after the largest. What has no nodes between corners is told in the notes of the mesh.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes, of linear cells.
    nodes
        Of a hexahedron: 20 or 27. Tetrahedra get 10, wedges 15 or 18, pyramids 13 or 14.

    Raises
    ------
    MeshError
        If there are quadratic cells, or polyhedra; or cells with a repeated node, or of nodes that there are none of.
    OptionError
        If `nodes` is neither.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> elevated(box((2, 1, 1)), 20), elevated(box((2, 1, 1)), 27)
    (MixedMesh(32 points, 2 hexahedra of 20 nodes), MixedMesh(45 points, 2 hexahedra of 27 nodes))
    """
    linear = as_volume_mesh(mesh)
    require_nodes(linear)
    curved = [block for block in blocks_of(linear) if block.cell_type.straight]
    if curved:
        advice = "linearize=True (--linearize) takes them by their corners"
        raise MeshError(f"cells must be linear, and there are {counts_by_type(curved)}: {advice}")
    ordered = [np.sort(block.cells, axis=1) for block in blocks_of(linear)]
    repeated = [(one[:, 1:] == one[:, :-1]).any(axis=1) for one in ordered]
    collapsed = np.concatenate([block.places[bad] for block, bad in zip(blocks_of(linear), repeated, strict=True)])
    if len(collapsed):
        ids = first_ids(np.sort(collapsed), linear.cell_labels)
        raise MeshError(f"cells with a repeated node, such as wedges, have no order 2 here: {ids}")
    if linear.origin is None:
        raised = RaisedCells(linear, [], nodes)
        return MixedMesh(raised.points(), raised.solids, _point_data(linear, raised), linear.cell_data)
    take_in = _from_meshio if isinstance(linear.origin, MeshioOrigin) else _from_grid
    raised, result = take_in(linear, nodes)
    held = raised.on_points(linear.held) | result.held
    notes = tuple(dict.fromkeys([*linear.notes, *raised.notes, *result.notes]))
    selection = replace(result.origin.selection, held=held, notes=notes)
    return replace(result, origin=replace(result.origin, selection=selection))


def _point_data(linear: HexMesh | MixedMesh, raised: RaisedCells) -> dict[str, NDArray[Any]]:
    # Gmsh's entities of nodes are not means: without them its files are written in the version that has none.
    return {name: raised.on_points(array, name) for name, array in linear.point_data.items() if name != _ENTITIES}


def _from_meshio(linear: HexMesh | MixedMesh, nodes: int) -> tuple[RaisedCells, Any]:
    import meshio

    source = linear.origin.updated_source(linear)
    before = meshio_blocks(source)
    raised = RaisedCells(linear, before, nodes)
    # Of each new block the old one, and its rows there.
    first = np.array([block.rows[0] if len(block.rows) else -1 for block in before])
    olds = [int(np.flatnonzero((first >= 0) & (first <= block.rows[0]))[-1]) for block in raised.blocks]
    places = [block.rows - first[old] for block, old in zip(raised.blocks, olds, strict=True)]
    result = meshio.Mesh(
        raised.points(),
        [
            cell_block(block.name, block.nodes, list(source.cells[old].tags))
            for block, old in zip(raised.blocks, olds, strict=True)
        ],
        point_data=_point_data(linear, raised),
        cell_data={
            name: [np.asarray(parts[old])[rows] for old, rows in zip(olds, places, strict=True)]
            for name, parts in source.cell_data.items()
        },
        field_data=source.field_data,
        point_sets={name: raised.in_set(name, ids) for name, ids in source.point_sets.items()},
        cell_sets={name: _parts_of_set(str(name), parts, olds, places) for name, parts in source.cell_sets.items()},
        gmsh_periodic=None if source.gmsh_periodic is None else [
            [*link[:-1], raised.pairs(np.asarray(link[-1], dtype=np.int64).reshape(-1, 2))]
            for link in source.gmsh_periodic
        ],
        info=source.info,
    )  # fmt: skip
    for name in vars(source).keys() - vars(result).keys():
        setattr(result, name, getattr(source, name))
    file = _file(linear, raised, np.concatenate([block.rows for block in raised.blocks]))
    return raised, from_meshio(result, "keep", False, file, [one.cell_type.name for one in raised.solids])


def _parts_of_set(name: str, parts: Any, olds: list[int], places: list[NDArray[np.int64]]) -> list[Any]:
    """The members of a set of cells block by block."""
    found: list[Any] = []
    for old, rows in zip(olds, places, strict=True):
        part = parts[old] if old < len(parts) else None
        if part is None or name.startswith("gmsh:"):  # those that Gmsh adds for itself list other things than cells
            found.append(part)
        else:
            found.append(np.flatnonzero(np.isin(rows, np.asarray(part, dtype=np.int64))))
    return found


def _from_grid(linear: HexMesh | MixedMesh, nodes: int) -> tuple[RaisedCells, Any]:
    import pyvista as pv

    source = pv.wrap(linear.origin.updated_source(linear)).cast_to_unstructured_grid()
    raised = RaisedCells(linear, [block for _, block in grid_blocks(source)], nodes)
    require_in_vtk(raised.solids)
    types, sizes = source.celltypes.copy(), np.empty(source.n_cells, dtype=np.int64)
    for block in raised.blocks:
        types[block.rows] = VTK_TYPES.get(block.name, 0) or types[block.rows]
        sizes[block.rows] = block.nodes.size // len(block.rows)
    starts = np.cumsum(sizes) - sizes
    table = np.empty(int(sizes.sum()), dtype=np.int64)
    for block in raised.blocks:
        own = block.nodes.reshape(len(block.rows), -1)
        table[starts[block.rows][:, None] + np.arange(own.shape[1])] = own
    result: Any = pv.UnstructuredGrid(np.insert(table, starts, sizes), types, raised.points())
    for name, array in _point_data(linear, raised).items():
        result.point_data.set_array(array.reshape(len(array), -1) if array.ndim > 2 else array, name)
    result.GetCellData().DeepCopy(source.GetCellData())
    result.GetFieldData().DeepCopy(source.GetFieldData())
    file = _file(linear, raised, np.arange(source.n_cells))
    return raised, from_pyvista(result, "keep", False, file, [one.cell_type.name for one in raised.solids])


def _file(linear: HexMesh | MixedMesh, raised: RaisedCells, rows: NDArray[np.int64]) -> SourceFile | None:
    """The file that a mesh came from, with what it says of nodes and cells for those that there are now, from rows."""
    file = linear.origin.file
    if file is None:
        return None
    return replace(
        file,
        text="",
        data=b"",
        node_labels=raised.labels(file.node_labels),
        cell_labels=None if file.cell_labels is None else file.cell_labels[rows],
        type_names=None if file.type_names is None else file.type_names[rows],
        face_sets={name: raised.number[faces] for name, faces in file.face_sets.items()},
        coupled_pairs=tuple(replace(pairs, nodes=raised.pairs(pairs.nodes)) for pairs in file.coupled_pairs),
        other_cells=True,
    )
