"""Checks of points, and of numbers of nodes, whatever the cells are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids, unusable_points
from ..mesh import HexMesh, MixedMesh, cells_of_no_nodes
from .finding import Finding, error, warning

__all__ = ["check_numbers", "check_places", "repeated_rows"]

_COINCIDENT_DISTANCE = 1e-12  # relative to the size of the mesh


def _check_finite(mesh: HexMesh | MixedMesh) -> list[Finding]:
    """Points that cannot be worked with."""
    bad, text = unusable_points(mesh.points, mesh.node_labels)
    return [error("not finite", bad, text)] if len(bad) else []


def check_numbers(mesh: HexMesh | MixedMesh) -> list[Finding]:
    """Points that cannot be worked with, and cells of nodes that are none."""
    found = _check_finite(mesh)
    bad, text = cells_of_no_nodes(mesh)
    if len(bad):
        found.append(error("bad index", bad, text))
    return found


def check_places(mesh: HexMesh | MixedMesh, what: str) -> list[Finding]:
    """Points in no cell, called `what`, and those that coincide."""
    found = []
    node_labels = mesh.node_labels
    used = np.zeros(len(mesh.points), dtype=bool)
    used[mesh.cells] = True
    unused = np.flatnonzero(~(used | mesh.straightened))
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
