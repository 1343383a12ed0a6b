"""A meshio.Mesh of what the sections of a file of Gmsh say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ...format_tools.meshio_files import permuted_nodes
from ...format_tools.meshio_internals import cell_block, gmsh_node_order
from .elements import NODE_ORDERS, ElementBlock, read_elements
from .entities import Entities, read_entities, read_partitioned_entities, read_physical_names
from .nodes import NodeTags, read_nodes
from .periodic import read_periodic
from .sections import Encoding, file_encoding, file_sections
from .views import COMPONENTS, read_view

__all__ = ["Contents", "read_mesh"]


@dataclass(frozen=True)
class Contents:
    """A meshio.Mesh, remarks, and the tags of its nodes and of all its cells."""

    mesh: Any
    notes: tuple[str, ...]
    node_tags: NDArray[np.int64]
    element_tags: NDArray[np.int64]


def read_mesh(data: bytes) -> Contents:
    """The mesh in the bytes of a file of version 2 or 4.1.

    Nodes and elements keep their order. Elements carry the numbers ``gmsh:physical`` (their first group) and
    ``gmsh:geometrical``, 0 for none, and ``gmsh:partition`` where there are partitions; every physical group with a
    name is a cell set too, since an element may be in several.

    Raises
    ------
    ReadError
        If the file is malformed or truncated, or has elements of a type that is not supported.
    """
    import meshio

    encoding, sections = file_encoding(data), file_sections(data)
    bodies = {section.name: data[section.body_start : section.body_end] for section in sections}
    if not {"Nodes", "Elements"} <= bodies.keys():
        raise ReadError("it has no $Nodes, or no $Elements")
    names = read_physical_names(bodies.get("PhysicalNames", b""))
    entities = _entities(bodies, encoding)
    nodes = read_nodes(bodies["Nodes"], encoding)
    tags = NodeTags(np.concatenate([np.empty(0, np.int64), *(block.tags for block in nodes)]))
    blocks, repeated = _without_repeated(read_elements(bodies["Elements"], encoding, entities))
    point_data: dict[str, Any] = {}
    if encoding.version.startswith("4"):
        owners = [np.tile([block.dimension, block.entity], (len(block.tags), 1)) for block in nodes]
        point_data["gmsh:dim_tags"] = np.concatenate(owners) if owners else np.empty((0, 2), np.int64)
    cell_data = _tag_arrays(blocks)
    for section in sections:
        if section.name in ("NodeData", "ElementData"):
            view = read_view(data[section.body_start : section.body_end], encoding, section.name)
            if view.values.shape[1] not in COMPONENTS:
                continue  # Gmsh itself knows no others
            if section.name == "NodeData":
                point_data.setdefault(view.name, view.on(tags.tags))
            else:
                cell_data.setdefault(view.name, [view.on(block.tags) for block in blocks])
    cells = [
        cell_block(block.type, tags.indices(block.nodes)[:, gmsh_node_order(block.type, block.nodes.shape[1])])
        for block in blocks
    ]
    cells = permuted_nodes(cells, NODE_ORDERS)
    sets: dict[str, list[Any]] = {name: _members(blocks, cells, *group, repeated) for name, group in names.items()}
    if entities:
        sets["gmsh:bounding_entities"] = [block.bounding for block in blocks]
    mesh = meshio.Mesh(
        np.concatenate([np.empty((0, 3)), *(block.points for block in nodes)]),
        cells,
        point_data=point_data,
        cell_data=cell_data,
        field_data={name: np.array(group) for name, group in names.items()},
        cell_sets=sets,
        gmsh_periodic=read_periodic(bodies["Periodic"], encoding, tags) if "Periodic" in bodies else None,
    )
    count = sum(len(rows) for rows, _ in repeated)
    notes = (f"{count} elements are in the file again, for a second physical group: taken once",) if count else ()
    return Contents(mesh, notes, tags.tags, np.concatenate([np.empty(0, np.int64), *(b.tags for b in blocks)]))


def _entities(bodies: dict[str, bytes], encoding: Encoding) -> Entities:
    """The entities of all sections of a file; version 2 has none."""
    found: Entities = {}
    if encoding.version.startswith("4"):
        for name, read in (("Entities", read_entities), ("PartitionedEntities", read_partitioned_entities)):
            if name in bodies:
                found |= read(bodies[name], encoding)
    return found


Repeated = list[tuple[NDArray[np.int64], NDArray[np.int64]]]  # by block: rows, and a further group of each


def _without_repeated(blocks: list[ElementBlock]) -> tuple[list[ElementBlock], Repeated]:
    """Version 2 has an element once for each of its physical groups: here it is once."""
    if all(len(block.groups) or not block.physical.any() for block in blocks):
        return blocks, [(np.empty(0, np.int64), np.empty(0, np.int64)) for _ in blocks]
    result, repeated = [], []
    for block in blocks:
        rows = np.column_stack([block.geometrical, block.nodes])
        # Rows that are the same have the same sum, and sums are sorted faster than rows.
        factors = np.random.default_rng(0).integers(1, 1 << 62, rows.shape[1])
        if len(np.unique(rows @ factors)) == len(rows):
            result.append(block)
            repeated.append((np.empty(0, np.int64), np.empty(0, np.int64)))
            continue
        _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        # The rows of np.unique point to the first of equal ones.
        original = first[inverse.ravel()]
        again = (original < np.arange(len(rows))) & (block.physical[original] != block.physical)
        kept = np.flatnonzero(~again)
        repeated.append((np.searchsorted(kept, original[again]), block.physical[again]))
        arrays = ("tags", "nodes", "geometrical", "physical", "partition")
        result.append(replace(block, **{name: getattr(block, name)[kept] for name in arrays}))
    return result, repeated


def _tag_arrays(blocks: list[ElementBlock]) -> dict[str, list[Any]]:
    """The numbers of the elements by block; those of groups and partitions where there are any."""
    arrays = {
        "gmsh:physical": [block.physical for block in blocks],
        "gmsh:geometrical": [block.geometrical for block in blocks],
        "gmsh:partition": [block.partition for block in blocks],
    }
    return {name: parts for name, parts in arrays.items() if any(part.any() for part in parts)}


def _members(
    blocks: list[ElementBlock], cells: list[Any], number: int, dimension: int, repeated: Repeated
) -> list[NDArray[np.int64]]:
    """By block, the elements of a physical group."""
    members = []
    for block, cell, (rows, groups) in zip(blocks, cells, repeated, strict=True):
        if cell.dim != dimension:
            members.append(np.empty(0, np.int64))
        elif number in block.groups:
            members.append(np.arange(len(block.tags)))
        else:
            members.append(np.union1d(np.flatnonzero(block.physical == number), rows[groups == number]))
    return members
