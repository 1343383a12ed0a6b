"""Reader of the table of boundary displacements of a motion."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, ReadError, agreed, as_mask, first_ids
from ..mesh import HexMesh, MixedMesh
from ..ranks import mpi

__all__ = ["BoundaryMotion", "read_motion"]


@dataclass(frozen=True)
class BoundaryMotion:
    """Motion of boundary nodes.

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

    def on_mesh(self, mesh: HexMesh | MixedMesh, moving: str | None = None, comm: Any = None) -> BoundaryMotion:
        """The same motion with the ids of the nodes in a mesh; of a piece that a rank has, of those that are there.

        Parameters
        ----------
        mesh
            The mesh; its labels, if its file has some, are those of the table.
        moving
            Name of the nodes that all go the same way, if the table names none.
        comm
            The ranks, all of which must call it with the :class:`hexconformal.ranks.MeshPiece` of each.

        Raises
        ------
        OptionError
            If nodes are not in the mesh, or both the table and `moving` name them, or neither.
        """
        with agreed(comm, named=False):
            if (self.nodes is None) == (moving is None):
                there = "the table names its nodes" if self.nodes is not None else "the table has no column node"
                raise OptionError(f"either the table or moving must name the nodes: {there}, moving is {moving!r}")
            if self.nodes is None:
                mask = as_mask(moving, len(mesh.points), "moving", mesh.named_nodes())
                ids = np.flatnonzero(mask if mask.ndim == 1 else mask.any(axis=1))
                return replace(self, nodes=ids, displacements=np.repeat(self.displacements, len(ids), axis=1))
        labels = np.arange(len(mesh.points)) if mesh.node_labels is None else mesh.node_labels
        named = self.nodes if labels.dtype.kind == self.nodes.dtype.kind else self.nodes.astype(str)
        labels = labels if labels.dtype.kind == named.dtype.kind else labels.astype(str)
        here = np.isin(named, labels)
        missing = ~(here if comm is None else _of_any(comm, here))
        with agreed(comm, named=False):
            if missing.any():
                raise OptionError(
                    f"nodes of the table must be in the mesh; others: {first_ids(named[missing])}; {_example(labels)}"
                )
        order = np.argsort(labels, kind="stable")
        places = order[np.searchsorted(labels, named[here], sorter=order)]
        return replace(self, nodes=places, displacements=self.displacements[:, here])


def _of_any(comm: Any, marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What any rank marks."""
    counts, found = marks.astype(np.int32), np.empty(len(marks), np.int32)
    comm.Allreduce(counts, found, mpi().MAX)
    return np.asarray(found > 0)


def read_motion(path: str | os.PathLike[str]) -> BoundaryMotion:
    """Read a table with the columns step or time, node, dx, dy, dz; without node, all nodes that move go alike.

    Raises
    ------
    ReadError
        If the file cannot be read, a column is missing, a value is no number, or a time names other nodes than
        the first, or one twice.
    """
    if not os.path.exists(path):
        raise ReadError(f"{path} does not exist")
    if not os.path.isfile(path):
        raise ReadError(f"cannot read {path}: it must be a regular file")
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            head, *rows = list(csv.reader(file, skipinitialspace=True)) or [[]]
    except (OSError, ValueError, csv.Error) as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    names = [name.strip().lower() for name in head]
    when = "time" if "time" in names else "step"
    missing = [name for name in (when, "dx", "dy", "dz") if name not in names]
    if missing:
        raise ReadError(f"{path} must have the columns step or time, node, dx, dy, dz; missing: {', '.join(missing)}")
    columns = [names.index(name) for name in (when, "dx", "dy", "dz")]
    rows = [row for row in rows if row]
    try:
        table = np.array([[float(row[column]) for column in columns] for row in rows]).reshape(-1, 4)
        nodes = _labels([row[names.index("node")] if "node" in names else "0" for row in rows])
    except (ValueError, IndexError) as problem:
        raise ReadError(f"rows of {path} must be numbers: {problem}") from problem
    if len(table) == 0 or not np.isfinite(table).all() or table[:, 0].min() <= 0:
        raise ReadError(
            f"{path} must have rows of finite numbers, whole node ids, and times above 0, where the mesh starts"
        )
    times, counts = np.unique(table[:, 0], return_counts=True)
    order = np.lexsort((nodes, table[:, 0]))
    table, nodes = table[order], nodes[order]
    first = nodes[: counts[0]]
    bad = np.flatnonzero(counts != counts[0])
    if len(bad) == 0:
        bad = np.flatnonzero((nodes.reshape(len(times), -1) != first).any(axis=1))
    if len(bad) or len(np.unique(first)) < len(first):
        raise ReadError(
            f"{path}: every {when} must name the same nodes, each once; {when}s that do not: {first_ids(bad)}"
        )
    displacements = table[:, 1:].reshape(len(times), -1, 3)
    return BoundaryMotion(first if "node" in names else None, times, displacements)


def _labels(names: list[str]) -> NDArray[Any]:
    """Integers if they all are whole numbers, otherwise strings such as PART-1.5."""
    try:
        numbers = np.array([float(name) for name in names])
    except ValueError:
        return np.array([name.strip() for name in names])
    if not np.isfinite(numbers).all() or (numbers % 1 != 0).any() or (np.abs(numbers) >= 2.0**53).any():
        raise ValueError("nodes must be whole node ids, or labels such as PART-1.5")
    return numbers.astype(np.int64)


def _example(labels: NDArray[Any]) -> str:
    return f"its nodes are called {', '.join(str(label) for label in labels[:3].tolist())}, ..."
