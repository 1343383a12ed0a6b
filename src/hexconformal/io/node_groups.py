"""Nodes by the names that a file gives to groups of nodes or cells."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["NodeGroups", "cell_array_groups", "meshio_groups", "meshio_node_sets"]

Mask = NDArray[np.bool_]


class NodeGroups(Mapping[str, Mask]):
    """Masks (n,) of nodes by the name of a group, made when they are asked for; names do not differ in case alone."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._groups: dict[str, list[Callable[[], Any]]] = {}
        self._names: dict[str, str] = {}

    def add(self, name: str, nodes: Callable[[], Any]) -> None:
        """Add what gives ids or a mask of nodes to a group."""
        self._groups.setdefault(name, []).append(nodes)
        self._names.setdefault(name.upper(), name)

    def __getitem__(self, name: str) -> Mask:
        mask = np.zeros(self._count, dtype=bool)
        for nodes in self._groups[name if name in self._groups else self._names[name.upper()]]:
            mask[nodes()] = True
        return mask

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name.upper() in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __len__(self) -> int:
        return len(self._groups)


def meshio_node_sets(mesh: Any) -> NodeGroups:
    """The sets of nodes of a meshio.Mesh, and the groups of nodes of MED."""
    groups = NodeGroups(len(mesh.points))
    for name, ids in mesh.point_sets.items():
        groups.add(str(name), partial(np.asarray, ids, dtype=np.int64))
    for tag, names in getattr(mesh, "point_tags", {}).items():
        for name in names:
            groups.add(name, partial(np.equal, mesh.point_data["point_tags"], tag))
    return groups


def meshio_groups(mesh: Any) -> NodeGroups:
    """The sets of a meshio.Mesh, the physical groups of Gmsh and the families of MED."""
    groups = meshio_node_sets(mesh)
    for name, parts in mesh.cell_sets.items():
        if not str(name).startswith("gmsh:"):
            rows = [None if part is None else np.asarray(part, dtype=np.int64) for part in parts]
            groups.add(str(name), partial(_nodes_of, mesh, rows))
    for name, value in mesh.field_data.items():
        if "gmsh:physical" in mesh.cell_data and np.size(value) == 2:
            groups.add(str(name), partial(_of_physical_group, mesh, *np.ravel(value)))
    for tag, names in getattr(mesh, "cell_tags", {}).items():
        for name in names:
            groups.add(name, partial(_of_family, mesh, tag))
    return groups


def _nodes_of(mesh: Any, rows: list[Any]) -> Any:
    """Nodes of cells, given by rows or masks for each block."""
    parts = [
        np.asarray(block.data)[part].ravel()
        for block, part in zip(mesh.cells, rows, strict=False)
        if part is not None and len(part) and not block.type.startswith("poly")
    ]
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def _of_physical_group(mesh: Any, number: int, dimension: int) -> Any:
    pairs = zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True)
    return _nodes_of(mesh, [(np.asarray(part) == number) & (block.dim == dimension) for block, part in pairs])


def _of_family(mesh: Any, tag: int) -> Any:
    return _nodes_of(mesh, [np.asarray(part) == tag for part in mesh.cell_data["cell_tags"]])


def cell_array_groups(
    count: int, arrays: Mapping[str, Any], offsets: NDArray[np.int64], nodes: NDArray[np.int64]
) -> NodeGroups:
    """By the names of arrays of integers on the cells of a grid, nodes of cells where these are not 0."""
    groups = NodeGroups(count)
    for name, array in arrays.items():
        values = np.asarray(array)
        if values.ndim == 1 and values.dtype.kind in "biu":
            groups.add(name, partial(_where, nodes, np.repeat(values != 0, np.diff(offsets))))
    return groups


def _where(nodes: Any, mask: Any) -> Any:
    return nodes[mask]
