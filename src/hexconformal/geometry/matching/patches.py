"""The patches that matched curves cut two surfaces into, and which of them belong together: sheets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...mesh import connected_components
from ..closest_point import SurfaceLocator
from ..edges import edge_table
from ..faces import Faces
from .paths import Path

__all__ = ["Sheets", "matched_sheets"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sheets:
    """Patches of two surfaces that belong together.

    Attributes
    ----------
    paths
        The paths that cut them.
    patches
        (q,) patch of each face of the mesh.
    ours, theirs
        (q,) and (f,) the sheet of each face of the mesh and of the reference: each has faces of both.
    alike
        (s,) sheets that are connected in the same way on both.
    beside
        Per path the sheets on both its sides.
    beside_patches
        Per path the patches of the mesh on both its sides.
    seen
        (p,) patches of the mesh that the reference has something for: beside none of its borders.
    """

    paths: list[Path]
    patches: Ints
    ours: Ints
    theirs: Ints
    alike: Mask
    beside: list[set[int]]
    beside_patches: list[set[int]]
    seen: Mask

    def unseen(self) -> list[bool]:
        """The paths beside a patch that the reference has nothing for."""
        return [not bool(self.seen[list(patches)].all()) for patches in self.beside_patches]

    def unlike(self) -> list[bool]:
        """The paths beside a sheet that is not connected in the same way on both."""
        return [not bool(self.alike[list(sheets)].all()) for sheets in self.beside]


def matched_sheets(mesh: SurfaceLocator, reference: SurfaceLocator, paths: list[Path]) -> Sheets:
    """Find which patches of a mesh and of a reference belong together.

    To the left of a path is what is to the left of the curve that it follows; patches without curves belong to those
    that they are closest to. Left out are curves beside a patch for which the reference has nothing, and where a sheet
    has other holes or parts in the mesh than in the reference, those around it.

    Parameters
    ----------
    mesh, reference
        The surfaces, with the same side out.
    paths
        What follows what.
    """
    found = _sheets(mesh, reference, paths)
    for rule in (Sheets.unseen, Sheets.unlike):
        dropped = {path.piece.curve for path, out in zip(found.paths, rule(found), strict=True) if out}
        if dropped:
            found = _sheets(mesh, reference, [path for path in found.paths if path.piece.curve not in dropped])
    return found


def _sheets(mesh: SurfaceLocator, reference: SurfaceLocator, paths: list[Path]) -> Sheets:
    patches = _cut(mesh.faces, [path.nodes for path in paths])
    others = _cut(reference.faces, [path.piece.nodes for path in paths])
    left, beside = _left_faces(mesh.faces), _left_faces(reference.faces)
    sides = []
    for path in paths:
        for way in (1, -1):
            ours = {int(patches[left[pair]]) for pair in _pairs(path.nodes[::way]) if pair in left}
            theirs = {int(others[beside[pair]]) for pair in _pairs(path.piece.nodes[::way]) if pair in beside}
            sides.append((ours, theirs))
    votes = np.zeros((int(patches.max()) + 1, int(others.max()) + 1))
    for i, (ours, theirs) in enumerate(sides):
        if len(ours) == len(theirs) == 1:
            votes[min(ours), min(theirs)] += len(paths[i // 2].nodes)
    seen = np.asarray(votes.any(axis=1))
    of_ours, of_theirs = _together(votes, mesh, patches, reference, others)
    sheets, own = [], []
    for i in range(len(paths)):
        one, other = sides[2 * i], sides[2 * i + 1]
        sheets.append({int(of_ours[i]) for i in one[0] | other[0]} | {int(of_theirs[i]) for i in one[1] | other[1]})
        own.append(one[0] | other[0])
    here, there = of_ours[patches], of_theirs[others]
    alike = _euler_characteristics(mesh.faces, here) == _euler_characteristics(reference.faces, there)
    # A hole that is a defect of the reference says nothing about the mesh.
    table = edge_table(reference.faces)
    open_faces = (table.counts == 1)[table.of_corners].reshape(len(others), -1).any(axis=1)
    alike[there[open_faces]] = True
    return Sheets(paths, patches, here, there, alike, sheets, own, seen)


def _cut(faces: Ints, chains: list[Ints]) -> Ints:
    """(f,) patch of each face of a surface that chains of nodes cut."""
    table, width = edge_table(faces), [int(faces.max()) + 1, 1]
    edges = np.concatenate([np.empty((0, 2), np.int64), *(np.column_stack([c[:-1], c[1:]]) for c in chains)])
    cut = np.isin(table.nodes[table.manifold] @ width, np.sort(edges, axis=1) @ width)
    return connected_components(table.sides[~cut], len(faces))


def _euler_characteristics(faces: Ints, sheets: Ints) -> Ints:
    """(s,) nodes - edges + faces of each sheet of a surface."""
    count = int(sheets.max()) + 1
    corners, after = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    of, width = np.repeat(sheets, faces.shape[1]), int(faces.max()) + 1
    nodes = np.unique(of * width + corners) // width
    edges = np.unique((of * width + np.minimum(corners, after)) * width + np.maximum(corners, after)) // width**2
    counts = [np.bincount(found, minlength=count) for found in (nodes, edges, sheets)]
    return np.asarray(counts[0] - counts[1] + counts[2])


def _together(
    votes: Floats, mesh: SurfaceLocator, patches: Ints, reference: SurfaceLocator, others: Ints
) -> tuple[Ints, Ints]:
    """The sheet of each patch of both surfaces, numbers from 0 on: each has those that most of its sides vote for."""
    count, number = votes.shape
    votes = votes.copy()
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
    return sheets[:count], sheets[count:]


def _pairs(nodes: Ints) -> list[tuple[int, int]]:
    return list(zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True))


def _left_faces(faces: Ints) -> dict[tuple[int, int], int]:
    """The face to the left of each edge, by its nodes in the order in which the face has them."""
    table = Faces.of(faces)
    pairs = np.stack([table.corners, table.corners[table.around(1)]], axis=1)
    return dict(zip(map(tuple, pairs.tolist()), table.owners.tolist(), strict=True))
