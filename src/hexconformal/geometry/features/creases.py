"""Creases of a surface of triangles, some of them slivers: edges that are sharp, and no noise."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from ...mesh import connected_components, face_edges
from ..area_vectors import face_area_vectors, unit_vectors
from ..areas import slivers
from ..edges import EdgeTable
from ..faces import Faces
from .chains import chains
from .dihedral_angles import dihedral_angles
from .schedules import CreaseSchedule

__all__ = ["find_creases"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_ROUNDING = 1e-9  # radians


def find_creases(
    points: Floats, faces: Faces, table: EdgeTable, angle: float, schedule: CreaseSchedule | None = None
) -> Mask:
    """Find the edges that are sharp and make up creases.

    Creases go past a sliver on one side. Taken for noise are edges that lead nowhere, groups that are small, or short
    where they end in a face, and those half of whose nodes are corners on a surface that bends beside them, too.

    Parameters
    ----------
    points, faces, table
        The surface and its edges.
    angle
        Degrees between the normals of the two cells from which on an edge is sharp.
    schedule
        What is noise.

    Returns
    -------
    (e,) the edges of creases.
    """
    schedule = CreaseSchedule() if schedule is None else schedule
    border = table.counts != 2
    angles = _angles(points, faces, table, schedule.alike)
    creased = _without_detours(points, faces, table.nodes, angles > angle, border)
    creased &= _without_spurs(points, table.nodes, creased | border, schedule)
    return _without_noise(points, table, creased, angles, schedule.beside * angle)


def _angles(points: Floats, faces: Faces, table: EdgeTable, alike_within: float) -> Floats:
    """(e,) degrees between the normals on both sides of each edge, 0 where there are not two sides."""
    vectors = face_area_vectors(points, faces)
    a, b = table.sides.T
    normals = unit_vectors(vectors)
    around, confirmed = np.zeros_like(vectors), np.zeros(len(vectors), dtype=bool)
    np.add.at(around, a, vectors[b])
    np.add.at(around, b, vectors[a])
    alike = (normals[a] * normals[b]).sum(axis=1) > np.cos(np.radians(alike_within))
    confirmed[a[alike]] = confirmed[b[alike]] = True
    # The normal of a sliver is noise, unless a neighbour has the same: it takes that of its neighbours, where these do
    # not cancel each other.
    noise = slivers(points, faces) & ~confirmed & (np.linalg.norm(around, axis=1) > np.linalg.norm(vectors, axis=1))
    normals = np.where(noise[:, None], unit_vectors(around), normals)
    result = np.zeros(len(table.nodes))
    result[table.manifold] = dihedral_angles(normals, table)
    return result


def _without_detours(points: Floats, faces: Faces, edges: Ints, sharp: Mask, border: Mask) -> Mask:
    """Lead creases past a sliver on one side, where they go round it or zigzag: all its nodes on them, it stays one."""
    near: dict[int, set[int]] = defaultdict(set)
    for a, b in edges[sharp | border].tolist():
        near[a].add(b)
        near[b].add(a)
    on = np.zeros(len(points), dtype=bool)
    on[edges[sharp | border]] = True
    thin = faces.triangles[slivers(points, faces)[: len(faces.triangles)] & on[faces.triangles].all(axis=1)]
    keys, width = edges @ [len(points), 1], [len(points), 1]
    sides = np.sort(face_edges(thin), axis=1).reshape(-1, 3, 2)
    thin = thin[~border[np.searchsorted(keys, sides @ width)].any(axis=1)]
    changed = True
    while changed:
        changed = False
        for nodes in thin.tolist():
            changed |= _lead_past(points, near, *nodes)
    kept = np.array([(a, b) for a in near for b in near[a] if a < b], dtype=np.int64).reshape(-1, 2)
    return np.isin(keys, kept @ width) & ~border


def _lead_past(points: Floats, near: dict[int, set[int]], *nodes: int) -> bool:
    """Change the creases around one sliver; True if there was something to change."""
    for v, a, b in (nodes, nodes[1:] + nodes[:1], nodes[2:] + nodes[:2]):
        if not near[v] >= {a, b}:
            continue
        if len(near[v]) == 2:
            # Two edges that meet where no other does: the third will do.
            if b in near[a] or _straighter(points, near, v, a, b):
                near[a].add(b)
                near[b].add(a)
                for end in (a, b):
                    near[end].remove(v)
                del near[v]
                return True
        elif b not in near[a] and _shortest(points, v, a, b):
            # Two that run side by side to where others meet: that stays whose other end more meet at.
            end = a if len(near[a]) < len(near[b]) else b
            near[v].remove(end)
            near[end].remove(v)
            return True
    return False


def _shortest(points: Floats, v: int, a: int, b: int) -> bool:
    """True if the edge from a to b is the shortest of the triangle."""
    return bool(np.linalg.norm(points[a] - points[b]) < np.linalg.norm(points[[a, b]] - points[v], axis=1).min())


def _straighter(points: Floats, near: dict[int, set[int]], v: int, a: int, b: int) -> bool:
    """True if a crease from a to b turns less, also at both ends, by as much as it turns at v at least."""
    gained = [
        _turn(points[[*(near[end] - {v}), end, v]]) - _turn(points[[*(near[end] - {v}), end, other]])
        for end, other in ((a, b), (b, a))
        if len(near[end]) == 2
    ]
    return bool(gained) and sum(gained) >= -_ROUNDING


def _turn(path: Floats) -> float:
    one, two = np.diff(path, axis=0)
    return float(np.arctan2(np.linalg.norm(np.cross(one, two)), one @ two))


def _without_spurs(points: Floats, edges: Ints, sharp: Mask, schedule: CreaseSchedule) -> Mask:
    """Take away sharp edges that lead nowhere, and small groups: a crease is long, or joins others; noise is not."""
    kept, count = sharp.copy(), len(points)
    for _ in range(schedule.spurs):
        degree = np.bincount(edges[kept].ravel(), minlength=count)
        loose = kept & (degree[edges] == 1).any(axis=1)
        if not loose.any():
            break
        kept &= ~loose
    ids = np.flatnonzero(kept)
    group = _groups(edges[ids], count)
    degree = np.bincount(edges[ids].ravel(), minlength=count)
    ends = np.bincount(group, (degree[edges[ids]] == 1).any(axis=1))
    lengths = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    # What begins and ends in the middle of a face must be long, not only fine.
    size = np.where(ends > 0, np.bincount(group, lengths[ids]) / lengths.mean(), np.bincount(group))
    kept[ids[size[group] < schedule.smallest_group]] = False
    return kept


def _without_noise(points: Floats, table: EdgeTable, sharp: Mask, bends: Floats, least: float) -> Mask:
    """Take away groups with corners at half of their nodes, where half of the edges beside them bend, too."""
    kept, count = sharp.copy(), len(points)
    ids = np.flatnonzero(sharp)
    group = _groups(table.nodes[ids], count)
    at_node, at_cell = np.full(count, -1), np.full(int(table.sides.max(initial=-1)) + 1, -1)
    at_node[table.nodes[ids]] = group[:, None]
    inside = sharp[table.manifold]
    of_edge = np.full(len(sharp), -1)
    of_edge[ids] = group
    at_cell[table.sides[inside]] = of_edge[table.manifold[inside]][:, None]
    others = table.manifold[~inside]
    corner = chains(points, table.nodes[ids], np.zeros(count, dtype=bool)).corners
    bent = bends[others] > least
    number = int(group.max(initial=-1)) + 1
    noise = _mostly(at_node, corner, number)
    noise &= _mostly(at_cell[table.sides[~inside]], np.stack([bent, bent], axis=1), number)
    kept[ids[noise[group]]] = False
    return kept


def _mostly(group: Ints, true: Mask, number: int) -> Mask:
    """(number,) groups with members, at least half of which have a property; -1 is no group."""
    inside = group >= 0
    size = np.bincount(group[inside], minlength=number)
    return np.asarray((size > 0) & (2 * np.bincount(group[inside], true[inside], number) >= size))


def _groups(edges: Ints, count: int) -> Ints:
    """(e,) number of the connected group that each edge belongs to."""
    return np.unique(connected_components(edges, count)[edges[:, 0]], return_inverse=True)[1].ravel()
