"""Reader of the table of boundary displacements of a motion."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, ReadError, as_mask, first_ids
from ..mesh import HexMesh

__all__ = ["BoundaryMotion", "read_boundary"]


@dataclass(frozen=True)
class BoundaryMotion:
    """Motion of boundary nodes (k,): at times (t,) above 0, displacements (t, k, 3) from the initial place."""

    Attributes
    ----------
    nodes
        (k,) by the labels of the mesh's file, integers or strings; None if one row tells where all of them go.
    times
        (t,) above 0.
    displacements
        (t, k, 3) from the initial place; (t, 1, 3) for all nodes alike.
    """

    nodes: NDArray[Any] | None
    times: NDArray[np.float64]
    displacements: NDArray[np.float64]

    def on_mesh(self, mesh: HexMesh, moving: str | None = None) -> BoundaryMotion:
        """The same motion with the ids of the nodes in a mesh.

        Parameters
        ----------
        mesh
            The mesh; its labels, if its file has some, are those of the table.
        moving
            Name of the nodes that all go the same way, if the table names none.

        Raises
        ------
        OptionError
            If nodes are not in the mesh, or both the table and `moving` name them, or neither.
        """
        if (self.nodes is None) == (moving is None):
            there = "the table names its nodes" if self.nodes is not None else "the table has no column node"
            raise OptionError(f"either the table or moving must name the nodes: {there}, moving is {moving!r}")
        if self.nodes is None:
            ids = np.flatnonzero(as_mask(moving, len(mesh.points), "moving", mesh.named_nodes()).any(axis=-1))
            return replace(self, nodes=ids, displacements=np.repeat(self.displacements, len(ids), axis=1))
        labels = np.arange(len(mesh.points)) if mesh.node_labels is None else mesh.node_labels
        wanted = self.nodes if labels.dtype.kind == self.nodes.dtype.kind else self.nodes.astype(str)
        labels = labels if labels.dtype.kind == wanted.dtype.kind else labels.astype(str)
        order = np.argsort(labels, kind="stable")
        places = np.minimum(np.searchsorted(labels, wanted, sorter=order), len(labels) - 1)
        missing = wanted[labels[order[places]] != wanted]
        if len(missing):
            raise OptionError(f"nodes of the table that are not in the mesh: {first_ids(missing)}; {_example(labels)}")
        return replace(self, nodes=order[places])


def read_boundary(path: str | os.PathLike[str]) -> BoundaryMotion:
    """Read a table with the columns step or time, node, dx, dy, dz; without node, all nodes that move go alike.

    Raises
    ------
    ReadError
        If the file cannot be read, a column is missing, a value is no number, or a time names other nodes than
        the first, or one twice.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            head, *rows = list(csv.reader(file, skipinitialspace=True)) or [[]]
    except (OSError, ValueError, csv.Error) as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    names = [name.strip().lower() for name in head]
    when = "time" if "time" in names else "step"
    missing = [name for name in (when, "dx", "dy", "dz") if name not in names]
    if missing:
        raise ReadError(f"{path} has no column {', '.join(missing)}; needed are step or time, node, dx, dy, dz")
    columns = [names.index(name) for name in (when, "dx", "dy", "dz")]
    rows = [row for row in rows if row]
    try:
        table = np.array([[float(row[column]) for column in columns] for row in rows]).reshape(-1, 4)
        nodes = _labels([row[names.index("node")] if "node" in names else "0" for row in rows])
    except (ValueError, IndexError) as problem:
        raise ReadError(f"{path} has rows that are not numbers: {problem}") from problem
    if len(table) == 0 or not np.isfinite(table).all() or table[:, 0].min() <= 0:
        raise ReadError(
            f"{path} needs rows of finite numbers, whole node ids, and times above 0, where the mesh starts"
        )
    times, counts = np.unique(table[:, 0], return_counts=True)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    nodes = table[: counts[0], 1].astype(np.int64)
    bad = np.flatnonzero(counts != counts[0])
    if len(bad) == 0:
        bad = np.flatnonzero((table[:, 1].reshape(len(times), -1) != nodes).any(axis=1))
    if len(bad) or len(np.unique(nodes)) < len(nodes):
        raise ReadError(f"{path}: every {when} names the same nodes, each once; {when}s that do not: {first_ids(bad)}")
    return BoundaryMotion(nodes, times, table[:, 2:].reshape(len(times), -1, 3))
