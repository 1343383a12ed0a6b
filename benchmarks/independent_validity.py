"""Are trilinear hexahedra valid? Told without the library: it is what the library is held against.

det J of a cell is a polynomial of degree two in each reference coordinate, so its values at 27 points give its
Bernstein coefficients: all positive, and it is positive everywhere; one of its values not positive, and it is not.
Where that does not decide, the cell is cut into eight, and those again.
"""

from __future__ import annotations

import itertools

import numpy as np

__all__ = ["corner_scaled_jacobian", "surely_invalid", "surely_valid"]

_SITES = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
_CUTS = 4  # how often cells are cut into eight
_ROUNDING = 1e-15  # of a determinant, over the cube of the cell's diameter
# Values at 0, 1/2, 1 to coefficients of degree two.
_TO_COEFFICIENTS = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])


def surely_valid(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(m,) cells whose det J is positive everywhere, beyond doubt by rounding."""
    return _bounds(points, cells)[0] > _rounding(points, cells)


def surely_invalid(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(m,) cells with a det J that is not positive somewhere, or not a number."""
    return ~(_bounds(points, cells)[1] > -_rounding(points, cells))


def corner_scaled_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(m,) smallest of the eight corners, 0 where an edge has no length."""
    frames = np.stack([_frames(points, cells, site) for site in _SITES], axis=1)
    lengths = np.linalg.norm(frames, axis=3).prod(axis=2)
    values = _determinant(frames)
    return np.clip(np.where(lengths > 0.0, values / np.where(lengths > 0.0, lengths, 1.0), 0.0), -1.0, 1.0).min(axis=1)


def _frames(points: np.ndarray, cells: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(m, 3, 3) derivatives of the trilinear map at a place of the unit cube, a row each."""
    x = (points[cells] - points[cells[:, :1]]).astype(np.longdouble)
    place = np.asarray(place, dtype=np.longdouble)
    shares = np.where(_SITES == 1, place, 1 - place)
    rows = []
    for axis in range(3):
        others = np.delete(shares, axis, axis=1).prod(axis=1)
        rows.append(np.einsum("a,mak->mk", others * (2 * _SITES[:, axis] - 1), x))
    return np.stack(rows, axis=1)


def _determinant(frames: np.ndarray) -> np.ndarray:
    return (np.cross(frames[..., 0, :], frames[..., 1, :]) * frames[..., 2, :]).sum(axis=-1)


def _rounding(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    x = points[cells]
    sizes = np.linalg.norm(x[:, :, None] - x[:, None], axis=3).max(axis=(1, 2))
    return _ROUNDING * sizes**3


def _bounds(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m,) a lower bound of det J in each cell, and the smallest value found."""
    lattice = itertools.product((0.0, 0.5, 1.0), repeat=3)
    values = np.stack([_determinant(_frames(points, cells, place)) for place in lattice], axis=1).reshape(-1, 3, 3, 3)
    c = np.einsum("ai,bj,ck,mijk->mabc", *[_TO_COEFFICIENTS] * 3, values)
    lower, least = np.full(len(cells), np.inf), values.min(axis=(1, 2, 3))
    owners = np.arange(len(cells))
    for cut in range(_CUTS + 1):
        corners = c[:, ::2, ::2, ::2].min(axis=(1, 2, 3))
        np.minimum.at(least, owners, corners)
        bounds = c.min(axis=(1, 2, 3))
        open_ = (bounds <= 0.0) & (least[owners] > 0.0) if cut < _CUTS else np.zeros(len(c), dtype=bool)
        np.minimum.at(lower, owners[~open_], bounds[~open_])
        c, owners = c[open_], owners[open_]
        for axis in (1, 2, 3):
            c, owners = np.concatenate(_halves(c, axis)), np.concatenate([owners, owners])
    return lower, least


def _halves(c: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of the two halves along an axis (de Casteljau)."""
    p, q, r = np.moveaxis(c, axis, 0)
    pq, qr = (p + q) / 2, (q + r) / 2
    middle = (pq + qr) / 2
    return np.stack([p, pq, middle], axis=axis), np.stack([middle, qr, r], axis=axis)
