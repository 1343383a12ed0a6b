"""The patches that matched curves cut two surfaces into, and which of them belong together: sheets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...mesh import connected_components
from ..closest_point import SurfaceLocator
from ..edges import edge_table
from ..faces import Faces
from .paths import Path

__all__ = ["cut_patches", "matched_sheets"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def cut_patches(faces: Ints, curves: Ints) -> Ints:
    """(f,) patch of each face of a surface that edges (k, 2) cut."""
    table = edge_table(faces)
    width = int(faces.max()) + 1
    cut = np.isin(table.nodes[table.manifold] @ [width, 1], np.sort(curves, axis=1) @ [width, 1])
    return connected_components(table.sides[~cut], len(faces))


def matched_sheets(
    mesh: SurfaceLocator, patches: Ints, reference: SurfaceLocator, others: Ints, paths: list[Path]
) -> tuple[Ints, Ints]:
    """Find which patches of a mesh and of a reference belong together.

    To the left of a path is what is to the left of the curve that it follows; patches without curves belong to those
    that they are closest to.

    Parameters
    ----------
    mesh, reference
        The surfaces, with the same side out.
    patches, others
        (q,) and (f,) patch of each of their faces.
    paths
        What follows what.

    Returns
    -------
    (q,) and (f,) the sheet of each face, numbers from 0 on: each has faces of both surfaces.
    """
    count, number = int(patches.max()) + 1, int(others.max()) + 1
    votes = np.zeros((count, number))
    left, beside = _left_faces(mesh.faces), _left_faces(reference.faces)
    for path in paths:
        for way in (1, -1):
            ours = {patches[left[pair]] for pair in _pairs(path.nodes[::way]) if pair in left}
            theirs = {others[beside[pair]] for pair in _pairs(path.piece.nodes[::way]) if pair in beside}
            if len(ours) == len(theirs) == 1:
                votes[ours.pop(), theirs.pop()] += len(path.nodes)
    nearest = others[reference.closest(mesh.points[mesh.faces].mean(axis=1)).faces]
    close = np.zeros_like(votes)
    np.add.at(close, (patches, nearest), 1.0)
    lonely = ~votes.any(axis=1)
    votes[lonely] = close[lonely]
    back = patches[mesh.closest(reference.points[reference.faces].mean(axis=1)).faces]
    close = np.zeros_like(votes)
    np.add.at(close, (back, others), 1.0)
    lonely = ~votes.any(axis=0)
    votes[:, lonely] = close[:, lonely]
    pairs = np.concatenate(
        [
            np.column_stack([np.arange(count), count + votes.argmax(axis=1)]),
            np.column_stack([votes.argmax(axis=0), count + np.arange(number)]),
        ]
    )
    sheets = np.unique(connected_components(pairs, count + number), return_inverse=True)[1].ravel()
    return sheets[:count][patches], sheets[count:][others]


def _pairs(nodes: Ints) -> list[tuple[int, int]]:
    return list(zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True))


def _left_faces(faces: Ints) -> dict[tuple[int, int], int]:
    """The face to the left of each edge, by its nodes in the order in which the face has them."""
    table = Faces.of(faces)
    pairs = np.stack([table.corners, table.corners[table.around(1)]], axis=1)
    return dict(zip(map(tuple, pairs.tolist()), table.owners.tolist(), strict=True))
