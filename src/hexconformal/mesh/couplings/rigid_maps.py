"""Rigid maps that take the nodes of pairs to each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import connected_components

__all__ = ["RigidMaps", "affine_map", "one_map", "several_maps"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_AXIS = 1e-9  # entries of a rotation this close to 0 and to 1 are rounding


@dataclass(frozen=True, eq=False)
class RigidMaps:
    """Maps x -> R x + t of pairs of points.

    Attributes
    ----------
    rotations
        (k, 3, 3) the matrix R of each pair; exactly the identity for translations.
    misfits
        (k,) distances between the first point and the image of the second.
    """

    rotations: Field
    misfits: Field


def affine_map(first: Field, second: Field, affine: Field, tolerance: float) -> RigidMaps | None:
    """The map (4, 4) that a file tells, if it is rigid and takes the second points (k, 3) to the first."""
    left, _, right = np.linalg.svd(affine[:3, :3])
    rotation = _tidied(left @ right)
    if np.abs(rotation - affine[:3, :3]).max() > 1e-6:
        return None
    misfits = np.linalg.norm(second @ affine[:3, :3].T + affine[:3, 3] - first, axis=1)
    return RigidMaps(np.tile(rotation, (len(first), 1, 1)), misfits) if misfits.max() <= tolerance else None


def one_map(first: Field, second: Field, tolerance: float) -> RigidMaps:
    """The map that fits best: a translation if it fits, else a rotation with one (W. Kabsch, Acta Cryst. A32 (1976)).

    Points on a line leave the rotation open; where no translation takes them to each other they have a misfit.

    Examples
    --------
    >>> square = np.array([[1.0, 0, 0], [2.0, 0, 0], [2.0, 0, 1], [1.0, 0, 1]])
    >>> one_map(square[:, [1, 0, 2]] * [-1, 1, 1], square, 1e-6).rotations[0]  # turned about z
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    x, y = first - first.mean(axis=0), second - second.mean(axis=0)
    misfits = np.linalg.norm(x - y, axis=1)
    rotation = np.eye(3)
    if misfits.max() > tolerance and not _on_a_line(second, tolerance):
        left, _, right = np.linalg.svd(x.T @ y)
        turned = _tidied(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)
        apart = np.linalg.norm(x - y @ turned.T, axis=1)
        if apart.max() < misfits.max():
            rotation, misfits = turned, apart
    return RigidMaps(np.tile(rotation, (len(first), 1, 1)), misfits)


def several_maps(first: Field, second: Field, tolerance: float) -> RigidMaps:
    """One map of all pairs; or translations, those of faces, and of edges and corners where two or three faces meet.

    What the latter leave over should have one map.
    """
    whole = one_map(first, second, tolerance)
    if whole.misfits.max() <= tolerance:
        return whole
    apart = first - second
    labels = _clusters(apart, tolerance)
    translations: list[Field] = []
    sizes = np.bincount(labels)
    for label in np.argsort(-sizes, kind="stable")[: (sizes > 2).sum()]:
        mine = labels == label
        # The pairs of a rotation about an axis have the same difference too, on a line along the axis.
        if not _on_a_line(second[mine], tolerance):
            translations.append(apart[mine].mean(axis=0))
    nearest = _nearest_combination(apart, translations)
    rest = nearest > 4.0 * tolerance
    if rest.all():
        return whole
    rotations, misfits = np.tile(np.eye(3), (len(apart), 1, 1)), np.where(rest, 0.0, nearest)
    if rest.any():
        left = one_map(first[rest], second[rest], tolerance)
        # A single pair always has a map: it is the one that is wrong.
        fits = left.misfits.max() <= tolerance and not _on_a_line(second[rest], tolerance)
        rotations[rest] = left.rotations if fits else np.eye(3)
        misfits[rest] = left.misfits if fits else nearest[rest]
    return RigidMaps(rotations, misfits)


def _on_a_line(points: Field, tolerance: float) -> bool:
    """True where points (k, 3) lie on a line, or at one place."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return len(spread) < 2 or bool(spread[1] <= tolerance)


def _tidied(rotation: Field) -> Field:
    """The rotation with exact zeros and ones on the axes; this changes the others in the second order only."""
    for value in (0.0, 1.0, -1.0):
        rotation = np.where(np.abs(rotation - value) < _AXIS, value, rotation)
    return rotation


def _clusters(vectors: Field, tolerance: float) -> Ints:
    """(k,) cluster of each vector (k, 3); vectors that agree are in one."""
    from scipy.spatial import cKDTree

    places, inverse = np.unique(np.round(vectors / tolerance), axis=0, return_inverse=True)
    near = cKDTree(places).query_pairs(2.0, output_type="ndarray")
    return connected_components(near.astype(np.int64), len(places))[inverse.ravel()]


def _nearest_combination(vectors: Field, translations: list[Field]) -> Field:
    """(k,) distances of vectors (k, 3) from sums of some of the translations, forwards or backwards."""
    from scipy.spatial import cKDTree

    sums = np.zeros((1, 3))
    for translation in translations[:6]:
        sums = np.concatenate([sums - translation, sums, sums + translation])
    sums = sums[np.linalg.norm(sums, axis=1) > 0.0]
    if len(sums) == 0:
        return np.full(len(vectors), np.inf)
    return np.asarray(cKDTree(sums).query(vectors)[0])
