"""The table that says where the boundary of a motion goes."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common import ReadError, first_ids

__all__ = ["BoundaryMotion", "read_boundary"]


@dataclass(frozen=True)
class BoundaryMotion:
    """Where nodes (k,) of the boundary go: at times (t,) above 0, displacements (t, k, 3) from the initial place."""

    nodes: NDArray[np.int64]
    times: NDArray[np.float64]
    displacements: NDArray[np.float64]


def read_boundary(path: str | os.PathLike[str]) -> BoundaryMotion:
    """Read a table with the columns step or time, node, dx, dy, dz.

    Raises
    ------
    ReadError
        If the file cannot be read, a column is missing, a value is no number, or a time names other nodes than
        the first, or one twice.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise ReadError(f"cannot read {path}: it must be a regular file")
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            head, *rows = list(csv.reader(file, skipinitialspace=True)) or [[]]
    except (OSError, ValueError, csv.Error) as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    names = [name.strip().lower() for name in head]
    when = "time" if "time" in names else "step"
    missing = [name for name in (when, "node", "dx", "dy", "dz") if name not in names]
    if missing:
        raise ReadError(f"{path} has no column {', '.join(missing)}; needed are step or time, node, dx, dy, dz")
    columns = [names.index(name) for name in (when, "node", "dx", "dy", "dz")]
    rows = [row for row in rows if row]
    try:
        table = np.array([[float(row[column]) for column in columns] for row in rows]).reshape(-1, 5)
    except (ValueError, IndexError) as problem:
        raise ReadError(f"{path} has rows that are not numbers: {problem}") from problem
    if len(table) == 0 or not np.isfinite(table).all() or (table[:, 1] % 1 != 0).any() or table[:, 0].min() <= 0:
        raise ReadError(
            f"{path} needs rows of finite numbers, whole node ids, and times above 0, where the mesh starts"
        )
    times, counts = np.unique(table[:, 0], return_counts=True)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    nodes = table[: counts[0], 1].astype(np.int64)
    odd = np.flatnonzero(counts != counts[0])
    if len(odd) == 0:
        odd = np.flatnonzero((table[:, 1].reshape(len(times), -1) != nodes).any(axis=1))
    if len(odd) or len(np.unique(nodes)) < len(nodes):
        raise ReadError(f"{path}: every {when} names the same nodes, each once; {when}s that do not: {first_ids(odd)}")
    return BoundaryMotion(nodes, times, table[:, 2:].reshape(len(times), -1, 3))
