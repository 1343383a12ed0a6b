"""Checks of points, and of numbers of nodes, whatever the cells are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids, unusable_points
from ..mesh import HexMesh, MixedMesh, blocks_of
from .finding import Finding, error, warning

__all__ = ["check_numbers", "check_places", "repeated_rows"]

_COINCIDENT_DISTANCE = 1e-12  # relative to the size of the mesh


def _check_finite(mesh: HexMesh | MixedMesh) -> list[Finding]:
    """Points that cannot be worked with."""
    bad, text = unusable_points(mesh.points, mesh.node_labels)
    return [error("not finite", bad, text)] if len(bad) else []


def check_numbers(mesh: HexMesh | MixedMesh) -> list[Finding]:
    """Points that cannot be worked with, and cells of nodes that are none."""
    found, count = _check_finite(mesh), len(mesh.points)
    cells = mesh.cells
    if len(cells) and (cells.min() < 0 or cells.max() >= count):
        blocks = blocks_of(mesh)
        bad = [block.places[((block.cells < 0) | (block.cells >= count)).any(axis=1)] for block in blocks]
        ids = np.sort(np.concatenate(bad))
        text = f"cells with node ids outside 0..{count - 1}: {first_ids(ids, mesh.cell_labels)}"
        if cells.min() == 1 and cells.max() == count:
            text += "; ids start at 1 here, subtract 1"
        found.append(error("bad index", ids, text))
    return found


def check_places(mesh: HexMesh | MixedMesh, what: str) -> list[Finding]:
    """Points in no cell, called `what`, and those that coincide."""
    found = []
    node_labels = mesh.node_labels
    used = np.zeros(len(mesh.points), dtype=bool)
    used[mesh.cells] = True
    unused = np.flatnonzero(~used)
    if len(unused):
        found.append(
            warning("unreferenced points", unused, f"points in no {what} (kept): {first_ids(unused, node_labels)}")
        )
    places = mesh.points - mesh.points.mean(axis=0)
    size = float(np.abs(places).max())
    # Points at one place lie side by side once sorted along a direction in which no two others of a grid do.
    key = places @ np.array([0.7390851332, 0.5671432904, 0.3637586203])
    order = np.argsort(key)
    order = order[used[order]]
    close = np.abs(np.diff(key[order])) <= 2 * _COINCIDENT_DISTANCE * size
    pairs = np.stack([order[:-1][close], order[1:][close]])
    pairs = pairs[:, np.abs(places[pairs[0]] - places[pairs[1]]).max(axis=1) <= _COINCIDENT_DISTANCE * size]
    if pairs.shape[1]:
        ids = np.unique(pairs)
        text = f"points that coincide with another: {first_ids(ids, node_labels)}; if they are one, merge them"
        found.append(warning("coincident points", ids, text))
    return found


def repeated_rows(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows (m, k), each sorted, that are there before already."""
    # Cells with equal sums of their ids and of their squares are candidates; few, so they can be compared.
    keys = (nodes * (nodes + 7919)).sum(axis=1)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    near = np.flatnonzero(keys[1:] == keys[:-1])
    if len(near) == 0:
        return near
    candidates = np.unique(np.concatenate([order[near], order[near + 1]]))
    _, first, inverse = np.unique(nodes[candidates], axis=0, return_index=True, return_inverse=True)
    again = first[inverse.ravel()] != np.arange(len(candidates))
    return np.asarray(candidates[again])
