"""Faces and edges found again by their nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..face_rows import face_keys, whole_faces

__all__ = ["parts_within", "same_rows"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def same_rows(rows: Ints) -> Ints:
    """For each row (k, j) of nodes the first row with the same nodes, in whatever order; triangles have one twice.

    Examples
    --------
    >>> same_rows(np.array([[0, 1], [2, 1], [1, 0]]))
    array([0, 1, 0])
    """
    ordered = face_keys(rows) if rows.shape[1] == 4 else np.sort(rows, axis=1)
    keys = list(ordered.T)
    width = int(ordered.max(initial=0)) + 1
    if width < 2**31:  # two nodes fit in one key, and fewer keys are sorted faster
        keys = [keys[k] * width + keys[k + 1] for k in range(0, len(keys) - 1, 2)] + keys[len(keys) // 2 * 2 :]
    order = np.lexsort(keys)
    changes = np.zeros(len(rows), dtype=bool)
    for key in keys:
        changes[1:] |= np.diff(key[order]) != 0
    # Sorting is stable: the first of equal rows leads them.
    leaders = np.maximum.accumulate(np.where(changes, np.arange(len(rows)), 0))
    result = np.empty(len(rows), dtype=np.int64)
    result[order] = order[leaders]
    return result


def parts_within(cells: Ints, parts: Ints, inside: Mask) -> Ints:
    """Faces or edges of cells all of whose nodes are in a set, each once, in the order of the cells.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    parts
        (p, j) corners of a cell that make up each of its faces, or edges.
    inside
        (n,) nodes of the set.

    Examples
    --------
    >>> from hexconformal.elements import FACES
    >>> parts_within(np.arange(8)[None], FACES, np.arange(8) < 4)
    array([[0, 3, 2, 1]])
    """
    near = cells[np.count_nonzero(inside[cells], axis=1) >= parts.shape[1]]
    found = near[:, parts].reshape(-1, parts.shape[1])
    found = found[inside[found].all(axis=1)]
    if parts.shape[1] == 4:
        found = whole_faces(found)
    return found[same_rows(found) == np.arange(len(found))]
