"""Meshes from and to meshio.Mesh, which is never changed."""

from __future__ import annotations

import copy
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError
from ..mesh import CarriedCells, HexMesh, MixedMesh, NodePairs, blocks_of, cells_in_rows
from .carried_cells import of_meshio
from .format_tools.meshio_internals import cell_block
from .format_tools.tags import TAG_ARRAYS, tag_names
from .node_groups import NodeGroups, meshio_groups, meshio_node_sets
from .selection import HEXAHEDRA, Block, Selection, mesh_of, scatter_to_cells, select, with_straight_edges
from .source_file import SourceFile

__all__ = ["MeshioOrigin", "from_meshio", "meshio_blocks", "meshio_from_arrays"]

_QUADS = ("quad", "quad8", "quad9", "VTK_LAGRANGE_QUADRILATERAL")


@dataclass(frozen=True)
class MeshioOrigin:
    """A meshio.Mesh, and which of its cells are the hexahedra."""

    source: Any
    selection: Selection
    file: SourceFile | None = None

    @property
    def cell_groups(self) -> dict[str, NDArray[np.bool_]]:
        """Masks (m,) of the hexahedra in the sets of cells, by name; those that Gmsh adds for itself left out."""
        counts = [len(block.data) for block in self.source.cells]
        starts, groups = np.cumsum([0, *counts]), {}
        for name, parts in self.source.cell_sets.items():
            if str(name).startswith("gmsh:"):
                continue
            inside = np.zeros(starts[-1], dtype=bool)
            for part, start, count in zip(parts, starts, counts, strict=False):
                if part is not None and len(part):
                    inside[start : start + count][np.asarray(part)] = True
            groups[str(name)] = inside[self.selection.rows]
        return groups

    def tag_names(self, array: str) -> dict[int, str]:
        """Names of the tags of solid cells in an array; none for arrays that are no tags."""
        names = tag_names(self.source) if array in TAG_ARRAYS else {}
        return {tag: name for (dimension, tag), name in names.items() if dimension == 3}

    @property
    def coupled_pairs(self) -> list[NodePairs]:
        """Pairs of nodes of $Periodic, those of faces before those of curves, and those that the file couples else."""
        links = sorted(self.source.gmsh_periodic or [], key=lambda link: -int(link[0]))
        found = []
        for _, _, affine, nodes in links:
            whole = affine is not None and len(affine) == 16
            matrix = np.reshape(np.asarray(affine, dtype=np.float64), (4, 4)) if whole else None
            found.append(NodePairs(np.asarray(nodes, dtype=np.int64).reshape(-1, 2), "$Periodic", matrix))
        return [*found, *(() if self.file is None else self.file.coupled_pairs)]

    def updated_source(self, mesh: HexMesh | MixedMesh) -> Any:
        """A new meshio.Mesh that holds all of the source, with the points, cells and arrays of `mesh`."""
        import meshio

        old, rows = self.source, self.selection.rows
        same = np.array_equal(mesh.cells, self.selection.cells)
        if self.selection.higher_order and not same:
            raise MeshError(
                "the node order of linearized cells cannot be changed: convert the file to hexahedra of 8 nodes first"
            )
        blocks, start = [], 0
        cell_data: dict[str, list[Any]] = {name: [] for name in [*old.cell_data, *mesh.cell_data]}
        for number, block in enumerate(old.cells):
            count = len(block.data)
            mine = slice(*np.searchsorted(rows, [start, start + count]))
            places = rows[mine] - start
            nodes = copy.deepcopy(block.data)
            if len(places) and not same:
                nodes[places] = cells_in_rows(mesh, mine, nodes.shape[1])
            blocks.append(cell_block(block.type, nodes, list(block.tags)))
            for name, parts in cell_data.items():
                before = np.asarray(old.cell_data[name][number]) if name in old.cell_data else None
                values = mesh.cell_data.get(name)
                parts.append(
                    np.array(before) if values is None else scatter_to_cells(before, values[mine], places, count)
                )
            start += count
        result = meshio.Mesh(
            with_straight_edges(mesh.points, self.selection),
            blocks,
            point_data={name: array.copy() for name, array in mesh.point_data.items()},
            cell_data=cell_data,
            field_data=copy.deepcopy(old.field_data),
            point_sets=copy.deepcopy(old.point_sets),
            cell_sets=copy.deepcopy(old.cell_sets),
            gmsh_periodic=copy.deepcopy(old.gmsh_periodic),
            info=copy.deepcopy(old.info),
        )
        # Some readers hang more onto the mesh, such as the families of MED.
        for name in vars(old).keys() - vars(result).keys():
            setattr(result, name, copy.deepcopy(getattr(old, name)))
        return result

    @property
    def node_groups(self) -> NodeGroups:
        """Nodes by the names of sets and groups."""
        return meshio_groups(self.source)

    @property
    def node_sets(self) -> NodeGroups:
        """Nodes by the names of sets of nodes alone."""
        return meshio_node_sets(self.source)

    def carried_cells(self, corners: int) -> CarriedCells:
        """The cells with 1 to 4 corners, with their arrays and sets."""
        return of_meshio(self.source, corners)


def from_meshio(
    source: Any,
    other_cells: str,
    linearize: bool,
    file: SourceFile | None = None,
    types: Collection[str] = HEXAHEDRA,
) -> HexMesh | MixedMesh:
    """Take in a meshio.Mesh; see :func:`hexconformal.io.read_write.as_hex_mesh`."""
    selection = select(meshio_blocks(source), len(source.points), other_cells, linearize, types=types)
    cell_data = {}
    for name, parts in source.cell_data.items():
        arrays = [np.asarray(part) for part in parts]
        # An array that differs in shape from block to block stays where it is.
        if len({array.shape[1:] for array in arrays}) == 1:
            cell_data[name] = np.concatenate(arrays)[selection.rows]
    origin = MeshioOrigin(source, selection, file)
    return mesh_of(source.points, selection, source.point_data, cell_data, origin)


def meshio_blocks(source: Any) -> list[Block]:
    """The cells of a meshio.Mesh, block by block."""
    blocks, start = [], 0
    for block in source.cells:
        rows = np.arange(start, start + len(block.data))
        blocks.append(Block(block.type, block.dim, _nodes(block), rows))
        start += len(rows)
    return blocks


def meshio_from_arrays(mesh: HexMesh | MixedMesh) -> Any:
    """A meshio.Mesh of a mesh that was made from arrays."""
    import meshio

    blocks = blocks_of(mesh)
    return meshio.Mesh(
        mesh.points.copy(),
        [cell_block(block.cell_type.name, block.cells.copy()) for block in blocks],
        point_data={name: array.copy() for name, array in mesh.point_data.items()},
        cell_data={name: [array[block.places] for block in blocks] for name, array in mesh.cell_data.items()},
    )


def _nodes(block: Any) -> NDArray[np.int64]:
    if block.type.startswith("polyhedron"):
        faces = [face for cell in block.data for face in cell]
        return np.concatenate([np.ravel(face) for face in faces]) if faces else np.empty(0, dtype=np.int64)
    return np.asarray(block.data)
